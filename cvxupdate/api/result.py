"""What the results of all commands share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cvxupdate.api.arrays import optional
from cvxupdate.api.held import carried
from cvxupdate.api.model import Model
from cvxupdate.errors import InputError
from cvxupdate.spec import Spec
from cvxupdate.spec.given import spec_of
from cvxupdate.spec.write import Written

Rows = list[dict[str, Any]]


class Result:
    """Abstract. ``data`` is the frozen object that page and JSON are made of, whose fields are
    attributes of the result too; ``spec`` the problem that it answers."""

    def __init__(self, data: Any, spec: Spec, keep: Any = None) -> None:
        self.data, self.spec, self._keep = data, spec, keep

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "data":
            raise AttributeError(name)
        return getattr(self.data, name)

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *vars(self.data)})

    def _frame(self, tables: Mapping[str, Callable[[], Rows]], which: str) -> Any:
        """One of the result's tables as a pandas DataFrame."""
        if which not in tables:
            raise InputError(
                f"to_dataframe: there is no table {which!r}. Give one of {', '.join(tables)}."
            )
        return optional("pandas", "to_dataframe").DataFrame(tables[which]())

    def _rebuilt(self, written: Written | None) -> Spec | None:
        """The problem that a command wrote, read again."""
        return None if written is None else spec_of(written.tables)

    def _model(self, written: Written | None) -> Model | None:
        """The model that a command wrote; what its files live by comes along."""
        if written is None:
            return None
        return Model.of_tables(written.tables["model"], (self._keep,))


def moved(written: Written | None, folder: Any) -> Written | None:
    """A problem to be saved in ``folder``/updated, with kept arrays copied into ``folder``."""
    return None if written is None else Written(carried(written.tables, folder), written.head)

"""What `inspect` gives back."""

from __future__ import annotations

import html
import tomllib
from typing import Any

from cvxupdate.api.arrays import optional
from cvxupdate.errors import InputError
from cvxupdate.recordings.inspect import Inspection


class Inspected:
    """What a file holds: ``kind`` of recording, ``channels``, ``notes``, the ``block`` to paste."""

    def __init__(self, data: Inspection) -> None:
        self.data = data

    @property
    def kind(self) -> str:
        """frf, time, modes, or what else the file holds."""
        return self.data.kind

    @property
    def block(self) -> str:
        """A [[recordings]] block to start from, "" where there is none."""
        return self.data.block

    @property
    def notes(self) -> tuple[str, ...]:
        """What else is to be said."""
        return self.data.notes

    def table(self) -> dict[str, Any]:
        """The block as a table, to be changed and given to a `Problem`.

        Raises
        ------
        InputError
            When the file holds nothing that can be a recording.
        """
        if not self.block:
            raise InputError(f"{self.data.file}: holds no recording that can be told by itself.")
        table = dict(tomllib.loads(self.block)["recordings"][0])
        return {**table, "file": self.data.file} if "file" in table else table

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with a row for each channel."""
        pandas = optional("pandas", "to_dataframe")
        return pandas.DataFrame([vars(c) for c in self.data.channels])

    def __str__(self) -> str:
        return self.data.text()

    def __repr__(self) -> str:
        return f"Inspected({self.data.file!r}: {self.kind}, {len(self.data.channels)} channels)"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"

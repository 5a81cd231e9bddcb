"""Numbers that no quantity can have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from cvxupdate.keys import Loc
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.words import show

HUGE = 1e50
"""Larger than any quantity in SI, and small enough that the matrices' products do not overflow."""


@dataclass(frozen=True)
class Sizes:
    """No number of the model is larger than a quantity can be: its matrices would overflow."""

    needs: ClassVar[tuple[str, ...]] = ("nodes", "elements", "materials", "sections")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every number beyond `HUGE`."""
        m = case.spec.model
        places: list[tuple[Loc, Any]] = [(("model", "nodes", i), n) for i, n in enumerate(m.nodes)]
        places += [(("model", "materials", name), part) for name, part in m.materials.items()]
        places += [(("model", "sections", name), part) for name, part in m.sections.items()]
        places += [(("model", "elements", i), block) for i, block in enumerate(m.elements)]
        places += [(loc, row) for loc, _, row in case.rows()]
        for loc, part in places:
            for key, value in _values(part).items():
                if isinstance(value, (int, float)) and abs(value) > HUGE:
                    yield Complaint(
                        (*loc, key),
                        f"{show(value)} is larger than any quantity in SI.",
                        "Correct the number, or its unit.",
                    )


def _values(part: Any) -> Mapping[str, Any]:
    return vars(part)

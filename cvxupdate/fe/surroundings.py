"""What a row of an element may name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.spec.model import Material, Model, Section


@dataclass(frozen=True)
class Surroundings:
    """What a row may name: the text of the model, and the folder of the problem file."""

    text: Model
    folder: Path

    @property
    def active(self) -> tuple[str, ...]:
        """The active DOF kinds."""
        return tuple(self.text.dofs)

    def material(self, row: Any) -> Material:
        """The material of a row."""
        return self.text.materials[row.material]

    def section(self, row: Any) -> Section:
        """The section of a row."""
        return self.text.sections[row.section]

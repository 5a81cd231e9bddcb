"""The keys of a problem file: the pydantic base of every table, and the small types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, WrapValidator
from pydantic_core import PydanticCustomError, PydanticKnownError, core_schema

from cvxupdate.registry import ELEMENTS

Loc = tuple[str | int, ...]
"""A place in a problem file, e.g. ``("model", "elements", 0, "rows", 3, "nodes")``."""


class Part(BaseModel):
    """A table of the problem file: frozen; an unknown key, a number in quotes, NaN and infinity are
    errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Table:
    """Marks a list of rows that may be given as ``{ file = "x.csv" }`` as well; only the JSON
    Schema needs to know."""

    def __get_pydantic_json_schema__(
        self, core_schema: Any, handler: Callable[[Any], dict[str, Any]]
    ) -> dict[str, Any]:
        """The schema of the rows, or of the table that names a CSV file."""
        rows = handler(core_schema)
        file = {
            "type": "object",
            "properties": {"file": {"type": "string"}, "dataset": {"type": "string"}},
            "required": ["file"],
            "additionalProperties": False,
        }
        return {"anyOf": [rows, file]}


def one_of(wanted: str) -> WrapValidator:
    """One message for a union: ``wanted`` says in words what may stand here."""

    def check(value: Any, inner: Callable[[Any], Any]) -> Any:
        try:
            return inner(value)
        except ValidationError:
            raise PydanticCustomError("one_of", "{wanted}", {"wanted": wanted}) from None

    return WrapValidator(check)


class OneOf:
    """Marks text as one of the words that the registries know when the file is read."""

    def __init__(self, words: Callable[[], tuple[str, ...]]) -> None:
        self.words = words

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        """Checked as a literal is, with a literal's error."""
        return core_schema.no_info_plain_validator_function(self._check)

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """The words, as they are now."""
        return {"enum": list(self.words()), "type": "string"}

    def _check(self, value: Any) -> Any:
        words = [repr(word) for word in self.words()]
        if isinstance(value, str) and repr(value) in words:
            return value
        expected = " or ".join((*([", ".join(words[:-1])] if words[1:] else []), words[-1]))
        raise PydanticKnownError("literal_error", {"expected": expected})


DofKind = Literal["x", "y", "z", "rx", "ry", "rz"]
Id = Annotated[int, Field(ge=0, le=2**31 - 1)]
Text = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Vector = Annotated[
    tuple[float, float, float], one_of("a vector of three numbers, e.g. [0.0, 0.0, 1.0]")
]
Dofs = Annotated[tuple[DofKind, ...], Field(min_length=1)]
Names = Annotated[tuple[Text, ...], Field(min_length=1)]

PROPERTIES = (
    "stiffness",
    "mass",
    "damping",
    "E",
    "nu",
    "G",
    "rho",
    "A",
    "I",
    "Iy",
    "Iz",
    "J",
    "Ixx",
    "Iyy",
    "Izz",
    "thickness",
    "height",
    "width",
    "diameter",
    "wall",
    "Dx",
    "Dy",
    "D1",
    "Dxy",
    "k",
    "m",
    "c",
    "eta",
    "alpha",
    "beta",
    "Ip",
    "omega",
    "N",
    "kappa",
)
"""The order in which properties are listed; those of elements from outside follow."""


def property_words() -> tuple[str, ...]:
    """Every property that a parameter may change."""
    known = dict.fromkeys(of for kind in ELEMENTS.members() for of in kind.text.changes)
    return tuple(dict.fromkeys((*(of for of in PROPERTIES if of in known), *known, "generic")))


Of = Annotated[str, OneOf(property_words)]

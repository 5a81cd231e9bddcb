"""Fixed-width fields, directions, quantities and units of universal files."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import DOF_KINDS

# specific data types of data sets 55 and 58 that a structure's recording can have
QUANTITY = {
    2: "strain",
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
}
# length and force exponents of those quantities (the table of data set 58)
_EXPONENTS = {"displacement": (1, 0), "velocity": (1, 0), "acceleration": (1, 0), "force": (0, 1)}


@dataclass(frozen=True)
class Units:
    """Data set 164: numbers of the file divided by ``length`` (``force``) are in metres
    (newtons)."""

    length: float = 1.0
    force: float = 1.0
    stated: bool = False

    def scale(self, quantity: str, rotation: bool = False) -> float:
        """Factor to SI for a quantity; an angle has no length."""
        length, force = _EXPONENTS.get(quantity, (0, 0))
        if rotation:
            length = 1 if quantity == "force" else 0
        return float(1.0 / (self.length**length * self.force**force))


def fields(line: str, widths: tuple[int, ...]) -> list[str]:
    """A line cut into fields of the given widths, each stripped."""
    cut, at = [], 0
    for width in widths:
        cut.append(line[at : at + width].strip())
        at += width
    return cut


def integer(text: str, what: str) -> int:
    """An integer field, or a message that names it."""
    try:
        return int(text)
    except ValueError:
        raise RecordingError(f"{what} is {text!r}, not an integer") from None


def real(text: str, what: str) -> float:
    """A real field, with FORTRAN's D exponent, or a message that names it."""
    try:
        value = float(text.lower().replace("d", "e"))
    except ValueError:
        raise RecordingError(f"{what} is {text!r}, not a number") from None
    if not math.isfinite(value):
        raise RecordingError(f"{what} is {text!r}, not a finite number")
    return value


def direction(code: int) -> tuple[str, int]:
    """DOF kind and sign of a direction code -6 … 6; 0 (a scalar) gives ""."""
    if not -6 <= code <= 6:
        raise RecordingError(f"direction {code} is not one of -6 to 6")
    return ("" if code == 0 else DOF_KINDS[abs(code) - 1]), (-1 if code < 0 else 1)


def units_of(text: str) -> Units:
    """Data set 164."""
    lines = text.splitlines()
    words = " ".join(lines[1:]).split()
    length, force = real(words[0], "the length factor"), real(words[1], "the force factor")
    if length <= 0.0 or force <= 0.0:
        raise RecordingError("a unit factor is not positive")
    return Units(length, force, True)

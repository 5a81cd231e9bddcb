"""Units by name, to SI.

A unit is written as a product of named factors: ``"g"``, ``"mm/s^2"``, ``"in/s"``, ``"g/N"``,
``"(m/s²)/N"``, ``"kip"``, ``"100 mV/g"`` (a number in front is a factor). ``g`` is the standard
acceleration of gravity, as on an accelerometer's data sheet; a gram is ``gram``. A pound is a force
(``lb`` = ``lbf``); a pound of mass is ``lbm``. Values: BIPM, The International System of Units
(2019); NIST SP 811, Appendix B (exact conversions of inch, pound, gravity).
"""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.unit_names import ALIAS, BASE, PREFIX, PREFIXED, WRITTEN

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[A-Za-zμ%°][A-Za-z0-9_'.μ]*)"
    r"|(?P<power>\^|\*\*)\s*(?P<exponent>[-+]?\d+)|(?P<op>[*/()]))"
)

LEAST = 1e-30
"""Factors of a unit below this, or above its inverse, are slips of the pen (0 among them)."""

Dimension = tuple[int, int, int, int]
_FORCE: Dimension = (1, 1, -2, 0)
# quantity: dimension on a translation, on a rotation
_EXPECTED: dict[str, tuple[Dimension, Dimension]] = {
    "force": (_FORCE, (2, 1, -2, 0)),
    "displacement": ((1, 0, 0, 0), (0, 0, 0, 0)),
    "velocity": ((1, 0, -1, 0), (0, 0, -1, 0)),
    "acceleration": ((1, 0, -2, 0), (0, 0, -2, 0)),
    "strain": ((0, 0, 0, 0), (0, 0, 0, 0)),
    "voltage": ((0, 0, 0, 1), (0, 0, 0, 1)),
}


@dataclass(frozen=True)
class Unit:
    """A unit as a factor to SI and its dimension (powers of length, mass, time, voltage)."""

    factor: float
    dimension: Dimension


ONE = Unit(1.0, (0, 0, 0, 0))
"""The unit of a number."""


def _times(a: Unit, b: Unit, sign: int) -> Unit:
    dimension = tuple(x + sign * y for x, y in zip(a.dimension, b.dimension, strict=True))
    return Unit(a.factor * b.factor**sign, dimension)  # type: ignore[arg-type]


def _named(name: str, text: str) -> Unit:
    for candidate in (name, ALIAS.get(name, name)):
        if candidate in BASE:
            return Unit(*BASE[candidate])
        if "*" in candidate:
            return parse_unit(candidate)
    if name[0] in PREFIX and name[1:] in PREFIXED:
        inner = _named(name[1:], text)
        return Unit(PREFIX[name[0]] * inner.factor, inner.dimension)
    same = [known for known in BASE if known.lower() == name.lower()]
    if len(same) == 1:
        return Unit(*BASE[same[0]])
    near = difflib.get_close_matches(name, [*BASE, "mm", "kN", "mV"], n=3, cutoff=0.5)
    meant = f"; did you mean {' or '.join(near)}?" if near else "."
    raise RecordingError(
        f"unit {text!r}: {name!r} is not a unit cvxupdate knows{meant} "
        "Write a product of names such as m/s^2, g, in, lbf, kip, N, mm, V."
    )


def parse_unit(text: str) -> Unit:
    """The factor to SI and the dimension of a unit written as text, e.g. ``"mm/s^2"``,
    ``"(m/s²)/N"``, ``"100 mV/g"``.

    An empty text is the unit 1. A slash divides by the one factor (or bracket) that follows it,
    except that ``mm/s^2/N`` divides by both, as in common use. Raises `RecordingError` for a name
    or a form it does not know.
    """
    plain = _plain(text)
    if plain in ("", "-", "none", "NONE", "None"):
        return ONE
    reading = _Reading(text)
    place = 0
    while place < len(plain):
        match = _TOKEN.match(plain, place)
        if match is None:
            if plain[place:].strip() == "":
                break
            raise RecordingError(
                f"unit {text!r}: cannot read {plain[place:]!r}. Write a unit such as m/s^2, "
                "g/N, mm, 100 mV/g."
            )
        place = match.end()
        reading.take(match, plain[place:].lstrip())
    return reading.unit()


def _plain(text: str) -> str:
    """The text with one spelling of powers, products and the micro sign."""
    plain = text.strip().strip("[]").strip().replace("µ", "μ").replace("μ", "u")
    for written, meant in WRITTEN:
        plain = plain.replace(written, meant)
    plain = ALIAS.get(plain, plain)
    # s2 after a slash is the usual way to write a square in plain text
    return re.sub(r"(?<=/)s(ec)?(\*\*)?2\b", "s^2", plain)


class _Reading:
    """A unit that is read token by token: the product so far of every open bracket with the sign of
    its power, the last factor (for a power behind it), and the sign of the next one."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._stack: list[tuple[Unit, int]] = [(ONE, 1)]
        self._last: Unit | None = None
        self._sign = 1

    def take(self, match: re.Match[str], rest: str) -> None:
        """One token; ``rest`` is what follows it."""
        if match["op"] in ("*", "/"):
            self._sign = 1 if match["op"] == "*" else -1
        elif match["op"] == "(":
            self._stack.append((ONE, self._sign))
            self._sign, self._last = 1, None
        elif match["op"] == ")":
            if len(self._stack) < 2:
                raise RecordingError(
                    f"unit {self._text!r}: a closing bracket without an opening one."
                )
            inner, sign = self._stack.pop()
            self._times(inner, sign)
            self._sign, self._last = 1, None
        elif match["power"]:
            self._power(int(match["exponent"]))
        else:
            self._last = (
                self._number(match["number"])
                if match["number"]
                else _named(match["name"], self._text)
            )
            self._times(self._last, self._sign)
            if not rest.startswith(("^", "**")):
                self._sign = 1

    def unit(self) -> Unit:
        """The whole product."""
        if len(self._stack) != 1:
            raise RecordingError(f"unit {self._text!r}: an opening bracket is not closed.")
        unit = self._stack[0][0]
        if not (math.isfinite(unit.factor) and unit.factor > 0.0):
            raise RecordingError(f"unit {self._text!r}: its factor is not a positive number.")
        return unit

    def _number(self, digits: str) -> Unit:
        value = float(digits)
        if not LEAST <= value <= 1.0 / LEAST:
            raise RecordingError(
                f"unit {self._text!r}: the factor {digits} is not between {LEAST:g} and "
                f"{1.0 / LEAST:g}."
            )
        return Unit(value, ONE.dimension)

    def _times(self, factor: Unit, sign: int) -> None:
        product, outer = self._stack[-1]
        try:
            self._stack[-1] = (_times(product, factor, sign), outer)
        except (ZeroDivisionError, OverflowError) as error:
            raise RecordingError(
                f"unit {self._text!r}: its factor is not a positive number."
            ) from error

    def _power(self, exponent: int) -> None:
        if self._last is None or abs(exponent) > 9:
            raise RecordingError(
                f"unit {self._text!r}: a power must follow a unit's name and lie within -9 to 9."
            )
        for _ in range(abs(exponent - 1)):  # the first power is in already
            self._times(self._last, self._sign if exponent > 1 else -self._sign)
        self._last, self._sign = None, 1


def is_unit(text: str) -> bool:
    """True when `parse_unit` can read the text and it is not empty."""
    try:
        parse_unit(text)
    except RecordingError:
        return False
    return text.strip() not in ("", "NONE", "none")


def scale_to_si(
    quantity: str,
    unit: str,
    dof: str = "",
    sensitivity: float | str | None = None,
    sign: int = 1,
    per: str | None = None,
) -> float:
    """The factor from a value as recorded to SI, sign and sensitivity included.

    Parameters
    ----------
    quantity : one of `cvxupdate.recordings.types.QUANTITIES`.
    unit : unit of the recorded numbers; "" means SI already. For a ratio (an FRF) it is the ratio's
    unit, e.g. ``"g/N"``.
    dof : x … z or rx … rz; a rotation changes the dimension that is expected.
    sensitivity : the transducer's output per unit of the quantity, where the recorded numbers are
    its output (volts): a
        number in volts per SI unit, or text such as ``"100 mV/g"``.
    sign : +1 or -1 (a transducer mounted against the axis).
    per : the quantity of the reference for a ratio ("force" for an FRF), None for a plain channel.

    Raises `RecordingError` when the unit is unknown or does not measure the quantity (metres for an
    acceleration).
    """
    if sign not in (1, -1):
        raise RecordingError(f"sign is {sign}: it must be 1 or -1.")
    parsed = parse_unit(unit)
    factor, dimension = parsed.factor, parsed.dimension
    if sensitivity is not None:
        per_unit = (
            Unit(float(sensitivity), ONE.dimension)
            if isinstance(sensitivity, int | float)
            else parse_unit(sensitivity)
        )
        if isinstance(sensitivity, str):
            dimension = _times(Unit(1.0, dimension), per_unit, -1).dimension
        # a bare number is in volts (or whatever `unit` says) per SI unit: nothing left to check
        else:
            dimension = ONE.dimension
            unit = ""
        if not math.isfinite(per_unit.factor) or per_unit.factor == 0.0:
            raise RecordingError(f"sensitivity {sensitivity!r}: it must be a non-zero number.")
        factor /= per_unit.factor
    if unit.strip() or isinstance(sensitivity, str):
        _check_dimension(quantity, unit, dimension, dof.startswith("r"), per)
    return sign * factor


def _check_dimension(
    quantity: str, unit: str, dimension: Dimension, rotation: bool, per: str | None
) -> None:
    """Raise `RecordingError` unless the dimension is that of the quantity, or of its ratio to
    ``per``."""
    if quantity not in _EXPECTED:
        return
    expected = _EXPECTED[quantity][1 if rotation else 0]
    wanted = [expected]
    if per is not None:
        references = _EXPECTED["force"]
        if per not in ("force", "unknown"):
            references = _EXPECTED.get(per, references)
        # the file may name the response's unit alone: per newton is meant
        ratios = [_times(Unit(1.0, expected), Unit(1.0, r), -1).dimension for r in references]
        wanted = [*ratios, expected]
    if dimension not in wanted:
        hint = (
            'Give a sensitivity (e.g. "100 mV/g") to convert volts.'
            if dimension == (0, 0, 0, 1)
            else "Correct the unit or the quantity."
        )
        raise RecordingError(
            f"unit {unit!r} does not measure "
            f"{quantity}{' of a rotation' if rotation else ''}. {hint}"
        )

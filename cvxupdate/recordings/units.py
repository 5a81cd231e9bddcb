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

_G = 9.80665
_LBF = 0.45359237 * _G

# name: (factor to SI, (length, mass, time, voltage))
_BASE: dict[str, tuple[float, tuple[int, int, int, int]]] = {
    "m": (1.0, (1, 0, 0, 0)),
    "metre": (1.0, (1, 0, 0, 0)),
    "meter": (1.0, (1, 0, 0, 0)),
    "in": (0.0254, (1, 0, 0, 0)),
    "inch": (0.0254, (1, 0, 0, 0)),
    "ft": (0.3048, (1, 0, 0, 0)),
    "mil": (2.54e-5, (1, 0, 0, 0)),
    "thou": (2.54e-5, (1, 0, 0, 0)),
    "micron": (1e-6, (1, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "sec": (1.0, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "rpm": (1.0 / 60.0, (0, 0, -1, 0)),
    "kg": (1.0, (0, 1, 0, 0)),
    "gram": (1e-3, (0, 1, 0, 0)),
    "t": (1e3, (0, 1, 0, 0)),
    "lbm": (0.45359237, (0, 1, 0, 0)),
    "slug": (_LBF / 0.3048, (0, 1, 0, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "newton": (1.0, (1, 1, -2, 0)),
    "newtons": (1.0, (1, 1, -2, 0)),
    "lbf": (_LBF, (1, 1, -2, 0)),
    "lb": (_LBF, (1, 1, -2, 0)),
    "lbs": (_LBF, (1, 1, -2, 0)),
    "kip": (1000.0 * _LBF, (1, 1, -2, 0)),
    "kips": (1000.0 * _LBF, (1, 1, -2, 0)),
    "ozf": (_LBF / 16.0, (1, 1, -2, 0)),
    "kgf": (_G, (1, 1, -2, 0)),
    "kp": (_G, (1, 1, -2, 0)),
    "dyn": (1e-5, (1, 1, -2, 0)),
    "poundal": (0.45359237 * 0.3048, (1, 1, -2, 0)),
    "g": (_G, (1, 0, -2, 0)),
    "gn": (_G, (1, 0, -2, 0)),
    "g0": (_G, (1, 0, -2, 0)),
    "Gal": (0.01, (1, 0, -2, 0)),
    "ips": (0.0254, (1, 0, -1, 0)),
    "Pa": (1.0, (-1, 1, -2, 0)),
    "bar": (1e5, (-1, 1, -2, 0)),
    "psi": (_LBF / 0.0254**2, (-1, 1, -2, 0)),
    "J": (1.0, (2, 1, -2, 0)),
    "V": (1.0, (0, 0, 0, 1)),
    "volt": (1.0, (0, 0, 0, 1)),
    "volts": (1.0, (0, 0, 0, 1)),
    "rad": (1.0, (0, 0, 0, 0)),
    "deg": (math.pi / 180.0, (0, 0, 0, 0)),
    "rev": (2.0 * math.pi, (0, 0, 0, 0)),
    "strain": (1.0, (0, 0, 0, 0)),
    "ustrain": (1e-6, (0, 0, 0, 0)),
    "microstrain": (1e-6, (0, 0, 0, 0)),
    "1": (1.0, (0, 0, 0, 0)),
    "%": (0.01, (0, 0, 0, 0)),
}
_PREFIXED = ("m", "s", "Hz", "N", "Pa", "V", "rad", "g", "t", "strain", "lbf", "J", "Nm")
_PREFIX = {"G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "d": 1e-1, "m": 1e-3, "u": 1e-6, "n": 1e-9}
# spellings that are not factors joined by an operator
_ALIAS = {
    "Nm": "N*m",
    "g's": "g",
    "gs": "g",
    "newton-metre": "N*m",
    "in-lb": "in*lbf",
    "ft-lb": "ft*lbf",
    "lbs.": "lbf",
    "ue": "ustrain",
    "uE": "ustrain",
    "°": "deg",
    "degrees": "deg",
    "radians": "rad",
    "seconds": "s",
    "inches": "in",
    "feet": "ft",
    "newtonmeter": "N*m",
}
_WRITTEN = (
    ("²", "^2"),
    ("³", "^3"),
    ("·", "*"),
    ("⋅", "*"),
    ("×", "*"),
    ("N-m", "N*m"),
    ("N.m", "N*m"),
    ("uε", "ustrain"),
    ("uϵ", "ustrain"),
)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[A-Za-zμ%°][A-Za-z0-9_'.μ]*)"
    r"|(?P<power>\^|\*\*)\s*(?P<exponent>[-+]?\d+)|(?P<op>[*/()]))"
)

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


def _times(a: Unit, b: Unit, sign: int) -> Unit:
    dimension = tuple(x + sign * y for x, y in zip(a.dimension, b.dimension, strict=True))
    return Unit(a.factor * b.factor**sign, dimension)  # type: ignore[arg-type]


def _named(name: str, text: str) -> Unit:
    for candidate in (name, _ALIAS.get(name, name)):
        if candidate in _BASE:
            return Unit(*_BASE[candidate])
        if "*" in candidate:
            return parse_unit(candidate)
    if name[0] in _PREFIX and name[1:] in _PREFIXED:
        inner = _named(name[1:], text)
        return Unit(_PREFIX[name[0]] * inner.factor, inner.dimension)
    same = [known for known in _BASE if known.lower() == name.lower()]
    if len(same) == 1:
        return Unit(*_BASE[same[0]])
    near = difflib.get_close_matches(name, [*_BASE, "mm", "kN", "mV"], n=3, cutoff=0.5)
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
    plain = text.strip().strip("[]").strip().replace("µ", "μ").replace("μ", "u")
    for written, meant in _WRITTEN:
        plain = plain.replace(written, meant)
    if plain in ("", "-", "none", "NONE", "None"):
        return Unit(1.0, (0, 0, 0, 0))
    if plain in _ALIAS:
        plain = _ALIAS[plain]
    # s2 after a slash is the usual way to write a square in plain text
    plain = re.sub(r"(?<=/)s(ec)?(\*\*)?2\b", "s^2", plain)
    stack: list[tuple[Unit, int]] = [(Unit(1.0, (0, 0, 0, 0)), 1)]
    last: Unit | None = None
    sign, place = 1, 0
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
        if match["op"] in ("*", "/"):
            sign = 1 if match["op"] == "*" else -1
            continue
        if match["op"] == "(":
            stack.append((Unit(1.0, (0, 0, 0, 0)), sign))
            sign, last = 1, None
            continue
        if match["op"] == ")":
            if len(stack) < 2:
                raise RecordingError(f"unit {text!r}: a closing bracket without an opening one.")
            inner, outer_sign = stack.pop()
            stack[-1] = (_times(stack[-1][0], inner, outer_sign), stack[-1][1])
            sign, last = 1, None
            continue
        if match["power"]:
            if last is None or abs(int(match["exponent"])) > 9:
                raise RecordingError(
                    f"unit {text!r}: a power must follow a unit's name and lie within -9 to 9."
                )
            for _ in range(abs(int(match["exponent"]) - 1)):  # the first power is in already
                stack[-1] = (
                    _times(stack[-1][0], last, sign if int(match["exponent"]) > 1 else -sign),
                    stack[-1][1],
                )
            last, sign = None, 1
            continue
        last = (
            Unit(float(match["number"]), (0, 0, 0, 0))
            if match["number"]
            else _named(match["name"], text)
        )
        stack[-1] = (_times(stack[-1][0], last, sign), stack[-1][1])
        rest = plain[place:].lstrip()
        if not rest.startswith(("^", "**")):
            sign = 1
    if len(stack) != 1:
        raise RecordingError(f"unit {text!r}: an opening bracket is not closed.")
    if not (math.isfinite(stack[0][0].factor) and stack[0][0].factor > 0.0):
        raise RecordingError(f"unit {text!r}: its factor is not a positive number.")
    return stack[0][0]


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
            Unit(float(sensitivity), (0, 0, 0, 0))
            if isinstance(sensitivity, int | float)
            else parse_unit(sensitivity)
        )
        if isinstance(sensitivity, str):
            dimension = _times(Unit(1.0, dimension), per_unit, -1).dimension
        # a bare number is in volts (or whatever `unit` says) per SI unit: nothing left to check
        else:
            dimension = (0, 0, 0, 0)
            unit = ""
        if not math.isfinite(per_unit.factor) or per_unit.factor == 0.0:
            raise RecordingError(
                f"sensitivity {sensitivity!r}: it must be a number that is not zero."
            )
        factor /= per_unit.factor
    if (unit.strip() or isinstance(sensitivity, str)) and quantity in _EXPECTED:
        rotation = dof.startswith("r")
        expected = _EXPECTED[quantity][1 if rotation else 0]
        wanted = [expected]
        if per is not None:
            wanted = [
                _times(Unit(1.0, expected), Unit(1.0, ref), -1).dimension
                for ref in _EXPECTED["force"]
            ]
            if per not in ("force", "unknown"):
                wanted = [
                    _times(Unit(1.0, expected), Unit(1.0, ref), -1).dimension
                    for ref in _EXPECTED.get(per, ())
                ] or wanted
            wanted.append(expected)  # the file names the response's unit alone: per newton is meant
        if dimension not in wanted:
            hint = (
                'Give a sensitivity (e.g. "100 mV/g") to turn volts into it.'
                if dimension == (0, 0, 0, 1)
                else "Correct the unit or the quantity."
            )
            raise RecordingError(
                f"unit {unit!r} does not measure "
                f"{quantity}{' of a rotation' if rotation else ''}. {hint}"
            )
    return sign * factor

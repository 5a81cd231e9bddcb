"""Numbers for people: as many digits as they deserve, with their unit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

NOTHING = "–"
PREFIXED = ("Pa", "N/m", "N*m/rad", "N", "W")
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def number(value: float | None, digits: int = 4) -> str:
    """``digits`` significant digits; powers of ten outside 0.001 … 99 999; a dash for None and
    NaN."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)) + 1e-12)
    if -4 < size < 5:
        return _signs(f"{value:.{max(0, digits - 1 - size)}f}")
    return power(value, digits)


def short(value: float | None, digits: int = 5) -> str:
    """As `number`, without zeros at the end: for what a person wrote."""
    text = number(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text and "·" not in text else text


def typeset(text: str) -> str:
    """A sentence with 4.8e-09 written as 4.8·10⁻⁹."""
    return re.sub(
        r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?\d+)\b",
        lambda m: _signs(m[1]) + "·10" + str(int(m[2])).translate(SUPERSCRIPTS),
        text,
    )


def decimals(values: Iterable[float], most: int = 6) -> int:
    """Decimals that write every value as it was given, up to ``most``."""
    return max(
        (len(f"{v:.{most}f}".rstrip("0").split(".")[1]) for v in values if math.isfinite(v)),
        default=0,
    )


def power(value: float, digits: int = 2) -> str:
    """Scientific notation, e.g. 4.3·10⁻¹⁰."""
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return _signs(mantissa) + "·10" + str(int(exponent)).translate(SUPERSCRIPTS)


def signed(value: float | None, decimals: int = 2) -> str:
    """With its sign, ± digits after the point."""
    return (
        NOTHING if value is None or not math.isfinite(value) else _signs(f"{value:+.{decimals}f}")
    )


def fixed(value: float | None, decimals: int = 2) -> str:
    """A fixed number of decimals."""
    return NOTHING if value is None or not math.isfinite(value) else _signs(f"{value:.{decimals}f}")


def unit_text(unit: str) -> str:
    """The unit in print: kg/m^3 becomes kg/m³, N*m becomes N·m, 1 becomes nothing."""
    return (
        ""
        if unit == "1"
        else unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴").replace("*", "·")
    )


def prefix_of(unit: str, *values: float | None) -> tuple[float, str]:
    """(factor, unit) that bring the largest of the values between 1 and 1000, for units that are
    used with prefixes."""
    largest = max((abs(v) for v in values if v is not None and math.isfinite(v)), default=0.0)
    if unit in PREFIXED:
        for factor, letter in PREFIXES:
            if largest >= factor:
                return factor, letter + unit_text(unit)
    return 1.0, unit_text(unit)


def with_deviation(value: float, deviation: float | None, digits: int = 5) -> str:
    """``value ± deviation``, both cut where the deviation has its second digit."""
    if deviation is None or not math.isfinite(deviation):
        return number(value, digits)
    if deviation <= 0.0:
        return f"{number(value, digits)} ± 0"
    place = 1 - math.floor(math.log10(deviation) + 1e-12)
    if not -4 < math.log10(max(abs(value), deviation)) < 5 or place > 8:
        shown = "0" if abs(value) < 0.05 * deviation else power(value, digits)
        return f"{shown} ± {power(deviation, 2)}"
    cut = max(place, 0)
    return _signs(f"{round(value, place):.{cut}f} ± {round(deviation, place):.{cut}f}")


def seconds(value: float) -> str:
    """A time in the unit that suits it."""
    for limit, factor, unit in ((1e-3, 1e6, "µs"), (1.0, 1e3, "ms"), (120.0, 1.0, "s")):
        if value < limit:
            return f"{number(value * factor, 3)} {unit}"
    return f"{number(value / 60.0, 3)} min"


def count(n: int, one: str, many: str | None = None) -> str:
    """``1 mode``, ``2 modes``."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def _signs(text: str) -> str:
    return text.replace("-", "−")

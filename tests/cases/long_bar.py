"""A cantilever of many elements, too large for every DOF to be looked at each time."""

from __future__ import annotations

from tests.cases.cantilever import BAR


def text(elements: int, rows: str = "{ frequency = 10.0 }", extra: str = "") -> str:
    """A problem file: a bar of a metre in two groups of unequal lengths, with a table of modes."""
    nodes = ", ".join(f"{{ id = {i + 1}, x = {i / elements:.8g} }}" for i in range(elements + 1))
    first = 2 * elements // 5
    group = ["root"] * first + ["tip"] * (elements - first)
    parts = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "{group[i]}" }}'
        for i in range(elements)
    )
    return BAR.format(nodes=nodes, elements=parts, height=0.012, extra=extra, E="207e9", table=rows)

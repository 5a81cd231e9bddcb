"""Names of clauses for a page: those that say the same of many things stand in one line."""

from __future__ import annotations

from collections.abc import Sequence

ALIKE = 3
"""Clauses that say the same from which one line names them together."""
NAMED = 6
"""Things that such a line names at most."""


def clause_lines(names: Sequence[str], most: int = 20) -> list[str]:
    """``names`` ("thing: what holds of it") as ``most`` lines at most, in their order."""
    together: dict[str, list[str]] = {}
    for name in names:
        thing, _, holds = name.rpartition(": ")
        together.setdefault(holds, []).append(thing)
    lines, said = list[str](), set[str]()
    for name in names:
        holds = name.rpartition(": ")[2]
        things = together[holds]
        if len(things) < ALIKE or not all(things):
            lines.append(name)
        elif holds not in said:
            said.add(holds)
            rest = f" and {len(things) - NAMED} more" if len(things) > NAMED else ""
            lines.append(f"{holds}: {'; '.join(things[:NAMED])}{rest}")
    if len(lines) > most:
        return [*lines[:most], f"and {len(lines) - most} more"]
    return lines

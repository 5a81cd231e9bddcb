"""Which sets of elements a change may cover: single ones, runs along a line, patches of a plate,
whole groups."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property
from cvxupdate.physics.given import is_given
from cvxupdate.registry import ELEMENTS

STRAIGHT = 0.999  # cosine of the angle within which two elements go straight on
SHEETS = ("rectangle", "surface")  # outlines of plates
LONGEST = 4  # elements in a run; a plate's patch has at most 3 x 3


def member_sets(model: Model, of: str) -> list[tuple[tuple[int, ...], tuple[str, ...]]]:
    """(element numbers, groups) of every set for a property: single elements first, then groups,
    runs and patches; ``groups`` is filled where the set is one."""
    out: list[tuple[tuple[int, ...], tuple[str, ...]]] = []
    seen: set[tuple[int, ...]] = set()
    groups: dict[str, set[int]] = {}
    singles: dict[int, str] = {}
    lines: list[tuple[int, ...]] = []
    sheets = sheet_names()
    for block in model.blocks:
        if not has_property(block, of) or is_given(block):
            continue
        ids = block.ids.tolist()
        for i, g in zip(ids, block.groups, strict=True):
            groups.setdefault(g, set()).add(i)
            singles[i] = g
        lines += _runs(block.nodal, ids) if block.kind.nodes == 2 else []
        if block.kind.name in sheets:
            lines += _patches(model, block.nodal, ids)

    def add(ids: tuple[int, ...], names: tuple[str, ...]) -> None:
        key = tuple(sorted(ids))
        if key and key not in seen:
            seen.add(key)
            out.append((key, names))

    for i, name in singles.items():
        add((i,), (name,) if name and len(groups[name]) == 1 else ())
    for name, ids_of in groups.items():
        add(tuple(ids_of), (name,) if name else ())
    if len(groups) > 1:
        add(tuple(singles), tuple(name for name in groups if name))
    for member in straight(model, of):
        add(member, groups_that_are(member, groups))
    for run in lines:
        add(run, ())
    return out


def groups_that_are(ids: Collection[int], groups: Mapping[str, set[int]]) -> tuple[str, ...]:
    """The names of the groups that together are these elements; none where they are not."""
    inside = {name: members for name, members in groups.items() if members <= set(ids)}
    if set().union(*inside.values()) != set(ids):
        return ()
    return tuple(name for name in inside if name)


def sheet_names() -> frozenset[str]:
    """Types of elements that are sheets."""
    return frozenset(t.name for t in ELEMENTS.members() if t.text.outline in SHEETS)


def straight(model: Model, of: str) -> list[tuple[int, ...]]:
    """Whole members: line elements that follow each other straight on, whatever their groups; where
    several meet, each goes on along its own line.

    An element with an end that is wholly held counts as straight where only two meet.
    """
    ends: dict[int, list[tuple[int, np.ndarray]]] = {}
    found: list[int] = []
    for block in model.blocks:
        if block.kind.nodes != 2 or not has_property(block, of) or "length" not in block.properties:
            continue
        half = block.nodal.shape[1] // 2
        for i, row in zip(block.ids.tolist(), block.nodal, strict=True):
            nodes = [
                int(model.dof_node[part[part >= 0][0]]) if np.any(part >= 0) else -1
                for part in (row[:half], row[half:])
            ]
            found.append(i)
            a, b = nodes
            away = (
                model.xyz[b] - model.xyz[a] if min(nodes) >= 0 else np.full(3, np.nan)
            )  # an end that is held has no place here
            for node, side in ((a, 1.0), (b, -1.0)):
                if node >= 0:
                    ends.setdefault(node, []).append(
                        (i, side * away / max(float(np.linalg.norm(away)), 1e-300))
                    )
    pairs = [
        (i, j)
        for meeting in ends.values()
        for k, (i, away) in enumerate(meeting)
        for j, other in meeting[k + 1 :]
        for turn in [float(away @ other)]
        if turn < -STRAIGHT or (np.isnan(turn) and len(meeting) == 2)
    ]
    return [m for m in chained(found, pairs) if len(m) > 1]


def chained(items: Collection[int], pairs: Iterable[tuple[int, int]]) -> list[tuple[int, ...]]:
    """The ``items`` by which of them ``pairs`` join, in their order."""
    leader = {i: i for i in items}

    def lead(i: int) -> int:
        while leader[i] != i:
            i = leader[i]
        return i

    for i, j in pairs:
        leader[lead(j)] = lead(i)
    out: dict[int, list[int]] = {}
    for i in items:
        out.setdefault(lead(i), []).append(i)
    return [tuple(m) for m in out.values()]


def _runs(dofs: np.ndarray, ids: list[int]) -> list[tuple[int, ...]]:
    """Runs of two to `LONGEST` two-node elements that share nodes one after the other, as listed in
    the file."""
    half = dofs.shape[1] // 2
    out = []
    for start in range(len(ids)):
        run = [ids[start]]
        for k in range(start + 1, min(start + LONGEST, len(ids))):
            if not np.array_equal(dofs[k - 1, half:], dofs[k, :half]) or np.all(dofs[k, :half] < 0):
                break
            run.append(ids[k])
            out.append(tuple(run))
    return out


def _patches(model: Model, dofs: np.ndarray, ids: list[int]) -> list[tuple[int, ...]]:
    """Rectangular patches up to 3 x 3, full rows and columns, told by the elements' centres along
    the two axes over which they spread most; none where they lie in no such grid."""
    xyz = np.array(
        [
            model.xyz[model.dof_node[row[row >= 0]]].mean(axis=0)
            if np.any(row >= 0)
            else np.full(3, np.nan)
            for row in dofs
        ]
    )
    ok = np.isfinite(xyz[:, 0])
    if not ok.any():
        return []
    spread = np.ptp(xyz[ok], axis=0)
    xyz = xyz[:, np.sort(np.argsort(-spread, kind="stable")[:2])]
    xs, ys = (np.unique(np.round(xyz[ok, k], 6)) for k in (0, 1))
    if len(xs) * len(ys) > 4 * len(ids) + 16:
        return []
    grid = {
        (int(np.argmin(np.abs(xs - p[0]))), int(np.argmin(np.abs(ys - p[1])))): i
        for p, i in zip(xyz, ids, strict=True)
        if np.isfinite(p[0])
    }
    out = []
    for w, h in (
        (2, 1),
        (1, 2),
        (2, 2),
        (3, 1),
        (1, 3),
        (3, 2),
        (2, 3),
        (3, 3),
        (len(xs), 1),
        (1, len(ys)),
        (len(xs), 2),
        (2, len(ys)),
    ):
        for x in range(len(xs) - w + 1):
            for y in range(len(ys) - h + 1):
                cells = [(x + a, y + b) for a in range(w) for b in range(h)]
                if all(c in grid for c in cells):
                    out.append(tuple(grid[c] for c in cells))
    return out + _crosses(grid, len(xs), len(ys))


def _crosses(grid: dict[tuple[int, int], int], columns: int, rows: int) -> list[tuple[int, ...]]:
    """Crossing stiffeners on a full grid of elements: a strip across and one along, equally wide
    in elements."""
    strips = [
        [{(x + a, y) for a in range(w) for y in range(rows)} for x in range(columns - w + 1)]
        for w in (1, 2)
    ]
    bands = [
        [{(x, y + b) for x in range(columns) for b in range(h)} for y in range(rows - h + 1)]
        for h in (1, 2)
    ]
    return [
        tuple(grid[c] for c in sorted(across | along))
        for strip, band in zip(strips, bands, strict=True)
        for across in strip
        for along in band
        if (across | along) <= set(grid)
    ]

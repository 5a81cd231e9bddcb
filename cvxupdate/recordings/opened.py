"""The files that recordings name: opened once, refused where they are damaged, their nodes under
the model's numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Contents, Options, Point, Progress
from cvxupdate.recordings.read.wanted import Names
from cvxupdate.spec.recordings import Recording as Declared

Key = tuple[str, Options, str | None]
Opened = dict[Key, Contents]
"""Files that were read and are still needed: several recordings of one file read it once."""
LEAVE_OUT = "leave-out"
NAMED = 3
"""Damaged places that a message names."""


def key_of(declared: Declared, progress: Progress | None = None) -> Key:
    """What tells whether two recordings read one file in one way."""
    options = Options(
        declared.delimiter,
        declared.decimal,
        declared.encoding,
        declared.skip_rows,
        declared.header_lines,
        progress=progress,
    )
    return str(declared.file), options, declared.format


def contents_of(declared: Declared, opened: Opened, progress: Progress | None = None) -> Contents:
    """What the file of a recording holds.

    Raises
    ------
    RecordingError
        Where it cannot be read, where part of what was recorded is damaged and the recording does
        not say ``damaged = "leave-out"``, or where ``node_map`` names a node that it does not have.
    """
    if declared.file is None:
        raise RecordingError("a recording names no file.")
    key = key_of(declared, progress)
    if key not in opened:
        opened[key] = read_file(declared.file, key[1], declared.format)
    contents = opened[key]
    if contents.damage and declared.damaged != LEAVE_OUT:
        raise RecordingError(
            f"{contents.file}: {damage_words(contents.damage)}. Nothing of it was used: copy or "
            'export the file again, or set damaged = "leave-out" in the recording to use the rest.'
        )
    return renumbered(contents, declared.node_map, Names(declared.variables))


def damage_words(damage: tuple[str, ...]) -> str:
    """The first of several faults, and how many there are."""
    more = len(damage) - NAMED
    return "; ".join(damage[:NAMED]) + (f"; and {more} more" if more > 0 else "")


def said_of(contents: Contents) -> tuple[str, ...]:
    """What was left out of a file that is used all the same."""
    whole = (f"{damage_words(contents.damage)}: left out",) if contents.damage else ()
    return (*whole, *(f"{line}: it was left out" for line in contents.cut))


def renumbered(contents: Contents, node_map: Mapping[str, int], names: Names) -> Contents:
    """The same contents with the node numbers of the model: ``node_map`` from the file's."""
    if not node_map:
        return contents
    to = {int(node): now for node, now in node_map.items()}
    arrays = dict(contents.arrays)
    numbered = [names[who] for who in ("response_node", "reference_node") if names[who] in arrays]
    known = {p.node for f in contents.functions for p in (f.response, f.reference)}
    known |= {int(n) for shape in contents.shapes for n in shape.nodes}
    known |= {int(n) for key in numbered for n in np.ravel(arrays[key])}
    for node in to:
        if node not in known:
            has = ", ".join(str(n) for n in sorted(known)[:12]) or "none"
            raise RecordingError(
                f"{contents.file}: node_map names node {node}, which the file does not have. Its "
                f"nodes: {has}. Correct node_map."
            )

    def moved(point: Point) -> Point:
        return replace(point, node=to.get(point.node, point.node))

    for key in numbered:
        arrays[key] = np.array([to.get(int(n), int(n)) for n in np.ravel(arrays[key])])
    return replace(
        contents,
        arrays=arrays,
        functions=tuple(
            replace(f, response=moved(f.response), reference=moved(f.reference))
            for f in contents.functions
        ),
        shapes=tuple(
            replace(s, nodes=np.array([to.get(int(n), int(n)) for n in s.nodes]))
            for s in contents.shapes
        ),
    )

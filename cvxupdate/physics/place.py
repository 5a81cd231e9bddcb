"""Where an effect stands, and places in the words that a technician uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

TRANSLATIONS = ("x", "y", "z")
ROTATIONS = ("rx", "ry", "rz")
DRIVE_POINT = "at the drive point"
MOST = 12  # names in a list before the rest is only counted


@dataclass(frozen=True)
class Place:
    """A location in the contract's words."""

    nodes: tuple[int, ...] = ()
    elements: tuple[int, ...] = ()
    groups: tuple[str, ...] = ()
    dof: str | None = None

    def to_json(self) -> dict[str, object]:
        """The ``location`` of a finding."""
        out: dict[str, object] = {
            "nodes": list(self.nodes),
            "elements": list(self.elements),
            "groups": list(self.groups),
        }
        if self.dof is not None:
            out["dof"] = self.dof
        return out

    @property
    def turns(self) -> bool:
        """Whether it is about an axis: a stiffness or a damper there counts per radian."""
        return self.dof in ROTATIONS

    @property
    def short(self) -> str:
        """A label for tables: "e3, e4 (z)"."""
        where = self.groups or tuple(f"e{e}" for e in self.elements)
        where = where or tuple(f"n{n}" for n in self.nodes)
        at = ", ".join(where[:4]) + (" …" if len(where) > 4 else "")
        return (at or "the whole structure") + (f" ({self.dof})" if self.dof else "")


def channel_place(label: str) -> Place:
    """The place of a channel's label, ``n3.x``."""
    node, _, dof = label.partition(".")
    return Place(nodes=(int(node[1:]),), dof=dof)


def capital(text: str) -> str:
    """With a capital first."""
    return text[:1].upper() + text[1:]


def listed(names: Sequence[object], most: int = MOST) -> str:
    """ "1, 2 and 5"; what is beyond ``most`` is counted."""
    shown = [str(n) for n in names[:most]]
    if len(names) > most:
        return ", ".join(shown) + f" and {len(names) - most} more"
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


def all_together(names: Sequence[str]) -> str:
    """ "a, b and c together"; of none nothing."""
    if len(names) > 2:
        return f"{listed(names, len(names))} together"
    return " together with ".join(names)


def numbered(ids: Sequence[int]) -> str:
    """ "3, 5 to 9 and 12"."""
    runs: list[list[int]] = []
    for i in sorted(ids):
        if runs and i == runs[-1][-1] + 1:
            runs[-1].append(i)
        else:
            runs.append([i])
    parts = [
        item
        for run in runs
        for item in ([f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(i) for i in run])
    ]
    return listed(parts)


def where(place: Place) -> str:
    """A place as a thing: "node 5 (z)", "elements 3 to 6", "the joint of element 6 at node 7"."""
    along = f" ({place.dof})" if place.dof else ""
    if place.groups:
        kind = "group " if len(place.groups) == 1 else "groups "
        return kind + listed([f"'{g}'" for g in place.groups], 6)
    if place.elements and place.nodes:
        return f"the joint of element {place.elements[0]} at node {place.nodes[0]}"
    if place.elements:
        kind = "element " if len(place.elements) == 1 else "elements "
        return kind + numbered(place.elements)
    if place.nodes:
        kind = "node " if len(place.nodes) == 1 else "nodes "
        return kind + listed(place.nodes) + along
    return "the whole structure"


def drive_point(place: Place, driven: Sequence[str]) -> str:
    """ "at the drive point, node 5 (z)" where one of the DOFs ``driven`` ("n5.z") is that of the
    place, or of its node where it has no direction; else nothing."""
    for label in driven:
        there = channel_place(label)
        if not place.elements and place.nodes == there.nodes and place.dof in (None, there.dof):
            return f"{DRIVE_POINT}, {where(place)}"
    return ""


def at(place: Place) -> str:
    """A place as an answer to "where?": "at node 5 (z)", "between nodes 2 and 3 (x)", "in group
    'bar'"."""
    if place.groups or (place.elements and not place.nodes) or not place.nodes:
        return f"in {where(place)}"
    between = len(place.nodes) == 2 and not place.elements
    return f"{'between' if between else 'at'} {where(place)}"

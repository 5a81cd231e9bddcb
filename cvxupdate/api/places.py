"""Where a channel sits, in the forms that people and programs write it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.errors import InputError
from cvxupdate.recordings.types import DOF_KINDS
from cvxupdate.spec.mode_columns import dof_columns

MOST = 10**9


@dataclass(frozen=True)
class Place:
    """A DOF of the model and the ``sign`` of the direction: ``4:-Z`` is node 4, z, −1."""

    node: int
    dof: str
    sign: int = 1

    @property
    def label(self) -> str:
        """As the package writes it: ``n4.z``."""
        return f"n{self.node}.{self.dof}"


def place_of(given: Any, what: str = "a channel") -> Place:
    """A place from ``"n4.z"``, ``"4:-Z"``, ``(4, "z")``, ``(4, -3)`` (1 to 6 = x to rz, as in
    universal files) or a `Place`.

    Raises
    ------
    InputError
        When it is none of these.
    """
    if isinstance(given, Place):
        return given
    if isinstance(given, str):
        found = dof_columns([given])
        if found and not found[0].part:
            return Place(found[0].node, found[0].dof, found[0].sign)
    elif isinstance(given, Sequence) and len(given) == 2:
        try:
            made = _of_pair(*given)
        except (TypeError, ValueError, OverflowError):
            made = None
        if made is not None:
            return made
    raise InputError(
        f'{what}: {given!r} names no degree of freedom. Write it like "n6.y", "6:-Y" or (6, "y").'
    )


def _of_pair(node: Any, dof: Any) -> Place | None:
    if any(isinstance(x, complex | np.complexfloating) for x in (node, dof)):
        return None
    number = int(node)
    if isinstance(node, bool | str) or number != node or not 0 <= number < MOST:
        return None
    if isinstance(dof, str):
        kind = dof.strip().lower()
        plain = kind.lstrip("+-")
        if plain in DOF_KINDS and len(kind) - len(plain) <= 1:
            return Place(number, plain, -1 if kind.startswith("-") else 1)
        return None
    direction = int(dof)
    if direction != dof or not 1 <= abs(direction) <= len(DOF_KINDS):
        return None
    return Place(number, DOF_KINDS[abs(direction) - 1], -1 if direction < 0 else 1)


def places_of(given: Any, count: int | None, what: str) -> tuple[Place, ...]:
    """Places of several channels; one alone may be given without a list.

    Raises
    ------
    InputError
        When there are not ``count`` of them (None: any number).
    """
    if given is None:
        raise InputError(f'{what}: say where they are, e.g. ["n4.z", "n7.z"].')
    single = isinstance(given, str | Place) or (
        isinstance(given, tuple)
        and len(given) == 2
        and not isinstance(given[0], str | tuple | Place)
    )
    if single:
        given = [given]
    if not isinstance(given, Sequence):
        turned = getattr(given, "tolist", None)
        given = turned() if callable(turned) else given
    try:
        rows = list(given)
    except TypeError:
        raise InputError(f'{what}: give a list of places, e.g. ["n4.z", "n7.z"].') from None
    places = tuple(place_of(g, f"{what} {i + 1}") for i, g in enumerate(rows))
    if count is not None and len(places) != count:
        raise InputError(f"{what}: {len(places)} places for {count} channels. Give one for each.")
    return places

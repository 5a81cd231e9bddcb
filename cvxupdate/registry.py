"""The registries: which elements, constraints, regularisers and readers there are.

A registry is the list of its folder, read on first use, and what was registered from outside. It
knows the folder by name only, so the text of a problem file can be read by rooms that lie below the
members (`spec` sees their row models, never their matrices), and importing it loads nothing.

>>> from cvxupdate.registry import ELEMENTS
>>> ELEMENTS.register(Membrane)  # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import Any

from cvxupdate.errors import InputError


class Registry:
    """Members of one kind.

    ``home`` is "module:NAME" of the package's own list. ``label`` is the attribute that tells
    members apart: the word of the problem file, or the class's own name.
    """

    def __init__(self, kind: str, home: str, label: str = "name") -> None:
        self.kind, self.home, self.label = kind, home, label
        self._added: tuple[Any, ...] = ()

    def members(self) -> tuple[Any, ...]:
        """The list of the folder, then what was registered, in that order."""
        module, _, name = self.home.partition(":")
        return (*getattr(importlib.import_module(module), name), *self._added)

    def names(self) -> tuple[str, ...]:
        """The label of every member."""
        return tuple(getattr(member, self.label) for member in self.members())

    def named(self, name: str) -> Any:
        """The member of that label.

        Raises
        ------
        InputError
            When there is none.
        """
        for member in self.members():
            if getattr(member, self.label) == name:
                return member
        raise InputError(
            f"there is no {self.kind} called {name!r}. Known: {', '.join(self.names())}."
        )

    def register(self, member: Any) -> Any:
        """Add a member from outside the package; returns it, so that it may be used as a decorator.

        Raises
        ------
        InputError
            When a member of that label is there already.
        """
        name = getattr(member, self.label)
        if name in self.names():
            raise InputError(
                f"there is a {self.kind} called {name!r} already. Give the new one another name."
            )
        self._added = (*self._added, member)
        return member

    def unregister(self, member: Any) -> None:
        """Take out a member that was registered; the package's own stay."""
        self._added = tuple(m for m in self._added if m is not member)


ELEMENTS = Registry("element", "cvxupdate.fe.elements:ELEMENTS")
CONSTRAINTS = Registry("constraint", "cvxupdate.convex.constraints:CONSTRAINTS", "__name__")
REGULARISERS = Registry("regulariser", "cvxupdate.convex.regularisers:REGULARISERS")
READERS = Registry("reader", "cvxupdate.recordings.read:FORMATS")
EFFECTS = Registry("effect", "cvxupdate.physics:EFFECTS", "__class__")

"""What is worked out once for an object: a property that only the owners looked at last keep, and
figures that are kept as long as it lives."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

HELD = 4  # owners that keep theirs: a step of a fit looks at two points, a level at one more

T = TypeVar("T")


class recent(Generic[T]):
    """Like `functools.cached_property`, but of all owners only the last few that were looked at
    keep it: matrices of every point of a search would fill gigabytes, and most are not asked for
    again. What was let go is computed anew.

    The owner's class needs weak references, as plain classes have.
    """

    def __init__(self, compute: Callable[[Any], T]) -> None:
        self._compute = compute
        self._held: OrderedDict[int, tuple[weakref.ref[Any], T]] = OrderedDict()
        self.__doc__ = compute.__doc__

    @overload
    def __get__(self, owner: None, kind: type) -> recent[T]: ...

    @overload
    def __get__(self, owner: object, kind: type) -> T: ...

    def __get__(self, owner: object | None, kind: type) -> T | recent[T]:
        if owner is None:
            return self
        key = id(owner)
        there = self._held.get(key)
        if there is not None and there[0]() is owner:
            self._held.move_to_end(key)
            return there[1]
        found = self._compute(owner)
        self._held[key] = weakref.ref(owner, lambda gone: self._forget(key, gone)), found
        self._held.move_to_end(key)
        while len(self._held) > HELD:
            self._held.popitem(last=False)
        return found

    def _forget(self, key: int, gone: weakref.ref[Any]) -> None:
        there = self._held.get(key)
        if there is not None and there[0] is gone:  # the number may belong to another by now
            del self._held[key]


class Once(Generic[T]):
    """A function of objects whose value, a few figures, is kept as long as its object lives. Called
    by identity: what holds arrays has no hash."""

    def __init__(self, compute: Callable[[Any], T]) -> None:
        self._compute = compute
        self._known: dict[int, tuple[weakref.ref[Any], T]] = {}

    def __call__(self, owner: object) -> T:
        """Of an object."""
        key = id(owner)
        there = self._known.get(key)
        if there is not None and there[0]() is owner:
            return there[1]
        found = self._compute(owner)
        self._known[key] = weakref.ref(owner, lambda gone: self._forget(key, gone)), found
        return found

    def _forget(self, key: int, gone: weakref.ref[Any]) -> None:
        there = self._known.get(key)
        if there is not None and there[0] is gone:  # the number may belong to another by now
            del self._known[key]

"""What is worked out once for an object: a property that only the owners looked at last keep, and
figures that are kept as long as it lives."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

HELD = 4  # owners that keep theirs: a step of a fit looks at two points, a level at one more

T = TypeVar("T")


class Once(Generic[T]):
    """A function of objects whose value is kept as long as its object lives, by the ``most`` that
    were looked at last (None: by all; then it should be small). Kept by identity: what holds arrays
    has no hash."""

    def __init__(self, compute: Callable[[Any], T], most: int | None = None) -> None:
        self._compute = compute
        self._most = most
        self._held: OrderedDict[int, tuple[weakref.ref[Any], T]] = OrderedDict()

    def __call__(self, owner: object) -> T:
        """Of an object."""
        key = id(owner)
        there = self._held.get(key)
        if there is not None and there[0]() is owner:
            self._held.move_to_end(key)
            return there[1]
        found = self._compute(owner)
        self._held[key] = weakref.ref(owner, lambda gone: self._forget(key, gone)), found
        self._held.move_to_end(key)
        while self._most is not None and len(self._held) > self._most:
            self._held.popitem(last=False)
        return found

    def _forget(self, key: int, gone: weakref.ref[Any]) -> None:
        there = self._held.get(key)
        if there is not None and there[0] is gone:  # the number may belong to another by now
            del self._held[key]


class recent(Once[T]):
    """Like `functools.cached_property`, but of all owners only the last few that were looked at
    keep it: matrices of every point of a search would fill gigabytes, and most are not asked for
    again. What was let go is computed anew.

    The owner's class needs weak references, as plain classes have.
    """

    def __init__(self, compute: Callable[[Any], T]) -> None:
        super().__init__(compute, HELD)
        self.__doc__ = compute.__doc__

    @overload
    def __get__(self, owner: None, kind: type) -> recent[T]: ...

    @overload
    def __get__(self, owner: object, kind: type) -> T: ...

    def __get__(self, owner: object | None, kind: type) -> T | recent[T]:
        return self if owner is None else self(owner)

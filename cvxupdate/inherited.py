"""What a forked child sends back: new objects whole, and of what both have had before the fork only
which it is.

A fit holds its model, its recordings and the functions that effects bring: they were there before,
most are large, some cannot be sent, and a few are compared by identity.
"""

from __future__ import annotations

import functools
import marshal
import pickle
import sys
from collections.abc import Iterable
from io import BytesIO
from types import CellType, FunctionType, MethodType
from typing import Any

PLAIN = (type(None), bool, int, float, complex, str, bytes, type)
OWN = "cvxupdate"  # objects of its classes are looked into


class Inherited:
    """All that ``roots`` are made of, as it is before a fork."""

    def __init__(self, roots: Iterable[object]) -> None:
        self._objects: list[object] = []
        self._numbers: dict[int, int] = {}  # of an object that lives as long as this
        todo = list(roots)
        while todo:
            one = todo.pop()
            if isinstance(one, PLAIN) or id(one) in self._numbers:
                continue
            self._numbers[id(one)] = len(self._objects)
            self._objects.append(one)
            todo.extend(_parts(one))

    def packed(self, value: object) -> bytes:
        """In a child; whatever cannot be sent raises as `pickle` has it."""
        out = BytesIO()
        _Pickler(out, self._numbers).dump(value)
        return out.getvalue()

    def unpacked(self, sent: bytes) -> Any:
        """In the process that forked it."""
        return _Unpickler(BytesIO(sent), self._objects).load()


def _parts(one: object) -> Iterable[object]:
    if isinstance(one, tuple | list | set | frozenset):
        return one
    if isinstance(one, dict):
        return one.values()
    if isinstance(one, functools.partial):
        return (one.func, *one.args, *one.keywords.values())
    if isinstance(one, MethodType):
        return (one.__self__,)
    if isinstance(one, FunctionType):
        return [c.cell_contents for c in one.__closure__ or () if _filled(c)]
    if type(one).__module__.partition(".")[0] == OWN:
        return list(getattr(one, "__dict__", {}).values())
    return ()


def _filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018
    except ValueError:  # not given a value yet
        return False
    return True


class _Pickler(pickle.Pickler):
    def __init__(self, file: BytesIO, numbers: dict[int, int]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._numbers = numbers

    def persistent_id(self, obj: object) -> int | None:
        return None if isinstance(obj, PLAIN) else self._numbers.get(id(obj))

    def reducer_override(self, obj: object) -> Any:
        """A function that another one made: what effects bring is of that kind."""
        if not isinstance(obj, FunctionType) or "<" not in obj.__qualname__:
            return NotImplemented
        held = tuple(c.cell_contents for c in obj.__closure__ or ())
        code = marshal.dumps(obj.__code__)  # of this interpreter for this interpreter
        return _function, (code, obj.__module__, held, obj.__defaults__, obj.__kwdefaults__)


def _function(code: bytes, module: str, held: tuple[Any, ...], *defaults: Any) -> FunctionType:
    cells = tuple(CellType(value) for value in held)
    names = sys.modules[module].__dict__
    made = FunctionType(marshal.loads(code), names, None, defaults[0], cells)
    made.__kwdefaults__ = defaults[1]
    return made


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: BytesIO, objects: list[object]) -> None:
        super().__init__(file)
        self._objects = objects

    def persistent_load(self, pid: Any) -> object:
        return self._objects[pid]

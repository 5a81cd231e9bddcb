"""Independent tasks done ahead by children of this process, and taken in their order.

A child is a fork: what was computed before is there, and only results travel back. Whoever takes
them goes on as if each were done when it is taken, and so decides the same however many processes
there are; this process works along, so that what it remembers stays warm. The processor time of
children counts as this thread's (`processor_time`).
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import select
import signal
import struct
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any, Generic, NoReturn, TypeVar

from cvxupdate.blas import one_thread
from cvxupdate.errors import CvxupdateError
from cvxupdate.inherited import Inherited
from cvxupdate.parallel import available, processors

Task = TypeVar("Task")
Result = TypeVar("Result")

NUMBER, RECORD = struct.Struct("=i"), struct.Struct("=iqd")  # of a task; and its bytes, its seconds
MANY = 1000  # tasks whose numbers a pipe holds, however small it is
HELD = (signal.SIGINT, signal.SIGTERM)  # until a child is known, and knows that it is one
_OWN = threading.local()  # seconds that children took for this thread
_CHILD: list[int] = []  # the parent, in a child


def processor_time() -> float:
    """Seconds of the processor that this thread used, and children whose results it took."""
    return time.thread_time() + float(getattr(_OWN, "seconds", 0.0))


def may_fork() -> bool:
    """Whether children may be forked here: not from one, nor from the worker of a pool, which has
    its processor; nor from a program with threads of its own, for a child would wait for ever for
    what one of these holds. What draws a line of progress holds nothing that a task asks for."""
    if not sys.platform.startswith("linux") or _CHILD or available() < 2:
        return False
    if multiprocessing.parent_process() is not None:
        return False
    own = threading.current_thread()
    others = [type(t).__module__ for t in threading.enumerate() if t is not own]
    return all(name.partition(".")[0] == "rich" for name in others)


class Ahead(Generic[Task, Result]):
    """``work`` of ``tasks``, taken one after the other; within the block up to ``jobs`` processes
    (None: as many as there are processors) work ahead of that, where there may be any. A task does
    not depend on what another one leaves behind."""

    def __init__(
        self, work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int | None = None
    ) -> None:
        most = min(processors() if jobs is None else jobs, len(tasks))
        self._jobs = most if most > 1 and len(tasks) <= MANY and may_fork() else 1
        self._work, self._tasks, self._taken = work, tasks, 0
        self._team: _Team | None = None
        self._open = ExitStack()

    def __enter__(self) -> Ahead[Task, Result]:
        self._open.enter_context(one_thread())  # the same figures however many processes
        return self

    def __exit__(self, *raised: object) -> None:
        if self._team is not None:
            self._team.end()
        self._open.close()

    def take(self) -> Result:
        """Of the next task; what that raises is raised here.

        Raises
        ------
        CvxupdateError
            Where a process was lost.
        """
        number, self._taken = self._taken, self._taken + 1
        if self._jobs < 2:
            return self._work(self._tasks[number])
        if self._team is None:
            self._team = _Team(self._work, self._tasks)
            self._team.begin(self._jobs - 1)
        found: Result = self._team.outcome(number)
        return found


def every(
    work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int | None = None
) -> list[Result]:
    """``work`` of all ``tasks``, in their order; as `Ahead` has it."""
    with Ahead(work, tasks, jobs) as ahead:
        return [ahead.take() for _ in tasks]


@dataclass(frozen=True)
class _Outcome:
    """What became of a task; ``heard``: the warnings that a child did not show."""

    value: Any = None
    error: Exception | None = None
    heard: tuple[tuple[Any, Any, str, int], ...] = ()


@dataclass(frozen=True)
class _Child:
    """``told``: where it says which task is done; ``results``: where these lie, one after the
    other. A pipe would hold few, and the child would wait until this process looks."""

    pid: int
    told: int
    results: int


class _Team:
    """This process and its children, beside one row of tasks: whoever is free takes the next."""

    def __init__(self, work: Callable[[Any], Any], tasks: Sequence[Any]) -> None:
        self._work, self._tasks = work, tasks
        self._shared = Inherited((work, *tasks))
        self._children: dict[int, _Child] = {}  # by ``told``
        self._read: dict[int, int] = {}  # of its results, bytes
        self._done: dict[int, _Outcome] = {}
        self._spent: dict[int, float] = {}  # s, of what children did
        self._row, write = os.pipe()
        os.write(write, b"".join(NUMBER.pack(k) for k in range(len(tasks))))
        os.close(write)

    def begin(self, children: int) -> None:
        """Fork them."""
        for _ in range(children):
            told, tell = os.pipe()
            results = os.memfd_create("cvxupdate")
            parent, spent = os.getpid(), processor_time()
            held = signal.pthread_sigmask(signal.SIG_BLOCK, HELD)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", DeprecationWarning)  # threads: see `may_fork`
                    pid = os.fork()
                if pid == 0:
                    _CHILD.append(parent)
                    _OWN.seconds = spent - time.thread_time()
                    self._live(tell, results)
                self._children[told] = _Child(pid, told, results)
                self._read[told] = 0
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, held)
            os.close(tell)

    def outcome(self, number: int) -> Any:
        """What became of a task; meanwhile this process does others."""
        while number not in self._done:
            self._hear(wait=False)
            if number in self._done:
                break
            mine = self._next()
            if mine is None:
                self._hear(wait=True)
            else:
                self._done[mine] = self._own(mine)
        found = self._done.pop(number)
        _OWN.seconds = getattr(_OWN, "seconds", 0.0) + self._spent.pop(number, 0.0)
        for warning in found.heard:
            warnings.warn_explicit(*warning)
        if found.error is not None:
            raise found.error
        return found.value

    def end(self) -> None:
        """Nobody waits for what they do any more."""
        for child in list(self._children.values()):
            with suppress(ProcessLookupError):
                os.kill(child.pid, signal.SIGKILL)
            self._leave(child)
        if self._row >= 0:
            os.close(self._row)
            self._row = -1

    def _next(self) -> int | None:
        """The number of a task that nobody has begun."""
        read = os.read(self._row, NUMBER.size)
        return int(NUMBER.unpack(read)[0]) if read else None

    def _own(self, number: int) -> _Outcome:
        """Done here. What ends everything does so at once, whoever's turn it is."""
        try:
            return _Outcome(self._work(self._tasks[number]))
        except CvxupdateError as error:
            return _Outcome(error=error)

    def _hear(self, wait: bool) -> None:
        """Collect what children have done."""
        if wait and not self._children:
            raise _lost("and left a task undone")
        poll = select.poll()
        for told in self._children:
            poll.register(told, select.POLLIN)
        for told, _ in poll.poll(None if wait else 0):
            child = self._children[told]
            record = os.read(told, RECORD.size)
            if not record:
                status = self._leave(child)
                if status:
                    raise _lost(_ended(status))
                continue
            number, size, seconds = RECORD.unpack(record)
            sent = os.pread(child.results, size, self._read[told])
            self._read[told] += size
            self._spent[number] = seconds
            self._done[number] = self._shared.unpacked(sent) if sent else self._own(number)

    def _leave(self, child: _Child) -> int:
        """Wait for its end: no zombie stays. Its status."""
        del self._children[child.told]
        status = 0
        with suppress(ChildProcessError):  # whoever waits for all children had it
            status = os.waitpid(child.pid, 0)[1]
        os.close(child.told)
        os.close(child.results)
        return status

    def _live(self, tell: int, results: int) -> NoReturn:
        """A child, from its first moment to its last: of what it shares with its parent it writes
        nothing but results."""
        status = 1
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to all; the parent ends this
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD)
            gc.freeze()  # pages that nobody writes on are not copied
            while os.getppid() == _CHILD[-1] and (number := self._next()) is not None:
                begin = time.thread_time()
                sent = self._sent(number)
                left = memoryview(sent)
                while left:
                    left = left[os.write(results, left) :]
                os.write(tell, RECORD.pack(number, len(sent), time.thread_time() - begin))
            status = 0
        finally:
            os._exit(status)

    def _sent(self, number: int) -> bytes:
        """A task as it comes back; nothing of what cannot be sent."""
        with warnings.catch_warnings(record=True) as said:
            try:
                value, error = self._work(self._tasks[number]), None
            except Exception as raised:
                value, error = None, raised
                if not isinstance(raised, CvxupdateError):
                    raised.add_note(f"In a process of its own:\n{traceback.format_exc()}")
        heard = tuple((w.message, w.category, w.filename, w.lineno) for w in said)
        try:
            return self._shared.packed(_Outcome(value, error, heard))
        except Exception:
            return b""


def _ended(status: int) -> str:
    if os.WIFSIGNALED(status):
        return f"by signal {os.WTERMSIG(status)}"
    return f"with status {os.waitstatus_to_exitcode(status)}"


def _lost(how: str) -> CvxupdateError:
    return CvxupdateError(
        f"a process that worked along ended {how}: it ran out of memory, or was stopped. Start "
        "again, with one process if memory is short (--jobs 1)."
    )

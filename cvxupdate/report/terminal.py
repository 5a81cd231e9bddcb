"""What a terminal shows on standard error while work goes on: a bar while files are read, a line
for everything else."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress
    from rich.status import Status


class Display:
    """Bar or line, one at a time; nothing is left behind when it is closed."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar: Progress | None = None
        self._line: Status | None = None

    def read(self, what: str, done: int, total: int) -> None:
        """Show a bar: ``done`` of ``total``."""
        if self._bar is None:
            from rich.progress import (
                BarColumn,
                Progress,
                TaskProgressColumn,
                TextColumn,
                TimeRemainingColumn,
            )

            self._stop()
            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                TaskProgressColumn(),
                TimeRemainingColumn(),
            )
            self._bar = Progress(*columns, console=self._console, transient=True)
            self._bar.start()
        task = next((t for t in self._bar.tasks if t.description == what), None)
        place = self._bar.add_task(what, total=total) if task is None else task.id
        for other in self._bar.tasks:
            self._bar.update(other.id, visible=other.id == place)
        self._bar.update(place, completed=done, total=total)

    def say(self, words: str) -> None:
        """Show a line in place of the bar."""
        if self._line is None:
            self._stop()
            self._line = self._console.status(words)
            self._line.start()
        self._line.update(words)

    def close(self) -> None:
        """Take away what is shown."""
        self._stop()

    def _stop(self) -> None:
        if self._bar is not None:
            self._bar.stop()
        if self._line is not None:
            self._line.stop()
        self._bar = self._line = None

"""The [[recordings]] table that `inspect` prints."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cvxupdate.recordings.inspect.result import ChannelView
from cvxupdate.spec.mode_columns import DofColumn, dof_columns

_NOWHERE = ("voltage", "unknown")  # such channels need no place
_UNIT = re.compile(r"\s*[\[(][^\])]*[\])]\s*$")


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def recordings_block(path: Path, kind: str, lines: list[str]) -> str:
    """A [[recordings]] table of ``kind`` with the given further lines."""
    return (
        "\n".join(
            [
                "[[recordings]]",
                f'kind = "{kind}"',
                'use = "fit"',
                f"file = {_quoted(path.name)}",
                *lines,
            ]
        )
        + "\n"
    )


def rate_line(rate: float) -> str:
    """The key ``rate``; a comment alone where the file does not state it (NaN): any number would
    run."""
    return (
        f"rate = {float(f'{rate:.10g}')!r}"
        if np.isfinite(rate)
        else "# rate =              # Hz: the file does not state it; give it"
    )


def channels_line(views: Sequence[ChannelView]) -> str:
    """The line that begins ``channels``; it says where places stand in that are not the file's."""
    return (
        "channels = [   # nodes and directions are guessed where the names do not say them"
        if any(v.quantity not in _NOWHERE and not _named(v) for v in views)
        else "channels = ["
    )


def _named(view: ChannelView) -> tuple[DofColumn, ...]:
    """The place that a channel's name states, as in ``4:-Z [m/s^2]``."""
    named = dof_columns([_UNIT.sub("", view.name)])
    return () if named and named[0].part else named


def channel_row(
    column: int | str, view: ChannelView, node: int | None = None, dof: str = ""
) -> str:
    """A row of ``channels``. Where the file states no place its name may (``4:-Z [m/s^2]``); else
    node 1 and DOF z stand in."""
    key = column if isinstance(column, int) else _quoted(column)
    unit = f", unit = {_quoted(view.unit)}" if view.unit else ""
    sign = ""
    named = _named(view) if node is None else ()
    if named:
        node, dof = named[0].node, named[0].dof
        sign = ", sign = -1" if named[0].sign < 0 else ""
    place = f', node = {node if node is not None else 1}, dof = "{dof or "z"}"{sign}'
    if view.quantity in _NOWHERE:
        place = ""
    return f'  {{ column = {key}, quantity = "{view.quantity}"{place}{unit} }},'

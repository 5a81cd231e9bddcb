"""Channels of recordings: columns that can be read, places that exist, corrections that apply."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.recordings import Recording
from cvxupdate.spec.tables import is_table


@dataclass(frozen=True)
class ChannelColumns:
    """Each column is one channel."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every column that two channels name."""
        for i, recording in enumerate(case.spec.recordings):
            seen: set[object] = set()
            for j, channel in enumerate(recording.channels or ()):
                if (channel.column, channel.index) in seen:
                    yield Complaint(
                        ("recordings", i, "channels", j, "column"),
                        f"column {channel.column} is already used by another channel.",
                        "Give every channel its own column.",
                    )
                seen.add((channel.column, channel.index))


@dataclass(frozen=True)
class ChannelPlaces:
    """A channel sits at a node and an active DOF of the model."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every channel whose place the model does not have."""
        active = case.spec.model.dofs
        for i, recording in enumerate(case.spec.recordings):
            inactive: dict[str, list[int]] = {}
            for j, channel in enumerate(recording.channels or ()):
                at = ("recordings", i, "channels", j)
                free = channel.quantity in ("voltage", "unknown")
                if channel.node is None or channel.dof is None:
                    absent = "node" if channel.node is None else "dof"
                    if not free or (channel.node is None) != (channel.dof is None):
                        yield Complaint(
                            (*at, absent),
                            f"is missing: channel {channel.column} reads {channel.quantity}.",
                            f"Say at which {absent} of the model.",
                        )
                    continue
                if not case.has_node(channel.node) and _of_a_table(recording):
                    name = Path(str(recording.file)).name
                    yield Complaint(
                        ("recordings", i, "file"),
                        f"'{name}' has a column of node {channel.node}, which does not exist.",
                        "Correct the column's name, add the node to the model, or say which node "
                        f"of the model it is: node_map = {{ {channel.node} = … }}.",
                    )
                elif not case.has_node(channel.node):
                    yield Complaint(
                        (*at, "node"),
                        f"channel {channel.column} sits at node {channel.node}, which does "
                        "not exist.",
                        "Correct the number, or add the node to the model.",
                    )
                if channel.dof not in active:
                    inactive.setdefault(channel.dof, []).append(j)
            for dof, which in inactive.items():  # once for all of them: it is one mistake
                columns = [str((recording.channels or ())[j].column) for j in which]
                more = f" (and {len(columns) - 1} more)" if len(columns) > 1 else ""
                yield Complaint(
                    ("recordings", i, "channels", which[0], "dof"),
                    f"channel {columns[0]}{more} reads DOF '{dof}', but the active DOFs are "
                    f"{', '.join(active)}.",
                    f"Correct the dof of the channel{'s' if more else ''}, or add '{dof}' to "
                    "model.dofs.",
                )


def _of_a_table(recording: Recording) -> bool:
    """Whether its channels come from the columns of a table of modes."""
    return recording.kind == "modes" and recording.file is not None and is_table(recording.file)


@dataclass(frozen=True)
class Corrections:
    """A correction says one fault that can be taken out."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Corrections that say nothing or too much, a gain of zero, a channel exchanged with
        itself."""
        for i, recording in enumerate(case.spec.recordings):
            for j, row in enumerate(recording.corrections):
                at = ("recordings", i, "corrections", j)
                said = [
                    key
                    for key in ("gain", "delay", "exchanged_with")
                    if getattr(row, key) is not None
                ]
                if len(said) != 1:
                    yield Complaint(
                        at,
                        f"gives {' and '.join(said) or 'no fault'}.",
                        "Give one of gain, delay and exchanged_with; another row takes another.",
                    )
                elif row.gain == 0.0:
                    yield Complaint(
                        (*at, "gain"),
                        "is 0, which removes the signal.",
                        "Leave the channel out of the recording instead.",
                    )
                elif row.quantity == "force" and (row.gain is None or recording.kind == "modes"):
                    yield Complaint(
                        (*at, "quantity"),
                        "is a force's, of which a gain of FRFs or time histories is taken out.",
                        "Give its gain, or remove the row.",
                    )
                elif row.delay is not None and recording.kind == "modes":
                    yield Complaint(
                        (*at, "delay"), "does not apply to a table of modes.", "Remove it."
                    )
                elif row.exchanged_with is not None and (
                    row.exchanged_with.node,
                    row.exchanged_with.dof,
                ) == (row.node, row.dof):
                    yield Complaint(
                        (*at, "exchanged_with"), "is the channel itself.", "Name the other channel."
                    )

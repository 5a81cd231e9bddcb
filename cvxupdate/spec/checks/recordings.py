"""Recordings: something in them, channels at places that exist, something to fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.recordings import FrfRecording, ModesRecording, TimeRecording


@dataclass(frozen=True)
class EmptyRecordings:
    """A recording holds something; not asked where a faulty row was taken out, for it may have been
    the only one."""

    needs: ClassVar[tuple[str, ...]] = ("recordings",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every table of modes without rows, and every list of channels without channels."""
        for i, recording in enumerate(case.spec.recordings):
            tabular = recording.file is None or recording.file.suffix.lower() == ".csv"
            if isinstance(recording, ModesRecording) and not recording.rows and tabular:
                remedy = "Give rows = [ { frequency = … }, … ] or a file with them."
                yield Complaint(
                    ("recordings", i, "rows"), "the recording is empty: no modes.", remedy
                )
            if recording.channels is not None and not recording.channels:
                yield Complaint(
                    ("recordings", i, "channels"),
                    "the recording is empty: no channels.",
                    "List the channels, or leave `channels` out where the file names them.",
                )
            if (
                isinstance(recording, ModesRecording)
                and recording.frequency_std
                and recording.frequency_std_relative
            ):
                yield Complaint(
                    ("recordings", i, "frequency_std_relative"),
                    "is given together with `frequency_std`.",
                    "Give one of them.",
                )
            if isinstance(recording, ModesRecording) and recording.covariance is not None:
                for key in ("frequency_std", "frequency_std_relative"):
                    if getattr(recording, key) is not None:
                        yield Complaint(
                            ("recordings", i, key),
                            "is given together with `covariance`, which has the deviations.",
                            "Give one of them.",
                        )


@dataclass(frozen=True)
class StateNames:
    """The state that the model describes is written as it is asked for."""

    needs: ClassVar[tuple[str, ...]] = ("recordings",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every state that is "reference" but for capitals or blanks: it would be one more."""
        for i, recording in enumerate(case.spec.recordings):
            state = recording.state
            if state is not None and state != "reference" and state.strip().lower() == "reference":
                yield Complaint(
                    ("recordings", i, "state"),
                    f"is {state!r}, which is not the state that the model describes.",
                    'Write state = "reference".',
                )


@dataclass(frozen=True)
class References:
    """An FRF in columns was excited at places of the model, and its channels name one of them."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every reference whose place the model does not have, and every channel without its
        reference."""
        active = case.spec.model.dofs
        for i, recording in enumerate(case.spec.recordings):
            if not isinstance(recording, FrfRecording) or recording.references is None:
                continue
            for j, reference in enumerate(recording.references):
                at = ("recordings", i, "references", j)
                if not case.has_node(reference.node):
                    problem = f"the excitation sits at node {reference.node}, which does not exist."
                    yield Complaint(
                        (*at, "node"), problem, "Correct the number, or add the node to the model."
                    )
                if reference.dof not in active:
                    problem = (
                        f"the excitation acts along '{reference.dof}', but the active DOFs are "
                        f"{', '.join(active)}."
                    )
                    yield Complaint(
                        (*at, "dof"),
                        problem,
                        f"Add '{reference.dof}' to model.dofs, or correct it.",
                    )
            for j, channel in enumerate(recording.channels or ()):
                if recording.references and channel.reference >= len(recording.references):
                    problem = (
                        f"{channel.reference} of {len(recording.references)} references: there is "
                        "no such one."
                    )
                    yield Complaint(
                        ("recordings", i, "channels", j, "reference"),
                        problem,
                        "The first reference is 0.",
                    )


@dataclass(frozen=True)
class Shapes:
    """A mode shape has an entry for each channel, and its deviations one for each entry."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every shape that does not fit its channels, and modes paired twice with one mode of the
        model."""
        for i, recording in enumerate(case.spec.recordings):
            if not isinstance(recording, ModesRecording):
                continue
            columns = [c.column for c in recording.channels or ()]
            paired = Counter(row.mode for row in recording.rows if row.mode is not None)
            shaped = False
            for j, row in enumerate(recording.rows):
                at = ("recordings", i, "rows", j)
                if row.mode is not None and paired[row.mode] > 1:
                    yield Complaint(
                        (*at, "mode"),
                        f"{paired[row.mode]} measured modes are paired with mode {row.mode} "
                        "of the model.",
                        "Pair each with its own, or leave `mode` out.",
                    )
                    paired[row.mode] = 0
                if row.shape is None:
                    if row.shape_std is not None:
                        yield Complaint(
                            (*at, "shape_std"),
                            "is given without a `shape`.",
                            "Give the shape too, or remove it.",
                        )
                    continue
                shaped = True
                numbers = [c for c in columns if isinstance(c, int)]
                if columns and (
                    len(row.shape) != len(columns) or any(c >= len(row.shape) for c in numbers)
                ):
                    yield Complaint(
                        (*at, "shape"),
                        f"has {len(row.shape)} entries for {len(columns)} channels"
                        + (f" (columns up to {max(numbers)})." if numbers else "."),
                        "Give an entry for each channel; `column` counts from 0.",
                    )
                if isinstance(row.shape_std, tuple) and len(row.shape_std) != len(row.shape):
                    yield Complaint(
                        (*at, "shape_std"),
                        f"has {len(row.shape_std)} entries, the shape {len(row.shape)}.",
                        "Give one number, or one for each entry.",
                    )
                if not any(v if isinstance(v, float | int) else any(v) for v in row.shape):
                    yield Complaint(
                        (*at, "shape"),
                        "is zero everywhere.",
                        "Give the measured shape, or leave it out.",
                    )
            if shaped and recording.channels is None:
                yield Complaint(
                    ("recordings", i, "channels"),
                    "is missing, so it is not known where the shapes were measured.",
                    "List node and dof of each entry of `shape`.",
                )


@dataclass(frozen=True)
class Bands:
    """A band and a slice of samples run upwards."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every band and every slice that is empty."""
        for i, recording in enumerate(case.spec.recordings):
            if recording.band is not None and recording.band[0] >= recording.band[1]:
                yield Complaint(
                    ("recordings", i, "band"),
                    f"{list(recording.band)} is empty.",
                    "Write [lowest, highest] in Hz.",
                )
            if (
                isinstance(recording, TimeRecording)
                and recording.stop is not None
                and recording.stop <= (recording.start or 0)
            ):
                problem = (
                    f"no samples are left: start {recording.start or 0}, stop {recording.stop}."
                )
                yield Complaint(
                    ("recordings", i, "stop"),
                    problem,
                    "`stop` is the sample behind the last one used.",
                )


@dataclass(frozen=True)
class FitRecording:
    """Something may be fitted."""

    needs: ClassVar[tuple[str, ...]] = ("recordings",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """A file of nothing but hold-outs. One without any may be made to plan a measurement."""
        if case.spec.recordings and all(r.use == "hold-out" for r in case.spec.recordings):
            yield Complaint(
                ("recordings",),
                "every recording is a hold-out: there is nothing to fit.",
                'Give at least one recording use = "fit".',
            )


@dataclass(frozen=True)
class MethodRecording:
    """The method finds the kind of recording it works on."""

    needs: ClassVar[tuple[str, ...]] = ("recordings",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """A method without its recording."""
        update = case.spec.update
        kinds = {r.kind for r in case.spec.recordings if r.use == "fit"}
        if update is None or not kinds:
            return
        wanted = {
            "frequencies": {"modes"},
            "minimum-variance": {"modes"},
            "modal-dynamic": {"modes"},
            "rfm": {"frf", "time"},
        }.get(update.method)
        if wanted is not None and not kinds & wanted:
            words = " or ".join(sorted(wanted))
            yield Complaint(
                ("update", "method"),
                f"'{update.method}' needs a recording of kind {words} to fit; there is only "
                f"{', '.join(sorted(kinds))}.",
                f"Add a {words} recording, or choose another method.",
            )

"""The [[recordings]] tables: frf, time and modes, with what a reader may need to be given."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from cvxupdate.keys import Count, DofKind, Id, NonNegative, Part, Positive, Table, Text, one_of

Quantity = Literal[
    "force", "displacement", "velocity", "acceleration", "strain", "voltage", "unknown"
]
Motion = Literal["displacement", "velocity", "acceleration"]
Column = Annotated[
    Annotated[int, Field(ge=0)] | Text,
    one_of("a column number ≥ 0 (the first is 0), or the name of a column"),
]
ShapeEntry = Annotated[float | tuple[float, float], one_of("a number, or [real, imaginary]")]


def _no_bool(value: object) -> object:
    if isinstance(value, bool):
        raise PydanticCustomError("one_of", "{wanted}", {"wanted": "1 or -1"})
    return value


Sign = Annotated[Literal[1, -1], BeforeValidator(_no_bool)]


Square = Annotated[tuple[tuple[float, ...], ...], Field(min_length=1)]
NodeNumber = Annotated[str, Field(pattern=r"^[0-9]{1,9}$")]


class ChannelRow(Part):
    """One measured channel."""

    column: Column = Field(
        description="place in the file or in `shape`: number (first is 0) or name"
    )
    quantity: Quantity = Field(description="what it reads")
    node: Id | None = Field(
        default=None, description="node of the model; needed unless quantity is voltage or unknown"
    )
    dof: DofKind | None = Field(default=None, description="DOF kind; needed with `node`")
    unit: Text | None = Field(
        default=None,
        description="unit in the file, e.g. g, in/s, kip, V; absent: what the file states, else SI",
    )
    sensitivity: (
        Annotated[
            Positive | Text,
            one_of('a number > 0 (file units per SI unit), or text such as "100 mV/g"'),
        ]
        | None
    ) = Field(
        default=None,
        description="transducer output per unit of the quantity: file units per SI unit, or text "
        'such as "100 mV/g"',
    )
    sign: Sign = Field(default=1, description="-1 for a sensor mounted the other way round")
    imposed: bool = Field(
        default=False,
        description="of a time history: this motion is the input (shaking table, earthquake, "
        "driven rig). All nodes that a support holds along this DOF move with it, where it is held "
        "here; else this node alone, or the [[model.bases]] to which it belongs",
    )
    name: Text | None = Field(default=None, description="name for messages and figures")
    index: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        default=(), description="row of an array with more axes: its leading indices"
    )
    form: Literal["complex", "real-imaginary", "magnitude-phase", "db-phase"] = Field(
        default="complex",
        description="FRF in columns: how `column` (and `pair`) write a complex number; "
        "dB = 20 log10 of the unit",
    )
    pair: Column | None = Field(
        default=None,
        description="FRF in columns: column of the imaginary part or phase; needs `form`",
    )
    phase_unit: Literal["deg", "rad"] = Field(default="deg", description="unit of the phase")
    coherence: Column | None = Field(
        default=None, description="FRF in columns: column of the coherence"
    )
    reference: Annotated[int, Field(ge=0)] = Field(
        default=0, description="FRF in columns: place of its reference in `references`"
    )


class ReferenceRow(Part):
    """Where an FRF in columns was excited."""

    node: Id = Field(description="node of the model")
    dof: DofKind = Field(description="DOF kind")
    quantity: Quantity = Field(
        default="force",
        description="what it reads; with acceleration, velocity or displacement the FRFs are "
        "transmissibilities: that motion is imposed, as by a shaking table (see `imposed` of a "
        "channel)",
    )


class ChannelName(Part):
    """A channel by what its label says."""

    node: Id = Field(description="node of the model")
    dof: DofKind = Field(description="DOF kind")


class CorrectionRow(Part):
    """A fault of a channel that is taken out of the recording, e.g. one that `diagnose` found;
    faults are taken out in the order given."""

    node: Id = Field(description="node that the channel is labelled with")
    dof: DofKind = Field(description="DOF kind that it is labelled with")
    quantity: Literal["force"] | None = Field(
        default=None, description="of the force channel there; absent: of the response channel"
    )
    gain: float | None = Field(
        default=None, description="it reads this many times what it should (-1: wrong sign)"
    )
    delay: float | None = Field(default=None, description="it lags by this [s]")
    exchanged_with: ChannelName | None = Field(
        default=None, description="the channel whose cable or place it has, and which has its own"
    )


class ModeRow(Part):
    """One measured mode."""

    frequency: Positive = Field(description="natural frequency [Hz]")
    frequency_std: Positive | None = Field(default=None, description="standard deviation [Hz]")
    damping: NonNegative | None = Field(default=None, description="fraction of critical")
    damping_std: Positive | None = Field(default=None, description="standard deviation")
    shape: tuple[ShapeEntry, ...] | None = Field(
        default=None, description="a number or [re, im] for each channel"
    )
    shape_std: (
        Annotated[
            Positive | tuple[NonNegative, ...],
            one_of("a number > 0, or a list of numbers ≥ 0, one for each entry of the shape"),
        ]
        | None
    ) = Field(
        default=None,
        description="standard deviation of the entries: one number, or a list, in which 0 says "
        "that the entry is fixed by normalisation",
    )
    mode: Count | None = Field(
        default=None,
        description="flexible mode of the initial model that this mode is paired with (1 = lowest)",
    )


class Reading(Part):
    """What every recording may say about itself and its file."""

    use: Literal["fit", "hold-out"] = Field(
        default="fit", description="a hold-out is never fitted, only scored"
    )
    level: NonNegative | None = Field(
        default=None, description="drive level, for one structure at several amplitudes"
    )
    state: Text | None = Field(
        default=None,
        description='state of the structure: "reference" is the one that the model describes '
        "(healthy, as delivered); any other name, or none, the one that is diagnosed; several "
        "names on tables of modes: states that are diagnosed in one fit",
    )
    name: Text | None = Field(default=None, description="name for messages and figures")
    source: Text | None = Field(default=None, description="where it comes from")
    file: Path | None = Field(
        default=None, description="UFF, MAT, HDF5, NPZ, CSV or text, relative to the problem file"
    )
    dataset: Text | None = Field(
        default=None, description="data set under CVXUPDATE_DATA that holds the file"
    )
    response: Motion | None = Field(default=None, description="quantity of the responses")
    channels: Annotated[tuple[ChannelRow, ...], Table()] | None = Field(
        default=None, description="the channels"
    )
    band: tuple[NonNegative, Positive] | None = Field(
        default=None,
        description="[lowest, highest] frequency used [Hz]; of a time history: of its spectra, the "
        "samples stay as they are; of a table: of the modes that are used",
    )
    corrections: tuple[CorrectionRow, ...] = Field(
        default=(), description="faults of channels to be taken out"
    )
    format: Text | None = Field(
        default=None, description="file format, where the file's ending does not say it"
    )
    damaged: Literal["refuse", "leave-out"] = Field(
        default="refuse",
        description="what to do with a file of which part is damaged: refuse it, or leave out what "
        "is damaged (data sets cut short; of FRFs also lines and channels that are not numbers, "
        "and dead channels) and use the rest",
    )
    node_map: dict[NodeNumber, Id] = Field(
        default={},
        description="where a file that labels its channels (UFF, response_node …) numbers nodes "
        "otherwise: its number = the model's, e.g. { 101 = 5, 102 = 9 }",
    )
    variables: dict[str, str] = Field(
        default={},
        description="names of the arrays inside the file, where they differ (FRF: frequency, H, "
        "coherence, variance, response_node …)",
    )
    delimiter: Text | None = Field(
        default=None, description="text files: what separates the columns"
    )
    decimal: Literal[".", ","] | None = Field(
        default=None, description="text files: the decimal mark"
    )
    encoding: Text | None = Field(default=None, description="text files: e.g. latin-1")
    skip_rows: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="text files: lines to leave out on top"
    )
    header_lines: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="text files: lines of header"
    )


class FrfRecording(Reading):
    """Measured frequency response functions."""

    kind: Literal["frf"]
    frequency_column: Column | None = Field(
        default=None, description="column of the frequency [Hz]"
    )
    references: tuple[ReferenceRow, ...] | None = Field(
        default=None,
        description="places of excitation, for FRFs in columns; [] for a spectrum, "
        "where no force was recorded",
    )
    averages: Positive | None = Field(
        default=None,
        description="number of averages, for the variance from coherence; absent: estimated",
    )


class TimeRecording(Reading):
    """Measured time histories."""

    kind: Literal["time"]
    rate: Positive | None = Field(
        default=None, description="sampling rate [Hz]; absent: the file or `time_column` says it"
    )
    begins: Literal["at-rest", "in-motion"] | None = Field(
        default=None,
        description="how the structure moves when the record begins; absent: the record says it. "
        "Of one that begins in motion frequency responses are used, with the initial state as a "
        "further unknown",
    )
    time_column: Column | None = Field(default=None, description="column of the time [s]")
    start: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="first sample used (counted from 0)"
    )
    stop: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="sample behind the last one used"
    )


class ModesRecording(Reading):
    """A table of identified modes."""

    kind: Literal["modes"]
    rows: Annotated[tuple[ModeRow, ...], Table()] = Field(
        default=(), description="the modes; a .csv `file` with these columns is read into them"
    )
    frequency_std: Positive | None = Field(
        default=None, description="for every row without its own [Hz]"
    )
    frequency_std_relative: Positive | None = Field(
        default=None, description="for every row without its own, as a fraction of its frequency"
    )
    covariance: (
        Annotated[Path | Square, one_of("the name of a file, or a list of rows of numbers")] | None
    ) = Field(
        default=None,
        description="the full covariance V_εε of the table (2.106), a file or rows: of the "
        "frequencies [Hz²], or of the frequencies and then every entry of every shape",
    )


Recording = FrfRecording | TimeRecording | ModesRecording

"""The checks of a problem file: one class each, in one list.

A check says which sections must be whole for it to make sense (``needs``); called with a `Case` it
yields a `Complaint` for each fault. To add one: write the class, name it here, add a spoilt file to
``tests/spec/test_spoilt.py``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.checks.channels import ChannelColumns, ChannelPlaces, Corrections
from cvxupdate.spec.checks.constraints import (
    BoundsCrossed,
    ConstraintNames,
    LinearSides,
    OneMass,
    RegulariserKeys,
)
from cvxupdate.spec.checks.dofs import ActiveDofs, Directions, TypeDofs
from cvxupdate.spec.checks.exact import ExactElements
from cvxupdate.spec.checks.files import Datasets, MatrixSources, MissingFiles
from cvxupdate.spec.checks.generic import GenericFamily, Members, MembersMoved
from cvxupdate.spec.checks.geometry import (
    Orientation,
    Outlines,
    PlateShape,
    SpinAxis,
    StiffInShear,
    ZeroLength,
)
from cvxupdate.spec.checks.grouping import ParameterGrouping
from cvxupdate.spec.checks.imposed import BasePlaces, ImposedMotion
from cvxupdate.spec.checks.names import (
    DuplicateIds,
    ElementNodes,
    Labels,
    Materials,
    Sections,
    SectionShapes,
    SupportNodes,
)
from cvxupdate.spec.checks.numbers import Sizes
from cvxupdate.spec.checks.parameters import (
    NamesUnique,
    NominalZero,
    ParameterBounds,
    ParameterElements,
    ParameterSelection,
    SomethingFree,
)
from cvxupdate.spec.checks.recordings import (
    Bands,
    EmptyRecordings,
    FitRecording,
    MethodRecording,
    References,
    Shapes,
    StateNames,
)
from cvxupdate.spec.checks.solution import SolutionApplies
from cvxupdate.spec.checks.structure import LooseNodes, Preloads, Ties, UnheldMasses
from cvxupdate.spec.prepare import Complaint


class Check(Protocol):
    """What a check is."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Sections that must be whole."""

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every fault it finds."""


CHECKS: tuple[Check, ...] = (
    DuplicateIds(),
    ElementNodes(),
    Materials(),
    Sections(),
    SectionShapes(),
    Labels(),
    ActiveDofs(),
    Directions(),
    TypeDofs(),
    Sizes(),
    ZeroLength(),
    Orientation(),
    SpinAxis(),
    PlateShape(),
    Outlines(),
    StiffInShear(),
    LooseNodes(),
    UnheldMasses(),
    ExactElements(),
    Ties(),
    Preloads(),
    SupportNodes(),
    Datasets(),
    MatrixSources(),
    MissingFiles(),
    EmptyRecordings(),
    ChannelColumns(),
    ChannelPlaces(),
    Corrections(),
    References(),
    StateNames(),
    BasePlaces(),
    ImposedMotion(),
    Shapes(),
    Bands(),
    FitRecording(),
    MethodRecording(),
    SomethingFree(),
    SolutionApplies(),
    ParameterSelection(),
    ParameterGrouping(),
    ParameterElements(),
    GenericFamily(),
    Members(),
    MembersMoved(),
    NominalZero(),
    ParameterBounds(),
    NamesUnique(),
    BoundsCrossed(),
    ConstraintNames(),
    LinearSides(),
    OneMass(),
    RegulariserKeys(),
)

"""Rows of [update] parameters with `grouping`, written out as the macro elements that the
recordings choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec, Target, expand_parameters
from cvxupdate.spec.update_parameters import ParameterRow
from cvxupdate.update.context import ModelContext
from cvxupdate.update.grouping.clusters import clusters
from cvxupdate.update.grouping.most_probable import most_probable
from cvxupdate.update.grouping.patches import patches
from cvxupdate.update.grouping.seen import Groups
from cvxupdate.update.grouping.subset import subset
from cvxupdate.update.parts import solver_choice, step_problem
from cvxupdate.update.result import Grouping

RESOLUTION = 0.1
"""Deviation of p at which a group counts as told apart, where the file says nothing: errors that
updating looks for are of that size (8 to 30 % in the thesis's chapter 8)."""
WORDS = {
    "clusters": "by clusters of their sensitivities",
    "subset": "by stable subset selection",
    "total-variation": "by total variation between neighbours",
}


def grouped(
    spec: Spec, model: Model, recordings: Sequence[Recording]
) -> tuple[Spec, Model, tuple[Grouping, ...]]:
    """The problem as it would be with the chosen groups in the file, its model, and what was
    chosen; the problem as it is where no row asks for it.

    Chosen once, on the linear system where the single parameters are most probable.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    table = spec.update
    if table is None or all(row.grouping is None for row in table.parameters):
        return spec, model, ()
    asked = _Asked(spec, model, recordings)
    groups = asked.groups()
    foreseen = dict(zip(groups, asked.known.deviations(groups).tolist(), strict=True))
    rows, found = list[ParameterRow](), list[Grouping]()
    for number, old in enumerate(table.parameters):
        single = asked.row.count(number)
        if not single:
            rows.append(old)
            continue
        own = [g for g in groups if asked.row[g[0]] == number]
        new = [asked.macro(old, g, k + 1) for k, g in enumerate(own)]
        rows += new
        named = expand_parameters(spec.model, new) if new else ()
        found.append(
            _grouping(old, named, [foreseen[g] for g in own], single, single - sum(map(len, own)))
        )
    if not rows:
        raise InputError(
            f"{spec.path}: update.parameters: the recordings ask for no change of any of the "
            f"{len(asked.row)} parameters, so there is no group to update. Leave grouping out."
        )
    table = table.model_copy(update={"parameters": tuple(rows)})
    spec = replace(spec, update=table)
    return spec, build_model(spec), tuple(found)


class _Asked:
    """The single parameters of the rows that have `grouping`: their ``targets`` and ``row``, their
    columns of the first system, and what it says of them."""

    def __init__(self, spec: Spec, model: Model, recordings: Sequence[Recording]) -> None:
        self.spec, self.model, self.recordings = spec, model, recordings
        self.table = spec.update.parameters if spec.update is not None else ()
        plain = [t for t in expand_parameters(spec.model, self.table) if t.family is None]
        self.columns = [k for k, t in enumerate(plain) if self.table[t.row].grouping is not None]
        self.targets = [plain[k] for k in self.columns]
        self.row = [t.row for t in self.targets]
        best = most_probable(spec, model, recordings, self.columns)
        self.system, self.known = best.system, best.known

    def kind(self, column: int) -> str:
        return str(self.table[self.row[column]].grouping)

    def groups(self) -> Groups:
        """Columns of ``known`` in groups."""
        every = range(len(self.columns))
        groups: list[tuple[int, ...]] = [(c,) for c in every if self.kind(c) == "clusters"]
        single = tuple((c,) for c in every if self.kind(c) == "subset")
        if single:
            groups += subset(self.known, single, self.row)
        varied = [c for c in every if self.kind(c) == "total-variation"]
        pairs = self.pairs(varied) if varied else []
        if varied:
            groups += self.patches(varied, pairs)
        touching = {frozenset(q) for q in pairs}

        def may_join(one: tuple[int, ...], other: tuple[int, ...]) -> bool:
            kind = self.kind(one[0])
            return kind == "clusters" or (
                kind == "total-variation"
                and any(frozenset((i, j)) in touching for i in one for j in other)
            )

        finest = [self.table[r].resolution or RESOLUTION for r in self.row]
        return clusters(self.known, tuple(sorted(groups)), self.row, finest, may_join)

    def pairs(self, mine: Sequence[int]) -> list[tuple[int, int]]:
        """Neighbours among them."""
        place = {self.model.parameters[self.columns[c]].name: c for c in mine}
        near = ModelContext(self.spec, self.model, self.recordings).coupled()
        return [
            (place[a], place[b])
            for a, b in near
            if a in place and b in place and self.row[place[a]] == self.row[place[b]]
        ]

    def patches(self, mine: Sequence[int], pairs: Sequence[tuple[int, int]]) -> Groups:
        """Patches of the first step, in columns of ``known``."""
        problem = step_problem(self.spec, self.model, self.recordings)
        at = self.columns
        near = [(at[i], at[j]) for i, j in pairs]
        found = patches(self.system, problem, solver_choice(self.spec), near, [at[c] for c in mine])
        back = {column: c for c, column in enumerate(at)}
        return tuple(tuple(back[column] for column in g) for g in found)

    def macro(self, old: ParameterRow, group: Sequence[int], number: int) -> ParameterRow:
        """The row of one group."""
        return ParameterRow(
            of=old.of,
            elements=tuple(e for c in group for e in self.targets[c].elements),
            name=None if old.name is None else f"{old.name}.{number}",
            lower=old.lower,
            upper=old.upper,
            scale=old.scale,
        )


def _grouping(
    old: ParameterRow,
    named: Sequence[Target],
    foreseen: Sequence[float],
    single: int,
    left: int,
) -> Grouping:
    many, largest = len(named), max(foreseen, default=0.0)
    goal = old.resolution or RESOLUTION
    whole = f"Of {single} parameters '{old.of}', chosen {WORDS[str(old.grouping)]}: "
    told = (
        f"these recordings tell {many} groups apart, the p of each to {largest:.2g} or better"
        if many > 1 and largest <= goal
        else f"{many} groups, of which the least known has a p with a deviation of {largest:.2g}"
        if many > 1
        else f"one group, whose p has a deviation of {largest:.2g}"
        if many
        else "none"
    )
    kept = (
        f". The other {left} keep the value of the file: a change that all of them have in common "
        "trades against other properties unseen, and the recordings ask for none"
    )
    return Grouping(
        old.of,
        str(old.grouping),
        single,
        tuple(t.name for t in named),
        tuple(t.elements for t in named),
        tuple(foreseen),
        f"{whole}{told} (foreseen before the update){kept if left else ''}.",
    )

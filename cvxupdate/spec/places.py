"""Places of a problem file written out: which file, which key, which line of a CSV table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from cvxupdate.errors import Fault
from cvxupdate.keys import Loc
from cvxupdate.spec.mode_columns import column_of
from cvxupdate.spec.prepare import Complaint, Prepared
from cvxupdate.spec.tables import LISTS, Source, TableFile

UNKNOWN = "unknown column"
MOST_ALIKE = 10
"""Faults of one kind in one list that are written out; of the rest only the number is said."""


@dataclass
class Places:
    """Knows where each piece of the prepared data came from."""

    prepared: Prepared
    kept: dict[Loc, list[int]] = field(default_factory=dict)
    """Lists that were pruned: list → original index of each item that is left."""

    def original(self, complaint: Complaint) -> Complaint:
        """The complaint with the indices of the file, where pruning had moved items up."""
        if not self.kept:
            return complaint
        out: Loc = ()
        for step in complaint.loc:
            moved = self.kept.get(out)
            out = (
                *out,
                moved[step]
                if moved is not None and isinstance(step, int) and step < len(moved)
                else step,
            )
        return replace(complaint, loc=out)

    def sought(self, found: Iterable[Complaint]) -> list[Complaint]:
        """What a check found, with the indices of the file: what rows have from their block once,
        at the block; nothing of shapes whose channels were pruned, for they are counted."""
        out: dict[tuple[Loc, str] | int, Complaint] = {}
        for complaint in map(self.original, found):
            block, key = complaint.loc[:3], str(complaint.loc[-1])
            if complaint.loc[2:3] == ("rows",) and (*complaint.loc[:2], "channels") in self.kept:
                continue
            rows = self.prepared.inherited.get(block, {}).get(key, frozenset())
            if complaint.loc[3:4] == ("rows",) and complaint.loc[4] in rows:
                said = replace(complaint, loc=(*block, key))
                out.setdefault((said.loc, said.remedy), said)
            else:
                out[len(out)] = complaint
        return list(out.values())

    def fault(self, complaint: Complaint) -> Fault:
        """File and key in words."""
        source, loc = self._origin(complaint)
        for length in range(len(loc), 1, -1):
            table = source.tables.get(loc[:length])
            if table is None:
                continue
            rest = loc[length:]
            if not rest or not isinstance(rest[0], int):
                continue
            found = _of_header(table, rest[1:], complaint)
            if found is not None:
                return found
            key = f"line {table.lines[rest[0]]}" + (
                f", column {column_of(table.columns, rest[1:]) or _key(rest[1:])}"
                if rest[1:]
                else ""
            )
            return Fault(str(table.path), key, complaint.problem, complaint.remedy)
        if self.prepared.wrapped and loc[:2] == ("regularisation", 0):
            loc = ("regularisation", *loc[2:])
        return Fault(str(source.path), _key(loc), complaint.problem, complaint.remedy)

    def _origin(self, complaint: Complaint) -> tuple[Source, Loc]:
        if complaint.source is not None:
            return complaint.source, complaint.loc
        return self.prepared.origin(complaint.loc)


def _of_header(table: TableFile, rest: Loc, complaint: Complaint) -> Fault | None:
    """A column that has no business in a table, or is not in it, told of its header and so once for
    all rows; None where the fault is that of a row."""
    if len(rest) != 1:
        return None
    name, key = str(rest[0]), f"line {table.header}, column {_key(rest)}"
    if complaint.problem.startswith("unknown key") and name in table.columns:
        remedy = complaint.remedy
        if "damping" in remedy:
            remedy += " Damping in per cent is `damping [%]`."
        return Fault(str(table.path), key, f"{UNKNOWN} '{name}'.", remedy)
    if complaint.problem == "is missing." and name not in table.columns:
        remedy = complaint.remedy.replace(f"Add `{name} = …`", f"Add a column `{name}`")
        if name in LISTS:
            remedy += " One cell holds them all, separated by blanks, as in `1 2`."
        return Fault(str(table.path), key, complaint.problem, remedy)
    return None


def gather(complaints: Sequence[Complaint], places: Places) -> tuple[Fault, ...]:
    """All faults, without repetitions; many alike in one list are cut to the first ones and a
    count."""
    order = {name: i for i, name in enumerate(places.prepared.data)}
    complaints = sorted(
        complaints, key=lambda c: order.get(str(c.loc[0]) if c.loc else "", len(order))
    )
    alike: dict[tuple[object, ...], int] = {}
    faults: dict[tuple[str, str, str], Fault] = {}
    for complaint in complaints:
        fault = places.fault(complaint)
        at = (fault.file, fault.key, fault.problem)
        if at in faults:
            continue
        kind: tuple[object, ...] = (
            *("#" if isinstance(s, int) else s for s in complaint.loc),
            complaint.remedy,
        )
        alike[kind] = alike.get(kind, 0) + 1
        if alike[kind] <= MOST_ALIKE:
            faults[at] = fault
    for group, count in alike.items():
        if count > MOST_ALIKE:
            key = _key(tuple(str(s) for s in group[:-1])).replace(".#", "[…]")
            text = f"{count - MOST_ALIKE} more faults of the same kind."
            faults[("", key, text + str(group))] = Fault(
                str(places.prepared.source.path), key, text, str(group[-1])
            )
    return _headers_at_once(list(faults.values()))


def _headers_at_once(faults: list[Fault]) -> tuple[Fault, ...]:
    """Unknown and missing columns of one header are one mistake: its author has other names."""
    groups: dict[tuple[str, str], list[Fault]] = {}
    for fault in faults:
        line, _, name = fault.key.partition(", column ")
        if name and (fault.problem.startswith(UNKNOWN) or fault.problem == "is missing."):
            groups.setdefault((fault.file, line), []).append(fault)
    out = list(faults)
    for (file, line), some in groups.items():
        wrong = [_name(f) for f in some if f.problem.startswith(UNKNOWN)]
        missing = [_name(f) for f in some if not f.problem.startswith(UNKNOWN)]
        if not (wrong and missing):
            continue
        meant = {w: w.lower() for w in wrong if w.lower() != w and w.lower().isidentifier()}
        rest = [w for w in wrong if w not in meant], [m for m in missing if m not in meant.values()]
        if [len(r) for r in rest] == [1, 1]:
            meant[rest[0][0]] = rest[1][0]
        asks = ", ".join(f"'{meant[w]}' for '{w}'" for w in wrong if w in meant)
        absent, found = (", ".join(f"'{x}'" for x in names) for names in (missing, wrong))
        says = f"lacks {absent} and has columns that are unknown: {found}."
        if not asks:
            continue
        at, remedy = out.index(some[0]), f"Did you mean {asks}?"
        out = [f for f in out if f not in some]
        out.insert(at, Fault(file, line, says, remedy))
    return tuple(out)


def _name(fault: Fault) -> str:
    return fault.key.partition(", column ")[2]


def _key(loc: Loc) -> str:
    """``model.elements[0].rows[3].nodes``."""
    out = ""
    for step in loc:
        out += f"[{step}]" if isinstance(step, int) else f".{step}" if out else step
    return out

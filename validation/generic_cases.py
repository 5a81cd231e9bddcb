"""The case studies of 7.7 in one table, as table 7.1 has them, with p-values beside each, and what
clauses, a reduced family and the count of the beam's parameters do to them.
``python -m validation.generic_cases`` prints the tables of docs/generic-elements.md (three minutes
of the processor)."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.spec import read_text
from cvxupdate.study import run

PROBLEMS = Path(__file__).resolve().parents[1] / "problems" / "generic"
FAMILY = 'parameters = [ { elements = "all", of = "generic" } ]'
DIAGONAL = FAMILY.replace('"generic"', '"generic", family = { classes = "diagonal" }')


@dataclass(frozen=True)
class Case:
    """A problem file, that of its p-values, and the iterations of table 7.1 (generic, p)."""

    name: str
    problem: str
    p_values: str
    source: tuple[str, str]


@dataclass(frozen=True)
class Variant:
    """A problem file with ``old`` replaced by ``new``."""

    name: str
    problem: str
    old: str = ""
    new: str = ""


CASES = (
    Case("7.7.1 rod", "rod/problem", "rod/p_values", ("–", "–")),
    Case("the same, driven at the free end", "rod/free_end", "rod/p_values_free_end", ("–", "–")),
    Case("7.7.2A beam", "beam_a/problem", "beam_a/p_values", ("4", "3")),
    Case("7.7.2B beam, mesh", "beam_b/problem", "beam_b/p_values", ("5", "none")),
    Case("the same, all lines", "beam_b/all_lines", "beam_b/p_values_all_lines", ("5", "none")),
    Case("7.7.3A plate", "plate_a/problem", "plate_a/p_values", ("3", "2")),
    Case("7.7.3B plate, mesh", "plate_b/problem", "plate_b/p_values", ("5", "none")),
    Case("7.7.3C plate, 1 % noise", "plate_c/problem", "plate_c/p_values", ("7", "–")),
)


def reduced(row: str, stiffness: int, mass: int) -> str:
    """``row`` with the lowest modes of K and the highest of M free alone (Ross)."""
    kept = f"lowest_stiffness = {stiffness}, highest_mass = {mass}"
    if "family" in row:
        return row.replace('classes = "diagonal"', f'classes = "diagonal", {kept}')
    return row.replace('of = "generic"', f'of = "generic", family = {{ {kept} }}')


NINE = (
    'parameters = [ { elements = "all", of = "generic", name = "k", '
    'family = { matrices = ["K"], classes = "none" } }, '
    '{ elements = "all", of = "generic", name = "m", family = { matrices = ["M"] } } ]'
)
CLAUSES = "generic = { mass = true, floor = 0.05, ceiling = 20.0 }"
PLAIN = "generic = { mass = true }"
UNKEPT = "generic = { floor = 0.05, ceiling = 20.0 }"
END = "max_iterations = 40\n"


def plates(name: str, problem: str) -> tuple[Variant, ...]:
    """Those of 7.7.3B and C."""
    return (
        Variant(f"{name}, as it is", problem),
        Variant(f"{name}, mass not kept", problem, CLAUSES, UNKEPT),
        Variant(f"{name}, inertia kept too", problem, "mass = true", "inertia = true"),
        Variant(f"{name}, floor of 0.001, no ceiling", problem, CLAUSES, PLAIN),
        Variant(f"{name}, Ross 6 + 9", problem, DIAGONAL, reduced(DIAGONAL, 6, 9)),
        Variant(f"{name}, Ross 6 + 6", problem, DIAGONAL, reduced(DIAGONAL, 6, 6)),
    )


VARIANTS = (
    *plates("7.7.3B", "plate_b/problem"),
    *plates("7.7.3C", "plate_c/problem"),
    Variant("7.7.2B, as it is", "beam_b/problem"),
    Variant("7.7.2B, mass kept", "beam_b/problem", END, f"{END}\n[constraints]\n{PLAIN}\n"),
    Variant("7.7.2B, Ross 1 + 4", "beam_b/problem", FAMILY, reduced(FAMILY, 1, 4)),
    Variant("7.7.2B, nine parameters", "beam_b/problem", FAMILY, NINE),
    Variant("7.7.2B, all lines, nine", "beam_b/all_lines", FAMILY, NINE),
    Variant("7.7.2B, all lines, Ross 1 + 4", "beam_b/all_lines", FAMILY, reduced(FAMILY, 1, 4)),
    Variant("7.7.2A, nine parameters", "beam_a/problem", FAMILY, NINE),
)


@dataclass(frozen=True)
class Outcome:
    """An update, and seconds of the processor for each of its iterations."""

    updated: Any
    seconds: float

    def error(self, use: str, when: str) -> float:
        """Of the responses."""
        return float(self.updated.fit[use]["frf_error"][when])

    def both(self, use: str) -> str:
        """Before → after."""
        return f"{self.error(use, 'before'):.3g} → {self.error(use, 'after'):.2g}"

    @property
    def iterations(self) -> str:
        """With the seconds of one; a last one that was not kept, or no convergence, is said."""
        u = self.updated
        last = ", last not kept" if u.history and not u.history[-1]["accepted"] else ""
        end = "" if u.status == "converged" else f", {u.status}"
        return f"{u.iterations} ({self.seconds:.2f} s){last}{end}"

    @property
    def mass(self) -> str:
        """[kg]"""
        return f"{self.updated.model['mass_before']:.4g} → {self.updated.model['mass_after']:.4g}"


def changed(variant: Variant) -> str:
    """The text of a variant.

    Raises
    ------
    ValueError
        Where what is to be replaced is not there.
    """
    text = (PROBLEMS / f"{variant.problem}.toml").read_text(encoding="utf-8")
    if variant.old not in text:
        raise ValueError(f"{variant.name}: {variant.old!r} is not in {variant.problem}.toml")
    return text.replace(variant.old, variant.new) if variant.old else text


def outcome(problem: str, text: str | None = None) -> Outcome:
    """One update."""
    path = PROBLEMS / f"{problem}.toml"
    begin = time.process_time()
    updated = run(path if text is None else read_text(text, path))
    return Outcome(updated, (time.process_time() - begin) / max(1, updated.iterations))


def main(which: tuple[str, ...]) -> None:
    """Print both tables, or the one that is named (cases, variants)."""
    if not which or "cases" in which:
        print(
            "| case | unknowns | fitted | held out | p-values: fitted, held out | mass [kg] | "
            "iterations (s each) | source | p-values' iterations | source |"
        )
        print("| iterations (s each) | source | p-values' iterations | source |")
        print("|---" * 10 + "|")
        for case in CASES:
            g, p = outcome(case.problem), outcome(case.p_values)
            beside = f"{p.error('fit', 'after'):.2g}, {p.error('hold_out', 'after'):.2g}"
            cells = (case.name, str(len(g.updated.parameters)), g.both("fit"), g.both("hold_out"))
            cells += (beside, g.mass, g.iterations, case.source[0], p.iterations, case.source[1])
            print(f"| {' | '.join(cells)} |", flush=True)
    if not which or "variants" in which:
        print("\n| variant | unknowns | fitted | held out | mass [kg] | iterations |")
        print("|---" * 6 + "|")
        for v in VARIANTS:
            g = outcome(v.problem, changed(v))
            cells = (v.name, str(len(g.updated.parameters)), g.both("fit"), g.both("hold_out"))
            print(f"| {' | '.join((*cells, g.mass, g.iterations))} |", flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]))

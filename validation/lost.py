"""Where a diagnosis loses a known truth: ``python -m validation.lost [--plates|--rigs] SEED …``.

Seeds are those of `make calibrate` and `python -m validation.pairs`, of `make plates` or (two
states) of `make rigs`; or name folders with ``problem.toml`` and ``truth.toml``. Each case is
diagnosed, and its truth is fitted by hand beside it: placed by its words and places, at the best
sizes, from each order of its effects. What is said then is the first of these that holds:

model      the truth itself leaves more than a sound model may: theory, mesh, nuisance parameters
proposal   the true set was never begun
race       it was begun, and not carried to the sharp recordings
minimum    it was, and the fit by hand leaves less
judgement  it was fitted as well as by hand, and something else is claimed, or nothing

"(time)" behind it: the budget ended the search. Development seeds only: it looks at a case.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, seeds_from
from cvxupdate.diagnose.judge import judge as judging
from cvxupdate.diagnose.judge.acceptance import better, credible, explained, needs_several, refuted
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.judge.soundness import sound
from cvxupdate.diagnose.screen.shortlist import best_of
from cvxupdate.diagnose.search.several import at_level
from cvxupdate.diagnose.settings import SEVERAL_LEVEL
from cvxupdate.diagnose.types import Evidence, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.physics.effect import Effect
from validation import calibrate, generate
from validation.pairs import NEW
from validation.plates.cases import EVALUATION
from validation.plates.files import make as make_plate
from validation.rigs.cases import secret
from validation.rigs.generate import make as make_rig
from validation.rigs.judge import judged as on_a_rig
from validation.watched import Watched, watched

STARTS = 3  # sizes, or tunings, from which each effect of the truth is begun by hand
WORSE = 1.1  # times what the fit by hand leaves: the search ended in another minimum
Truth = Sequence[Mapping[str, Any]]


def says(effect: Effect, true: Mapping[str, Any]) -> bool:
    """Whether an effect is a true one, or what counts as that."""
    named = {"physics": effect.physics, "location": effect.place.to_json()}
    return calibrate.names(named, true)


def has(effects: Sequence[Effect], truth: Truth) -> bool:
    """Whether each true effect is there."""
    return all(any(says(e, true) for e in effects) for true in truth)


def by_hand(evidence: Evidence, truth: Truth) -> Hypothesis | None:
    """The truth placed at its best sizes, from each order of its effects, and fitted to the end."""
    level = min(SEVERAL_LEVEL, evidence.levels - 1)
    base = evidence.bases[min(level, len(evidence.bases) - 1)]
    best: Hypothesis | None = None
    for order in itertools.permutations(truth):
        sets = [Hypothesis((), base)]
        for true in order:
            placed = [s for h in sets for s in _placed(evidence, h, true, level)]
            sets = sorted(_fitted(evidence, placed, "coarse"), key=lambda h: h.fit.misfit)[:STARTS]
        for further in range(level + 1, evidence.levels):
            effort = "sharp" if further == evidence.levels - 1 else "coarse"
            onward = [at_level(evidence, h, further).onward for h in sets]
            sets = _fitted(evidence, onward, effort)
        best = min([*sets, *([] if best is None else [best])], key=lambda h: h.fit.misfit)
    return best


def _placed(
    evidence: Evidence, parent: Hypothesis, true: Mapping[str, Any], level: int
) -> list[Seed]:
    """A true effect beside a parent: at the very place of its own word where it can stand there."""
    known = evidence.candidates(parent.fit.setting.model)
    named = [c for c in known if c.key not in parent.keys and says(c, true)]
    place = {k: v for k, v in true["location"].items() if v}

    def exactly(c: Effect) -> bool:
        here = {k: v for k, v in c.place.to_json().items() if v and k in place}
        return c.physics == true["physics"] and here == place

    wanted = [c for c in named if exactly(c)] or named
    nominal = at_nominal(evidence, parent, level)
    sized = evidence.finite_size(nominal.fit, parent.fit, parent.effects, wanted)
    exact = best_of(sized.scores)[:STARTS]
    first = best_of(evidence.first_order(parent.fit, wanted))[:STARTS]
    return [
        *seeds_from(evidence, nominal, exact, level, nominal=True),
        *seeds_from(evidence, parent, [s for s in first if s.fraction > 0.0], level),
        *sized.seeds,
    ]


def _fitted(evidence: Evidence, seeds: Sequence[Seed], effort: str) -> list[Hypothesis]:
    out = []
    for seed in seeds:
        try:
            out.append(Hypothesis(seed.effects, evidence.fitted(seed, effort)))
        except CvxupdateError:
            continue
    return out


def told(h: Hypothesis, case: judging.Case, single: judging.Weighed | None) -> str:
    """A hypothesis and how it stands, on one line."""
    w = case.weighed(h)
    marks = {
        "sound": sound(h, case.evidence),
        "explained": explained(w, case),
        "credible": credible(w, case),
    }
    marks |= {"better": better(w, case.base, case), "refuted": refuted(w, case)}
    marks |= {"needed": needs_several(w, single, case)} if len(h.effects) > 1 else {}
    sizes = "; ".join(
        f"{e.name} " + ", ".join(f"{k} {x:.4g}" for k, x in v.items())
        for e, v in zip(h.effects, h.values, strict=True)
    )
    stands = ", ".join(k if v else f"not {k}" for k, v in marks.items())
    return (
        f"misfit {h.fit.misfit:.4g}, left {w.errors.fit:.3g} / {w.errors.hold_out:.3g}, "
        f"log odds {log_odds(w, case):.1f}, {stands}: {sizes}"
    )


def verdict(own: Watched, hand: Hypothesis | None, truth: Truth) -> tuple[str, list[str]]:
    """Where it was lost, and what that rests on."""
    assert own.evidence is not None and own.judgement is not None
    evidence, judgement = own.evidence, own.judgement
    case = judgement.case
    mine = [b for b in own.fits if has(b.effects, truth)]
    exact = [b for b in mine if len(b.effects) == len(truth)]
    last = [b for b in mine if b.level == evidence.levels - 1]
    lines = [
        f"  base: misfit {case.base.fit.misfit:.4g}, left {case.base.errors.fit:.3g}, noise "
        f"{evidence.noise.fit:.3g}, allowance {evidence.allowance(evidence.model):.3g}"
    ]
    if hand is not None:
        lines.append(f"  by hand: {told(hand, case, judgement.single)}")
    lines.append(
        f"  fits: {len(own.fits)}, with the truth {len(mine)} ({len(exact)} of it alone), on the "
        f"sharp recordings {len(last)}"
    )
    for b in (*exact[:1], *mine[-1:]):
        best = min(x.misfit for x in own.fits if x.level == b.level and x.at <= b.at)
        lines.append(
            f"  at {b.at:.1f} s, level {b.level}, {b.effort}: misfit {b.misfit:.4g}; best of that "
            f"level so far {best:.4g}"
        )
    known = [h for h in (*own.found.several, *own.found.singles) if has(h.effects, truth)]
    lines += [f"  found: {told(h, case, judgement.single)}" for h in known[:1]]
    for name, w in (("final", judgement.final), ("nearest", judgement.nearest)):
        lines += [] if w is None else [f"  {name}: {told(w.hypothesis, case, judgement.single)}"]
    lines += [f"  {s.to_json()}" for s in judgement.standings]
    w = None if hand is None else case.weighed(hand)
    best = min((h.fit.misfit for h in known), default=float("inf"))
    if w is None or not (credible(w, case) and better(w, case.base, case)):
        where = "model"
    elif not mine:
        where = "proposal"
    elif not last or not known:
        where = "race"
    elif hand is not None and best > WORSE * hand.fit.misfit:
        where = "minimum"
    else:
        where = "judgement"
    return where + (" (time)" if evidence.unfinished else ""), lines


def judged(said: Mapping[str, Any], truth: Mapping[str, Any]) -> tuple[str, str]:
    """The outcome, and what is true in words; of structures on rigs by their own judge."""
    if not isinstance(truth["laboratory"], str):
        row = calibrate.judged(said, truth)
        return row["outcome"], f"{row['truth']}  left {row['left']}"
    row = on_a_rig(said, truth)
    named = all(e["named"] == "right" for e in row["effects"])
    outcome = "wrong" if row["wrong"] else "right" if named else "missed"
    return outcome, f"{row['truth']}; rig: {row['rig']}"


def looked_at(folder: Path, log: bool, problem: str = "problem.toml") -> list[str]:
    """A case diagnosed, and where its truth was lost."""
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    begin = time.process_time()
    with watched() as searches:
        said = calibrate.diagnose(folder / problem)
        seconds = time.process_time() - begin
        outcome, known = judged(said, truth)
        out = [
            f"{folder.name} {outcome} {seconds:.1f} s  {known}",
            f"  said: {said['verdict']}: {json.dumps(said['says'], ensure_ascii=False)}",
        ]
        for own in searches[: None if truth.get("findings") else 0]:
            if own.judgement is None or own.evidence is None:
                continue
            fits = len(own.fits)
            hand = by_hand(own.evidence, truth["findings"])
            del own.fits[fits:]
            where, lines = verdict(own, hand, truth["findings"])
            out += [*lines, *([] if outcome == "right" else [f"  LOST AT: {where}"])]
        if log:
            out += [f"    {at:7.1f} {text}" for own in searches for at, text in own.progress]
    return out


def main(arguments: Sequence[str] | None = None) -> int:
    """Look at cases."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("cases", nargs="+", help="seeds or folders")
    parser.add_argument("--plates", action="store_true", help="seeds of make plates")
    parser.add_argument("--rigs", action="store_true", help="seeds of make rigs, two states")
    parser.add_argument("--log", action="store_true", help="the search step by step")
    o = parser.parse_args(arguments)
    for name in o.cases:
        with tempfile.TemporaryDirectory() as place:
            folder, problem = Path(name), "problem.toml"
            if name.isdigit() and o.rigs:
                if secret(int(name)):
                    parser.error(f"{name} is an evaluation's: only totals are looked at")
                folder, problem = Path(place) / f"g{name}", "reference.toml"
                make_rig(int(name), folder)
            elif name.isdigit():
                if int(name) >= (EVALUATION if o.plates else NEW) or 1000 <= int(name) < 1200:
                    parser.error(f"{name} is an evaluation's: only totals are looked at")
                folder = Path(place) / f"g{name}"
                (make_plate if o.plates else generate.make)(int(name), folder)
            print("\n".join(looked_at(folder, o.log, problem)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

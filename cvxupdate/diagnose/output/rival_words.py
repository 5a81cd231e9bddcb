"""What shares its probability with a finding, in words."""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.groups import group_findings
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.judge.posterior import rivals
from cvxupdate.physics.place import listed

NAMED = 3  # effects of a set that a sentence names, at most
TOGETHER = "wrong numbers of whole groups"
"""What nuisance parameters far beyond their scatter are."""
SINGLE = "this alone, all else within its usual scatter"


def shortly(h: Hypothesis) -> str:
    """A hypothesis in words, of many effects the first alone."""
    many = len(h.effects)
    return h.title if many <= NAMED else f"{many} effects together, {h.effects[0].title} first"


def verbs(h: Hypothesis) -> tuple[str, str]:
    """What one thing does, or several do, beside all else that was tried: "comes nearest",
    "leaves"."""
    return ("come nearest", "leave") if len(h.effects) > 1 else ("comes nearest", "leaves")


def named(h: Hypothesis) -> str:
    """A hypothesis in words; of nuisance parameters also which groups moved."""
    moved = () if h.effects else group_findings(h, 1.0)
    return f"{h.title} ({listed([f.title for f in moved])})" if moved else h.title


def rival_titles(judgement: Judgement) -> list[str]:
    """Whom the recordings are no strong evidence against, likeliest first, as far as no finding
    lists it among what it cannot be told from."""
    final, findings = judgement.final, judgement.findings
    if final is None:
        return []
    known = {e.key for f in findings for e in f.equivalent}
    claimed = {f.title for f in findings}
    out: dict[str, None] = {}
    for w in rivals(final, judgement.field, judgement.case):
        h = w.hypothesis
        if known & h.keys or (h.effects and h.title == final.hypothesis.title):
            continue  # listed already, or another form of one law
        if final.hypothesis.effects and final.hypothesis.keys < h.keys:
            continue  # the same, and something beside that does little
        if h.effects:
            same = {e.title for e in h.effects} == claimed
            out[f"{h.title}: {SINGLE}" if same else h.title] = None
        else:
            moved = [f.title for f in group_findings(h, 1.0)]
            same = set(moved) == claimed
            says = "which finds the same" if same else f"which finds {listed(moved)}"
            out[f"{TOGETHER}, {says}"] = None
    return list(out)

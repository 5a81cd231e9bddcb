"""The diagnosis of a part on a test rig: which law its force follows, in the contract's form."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.motion.component import Law, Rig, of_levels
from cvxupdate.diagnose.motion.loops import travels
from cvxupdate.diagnose.output.diagnosis import Diagnosis, finite
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import FEWEST_REVERSALS, HALVED, LOWER, PLAY_GAIN, RIG_SURE
from cvxupdate.physics import told
from cvxupdate.physics.place import Place, channel_place
from cvxupdate.physics.units import quantity
from cvxupdate.spec import Spec

WORDS = {
    "cubic": "a cubic spring",
    "quadratic": "damping with the square of the velocity",
    "friction": "friction without elasticity",
    "clearance": "a gap",
    "jenkins": "friction that sticks and slips",
    "jenkins with play": "friction with free play",
}


def component_diagnosis(spec: Spec, rigs: Sequence[Rig], begin: float) -> Diagnosis:
    """What the force of a part on a rig follows; ``begin``: when it began (`perf_counter`)."""
    (linear, *laws), own = of_levels(rigs)
    best = min(laws, key=lambda law: law.errors[0])
    plain = next(law for law in laws if law.name == "jenkins")
    if best.name == "jenkins with play" and best.errors[0] > PLAY_GAIN * plain.errors[0]:
        best = plain
    good = _better(best, linear) and best.name in ("jenkins", "jenkins with play", "friction")
    place = channel_place(rigs[0].label)
    findings = _findings(best, linear, place, rigs) if good else ()
    says = " ".join(f.says for f in findings)
    enough = _enough(linear)
    if not findings:
        says = (
            "Spring and dashpot explain the force of this part."
            if enough
            else "No law that is known explains the force of this part."
        )
    verdict = "missing_physics" if findings else "consistent" if enough else "undetermined"
    lines = [
        "Imposed motion and measured force: the best spring and dashpot "
        f"(k {quantity(linear.k, 'N/m')}, c {quantity(linear.c, 'N·s/m')}) leave {_left(linear)}.",
        *(f"With {WORDS[law.name]}: {_left(law)}." for law in laws),
    ]
    if own:
        lines.append(
            "The force depends on the level: each has coefficients of its own; the law's shape is "
            "that of all, and what was held out at a level between is interpolated."
        )
    return Diagnosis(
        problem=spec.name,
        title=spec.title,
        path=spec.shown,
        verdict=verdict,
        says=says,
        findings=findings,
        candidates=tuple(_candidate(law, place) for law in laws),
        fit={
            key: {
                "before": finite(linear.errors[k]),
                "after": finite((best if findings else linear).errors[k]),
            }
            for k, key in enumerate(("fit", "hold_out"))
        },
        metrics={},
        evidence=tuple(lines),
        time=time.perf_counter() - begin,
        details={"method": "regression of the force on columns along the imposed motion"},
    )


def _better(best: Law, linear: Law) -> bool:
    """Whether a law halves what spring and dashpot leave, and shows on what was held out."""
    held = best.errors[1]
    return bool(
        best.errors[0] <= HALVED * linear.errors[0]
        and (not np.isfinite(held) or held <= LOWER * linear.errors[1])
    )


def _enough(linear: Law) -> bool:
    return bool(np.nanmax(linear.errors) <= RIG_SURE)


def _left(law: Law) -> str:
    fit, held = law.errors
    return f"{fit:.3g} of the force (fitted)" + (
        f" and {held:.3g} (held out)" if np.isfinite(held) else ""
    )


def _findings(law: Law, linear: Law, place: Place, rigs: Sequence[Rig]) -> tuple[Finding, ...]:
    worst = float(np.nanmax(law.errors))
    sure = float(np.clip(1.0 - (worst / float(np.nanmax(linear.errors))) ** 2, 0.0, 0.99))
    part = 1.0 - (law.errors[0] / linear.errors[0]) ** 2
    forces = {"force": law.size, **_of_each_level(law)}
    spread = {name: worst * law.size for name in forces}
    out = [
        Finding(
            "dry_friction",
            place,
            told("dry_friction", place).title,
            forces,
            spread,
            spread,
            sure,
            part,
            (),
            f"The part rubs: {_friction(law)}, however slow it is.",
        )
    ]
    if law.name == "jenkins with play":
        per_level = " at the highest level" if len(law.own) > 1 else ""
        k = float(law.size / law.shape[0])
        gap, scatter, reversals = _travel(law, worst, rigs)
        out.append(
            Finding(
                "clearance",
                place,
                told("clearance", place).title,
                {"gap": gap, "k": k},
                {"gap": scatter, "k": worst * k},
                {"gap": scatter / np.sqrt(reversals), "k": worst * k},
                sure,
                part,
                (),
                f"After every reversal it moves {quantity(gap, 'm')} until half of the friction "
                f"acts the other way (as {reversals} reversals show it); the law that fits best "
                f"has {quantity(law.shape[1], 'm')} of free play, and a spring of "
                f"{quantity(k, 'N/m')} in series{per_level}.",
            )
        )
    return tuple(out)


def _travel(law: Law, worst: float, rigs: Sequence[Rig]) -> tuple[float, float, int]:
    """How far the part moves after a reversal until half of the friction acts the other way, its
    scatter, and how many reversals say so: median of the loops that were fitted, or what the law
    has where these say nothing. A law of springs and sliders has corners that a part has not, so
    its own travel is somewhat off."""
    found = np.concatenate([travels(r, law) for r in rigs if r.use == "fit"])
    if len(found) < FEWEST_REVERSALS:
        return law.travel, worst * law.travel, max(1, len(found))
    return float(np.median(found)), float(np.std(found, ddof=1)), len(found)


def _of_each_level(law: Law) -> dict[str, float]:
    """The friction of each level that has its own, N."""
    return (
        {f"force at level {level:g}": size for level, _, _, size in law.own}
        if len(law.own) > 1
        else {}
    )


def _friction(law: Law) -> str:
    if len(law.own) == 1:
        return f"a friction of {quantity(law.size, 'N')} opposes its motion"
    each = ", ".join(f"{quantity(size, 'N')} at level {level:g}" for level, _, _, size in law.own)
    return f"a friction that depends on the level ({each}) opposes its motion"


def _candidate(law: Law, place: Place) -> dict[str, object]:
    return {
        "physics": law.name,
        "title": WORDS[law.name],
        "location": place.to_json(),
        "score": finite(law.errors[0]),
        "hold_out_score": finite(law.errors[1]),
    }

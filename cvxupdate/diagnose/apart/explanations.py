"""The explanations of a `diagnosis.json`, put on the model again and fitted to the recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, seeds_from
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.settings import COARSE, FINE
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.physics import effect_types
from cvxupdate.physics.effect import Effect

MOST = 6  # explanations that are compared: fifteen pairs
TRIED = 3  # starts of each effect


@dataclass(frozen=True)
class Named:
    """An effect as a `diagnosis.json` names it: its physics and its location."""

    physics: str
    location: Mapping[str, Any]

    def is_at(self, effect: Effect) -> bool:
        """Whether an effect is this one."""
        mine = {k: v for k, v in self.location.items() if v}
        return mine == {k: v for k, v in effect.place.to_json().items() if v}


def explanations_of(told: Any, where: str) -> tuple[tuple[Named, ...], ...]:
    """The sets of effects that do alike: the findings, and the findings with each equivalent in the
    place of what it may stand for. Where nothing was found, the nearest single effects that were
    refitted. ``told`` is the content of a `diagnosis.json`, ``where`` its path.

    Raises
    ------
    InputError
        For something else than that, or one that leaves nothing to tell apart.
    """
    if not isinstance(told, Mapping) or not isinstance(told.get("findings"), list):
        raise InputError(f"{where} is no diagnosis.json: give the one that `diagnose` wrote.")
    try:
        whole = tuple(_named(f) for f in told["findings"])
        sets = [whole] if whole else []
        for k, finding in enumerate(told["findings"]):
            for other in finding.get("equivalent", ()):
                sets.append((*whole[:k], _named(other), *whole[k + 1 :]))
        if not whole:
            sets = _nearest(told.get("candidates", ()))
    except (TypeError, KeyError, AttributeError) as err:
        raise InputError(
            f"{where}: its findings are not as diagnose writes them ({err!r}). Run it again."
        ) from err
    if len(sets) < 2:
        verdict = "one explanation and no equivalent" if sets else "nothing that may be missing"
        raise InputError(
            f"{where} lists {verdict}: there is nothing to tell apart. Leave --diagnosis out to "
            "plan from the model alone."
        )
    return tuple(sets[:MOST])


def _named(row: Mapping[str, Any]) -> Named:
    return Named(str(row["physics"]), dict(row["location"]))


def _nearest(candidates: Sequence[Mapping[str, Any]]) -> list[tuple[Named, ...]]:
    """Of single effects that were refitted those that leave least."""
    alone = [c for c in candidates if c.get("misfit") is not None and "beside" not in c]
    return [(_named(c),) for c in sorted(alone, key=lambda c: float(c["misfit"]))[:MOST]]


def refitted(
    evidence: Evidence, named: Sequence[Named], progress: Progress, where: str
) -> Hypothesis | None:
    """The effects placed one after the other, each at its best size beside those before it, then
    all fitted to the end; None where that leads to no structure.

    Raises
    ------
    InputError
        Where the model has no place for one of them.
    """
    h = Hypothesis((), evidence.bases[0])
    for one in named:
        if one.physics not in evidence.names:
            raise InputError(
                f"{where}: {one.physics} is not told by what {evidence.told_by} are fitted to, so "
                "no further measurement can be compared for it. Leave --diagnosis out."
            )
        model = h.fit.setting.model
        placed = [
            *evidence.candidates(model, (one.physics,)),
            *_parts_of_rigs(evidence, model, one),
        ]
        effects = [c for c in placed if one.is_at(c)]
        if not effects:
            raise InputError(
                f"{where}: {one.physics} at {dict(one.location)} has no place on this model. Give "
                "the diagnosis of this very problem."
            )
        nominal = at_nominal(evidence, h)
        sized = evidence.finite_size(nominal.fit, h.fit, h.effects, effects)
        best = sorted(sized.scores, key=lambda s: -s.fraction)[:TRIED]
        first = sorted(evidence.first_order(h.fit, effects), key=lambda s: -s.fraction)[:TRIED]
        seeds = [
            *seeds_from(evidence, nominal, best, 0, nominal=True),
            *seeds_from(evidence, h, first, 0),
            *sized.seeds,
        ]
        found = entered(evidence, seeds, progress)
        if not found:
            return None
        h = found[0]
    ended = raced(evidence, [h], (*COARSE, *FINE), progress)
    return ended[0] if ended else None


def _parts_of_rigs(evidence: Evidence, model: Model, named: Named) -> list[Effect]:
    """What is never sought by itself, only as part of a rig: a shaker where it drives."""
    kinds = [t for t in effect_types() if t.name == named.physics and not t.sought]
    context = evidence.context(model)
    return [e for t in kinds if evidence.told_by in t.told_by for e in t.candidates(context)]

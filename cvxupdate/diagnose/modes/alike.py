"""The other places of an effect that tables of modes hardly tell from its own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.first_order import block_columns, columns_of, linearised
from cvxupdate.diagnose.screen.likeness import in_proportion, of_one_kind, proportional
from cvxupdate.diagnose.screen.projection import Linearised, Projection
from cvxupdate.diagnose.settings import NEIGHBOURING
from cvxupdate.fe.block import Index
from cvxupdate.physics.attached_resonator import hidden_label
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.physics.growth import at_once
from cvxupdate.residual.modal import ModalPoint


def alike_of(
    effect: Effect,
    base: Fit,
    found: Fit,
    candidates: Sequence[Effect],
    least: float = NEIGHBOURING,
) -> list[Effect]:
    """Of ``candidates`` those that are hardly told from an effect (squared cosine at ``least``):
    beside the nuisance parameters alone (``base``), or of a hidden oscillator as it was
    ``found``."""
    if isinstance(effect.action, HiddenOscillator):
        n = len(base.setting.model.parameters)
        return oscillators_alike(found, effect, candidates, n, least)
    return places_alike(base, effect, candidates, least)


def places_alike(
    base: Fit, effect: Effect, candidates: Sequence[Effect], least: float = NEIGHBOURING
) -> list[Effect]:
    """Of ``candidates`` those of the type of ``effect`` at other places of its kind and extent
    whose derivatives of what was measured, free of those of the nuisance parameters (``base``), are
    in proportion to its own there: the squared cosine is at ``least`` so much. Most alike first."""
    columns = partial(columns_of, base)
    return proportional(effect, candidates, columns, partial(linearised, base), least)


def oscillators_alike(
    found: Fit,
    effect: Effect,
    candidates: Sequence[Effect],
    nuisance: int,
    least: float = NEIGHBOURING,
) -> list[Effect]:
    """The same of a hidden oscillator that is fitted (``found``, the first ``nuisance`` of its
    parameters are no effects'): without it there is no derivative, for its size is not small. At
    each frequency it is a spring of one size to whatever it stands on, k ω²/(ω² − ω₀²), so places
    are alike where such a spring moves what was measured alike."""
    point, model = found.point, found.setting.model
    hidden = model.place.get(hidden_label(f"n{effect.place.nodes[0]}", effect.place.dof or ""))
    if hidden is None:
        return []
    spots = {e.place: e for e in candidates if of_one_kind(e, effect)}
    others = [e for place, e in spots.items() if place != effect.place]
    rows = [
        model.place[f"n{p.nodes[0]}.{p.dof}"] for p in (effect.place, *(e.place for e in others))
    ]
    K, M = point.matrices.K, point.matrices.M
    own = float(K[hidden, hidden] / M[hidden, hidden])
    columns, unit = block_columns(found), np.ones((1, 1))
    J = np.stack([columns.of_blocks(at_once((r,), "K", unit)[0]) for r in rows], axis=1)
    _, weights, _ = point.differences
    at = point.modes.eigenvalues[_places_of_rows(point)]
    J *= (weights * at / np.where(at == own, np.inf, at - own))[:, None]
    whole = linearised(found)
    n = slice(nuisance)
    free = Linearised(whole.A[:, n], whole.r, whole.p[n], whole.scales[n])
    return in_proportion(Projection.of(free), J, others, least)


def _places_of_rows(point: ModalPoint) -> Index:
    """Place of the mode that each row of the differences is of, (rows,)."""
    parts = [point.paired]
    for _, _, place, sensors, _, _ in point.shape_rows() if point.residual.shapes else ():
        parts.append(np.full(len(sensors), place))
    return np.concatenate(parts)

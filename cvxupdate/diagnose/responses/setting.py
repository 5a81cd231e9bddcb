"""A model against recordings of responses, with a damping ratio of its own for every mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit, fitted, fitted_at
from cvxupdate.diagnose.nominal.damping import file_damping
from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.nominal.scatter import let_far
from cvxupdate.diagnose.nominal.supports import elements_of
from cvxupdate.diagnose.responses.point import ResponseSetting
from cvxupdate.diagnose.responses.signals import Real, Signal
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS, MODE_DAMPING_STD, STRAYED, WIDE
from cvxupdate.diagnose.types import Evidence
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis.shapes import EveryDof, Shapes
from cvxupdate.fe.synthesis.space import Space, space_of
from cvxupdate.physics.fault import Fault
from cvxupdate.update.trust_region import Options

# of a parameter: so far from its centre a space is as good as there (2e-5 of the frequencies of a
# plate where a patch is 31 % thicker); and where a fit is to be sharp
FAR, NEARBY = 0.3, 0.05
BEYOND = 1.25  # of the band's top: modes up to there have a damping ratio of their own
MORE, FALLING = 3, 0.9  # times a sharp fit goes on; of its weighted squares what it must leave less
# tolerance, iterations and first trust region of a fit by its effort
EFFORTS = {
    "first pass": Options(1e-2, 3, 0.5),
    "base": Options(3e-3, 12, 0.5),
    "coarse": Options(1e-2, 12, 0.5),
    "sharp": Options(1e-3, 12, 0.5),
}


def setting_for(
    model: Model,
    original: Model,
    signals: Sequence[Signal],
    top: float,
    faults: Sequence[Fault] = (),
    mesh: MeshError = NONE,
    base: Space | None = None,
) -> ResponseSetting:
    """Give every mode in the band a damping ratio of its own, starting from the problem file's. Its
    modes are sought among every DOF, or in a space around today's model where the nominal one has
    such a space (``base``)."""
    shapes: Shapes = EveryDof(model, top)
    if base is not None:
        far, ports = _far(model), np.flatnonzero(model.dof_kind < 3)
        grown = base.grown(model, far) or base.opened(model, ports, far)
        shapes = around(model, model.zero(), top) if grown is None else grown
    flexible = shapes.lowest()
    f = flexible[: int(np.sum(flexible < BEYOND * top))]
    damping = file_damping(original, f)
    return ResponseSetting(model, tuple(signals), damping, top, shapes, tuple(faults), mesh)


def around(model: Model, at: Real, top: float) -> Space:
    """The space of a model around parameter values: local effects act at translations of its
    nodes; parameters that may go far bring directions of their own."""
    return space_of(model, at, top, np.flatnonzero(model.dof_kind < 3), _far(model))


def _far(model: Model) -> list[int]:
    return [j for j, q in enumerate(model.parameters) if q.group is None or q.upper >= WIDE]


def recentred(setting: ResponseSetting, p: Real, far: float) -> ResponseSetting:
    """The same with its space, if it has one, around other values of the unknowns, where a
    parameter on many DOFs is more than ``far`` off its centre."""
    own, space = p[: len(setting.model.parameters)], setting.shapes
    if not isinstance(space, Space) or not space.far(own, far):
        return setting
    return replace(setting, shapes=space.recentred(own))


def counted(setting: ResponseSetting, p: Real) -> tuple[ResponseSetting, Real]:
    """The same with a damping ratio for every mode that is in the band at ``p``, and its unknowns:
    what yields (a fixture, a soft support) brings modes into it that the nominal model has above,
    or not at all."""
    modes = setting.shapes.modes(p[: len(setting.model.parameters)]).modes
    known = modes.rigid + setting.damped
    more = int(np.sum(modes.frequencies[known:] < BEYOND * setting.top))
    if more <= 0 or not setting.damped:
        return setting, p
    ends = [setting.ratios.stop]
    if setting.tuned:
        ends.append(setting.ratios.stop + setting.damped)
    typical = np.full(more, np.median(setting.zeta))
    grown = replace(setting, zeta=np.concatenate([setting.zeta, typical]))
    return grown, np.insert(p, np.repeat(ends, more), 0.0)


def with_damped(setting: ResponseSetting, like: ResponseSetting | None) -> ResponseSetting:
    """A setting with a damping ratio for as many modes as another one has, as far as it has so
    many."""
    if like is None or like.damped <= setting.damped:
        return setting
    modes = setting.shapes.modes(setting.model.zero()).modes
    count = max(setting.damped, min(like.damped, len(modes.eigenvalues) - modes.rigid))
    return replace(setting, zeta=like.zeta[:count])


def unstrayed(setting: ResponseSetting, p: Real) -> Real | None:
    """The unknowns with the usual damping of modes that strayed from it: beside a recording whose
    resonance stands elsewhere a mode is damped away, and stays so when it has come there. None
    where none did."""
    far = np.abs(p[setting.ratios]) > STRAYED * MODE_DAMPING_STD
    out = p.copy()
    out[setting.ratios][far] = 0.0
    return out if far.any() else None


def followed(setting: ResponseSetting, start: Real, effort: str) -> Fit:
    """Fitted by trust-region convex steps; to be sharp, on from there in the space around where
    they end, from the usual damping where that is nearer already, and `to_the_end`."""
    setting, start = counted(setting, start)
    setting = recentred(setting, start, FAR)
    start = _from_afar(setting, start) if effort == "sharp" else start
    found = fitted(setting, start, EFFORTS[effort])
    again = setting if effort != "sharp" else recentred(setting, found.p, NEARBY)
    if again is not setting:
        found = fitted(again, found.p, EFFORTS[effort])
    usual = unstrayed(again, found.p)
    if usual is not None and fitted_at(again, usual, found.point).cost < found.cost:
        found = fitted(again, usual, EFFORTS[effort])
    return to_the_end(again, found) if effort == "sharp" else found


def _from_afar(setting: ResponseSetting, start: Real) -> Real:
    """Where a sharp fit begins: far off, where one ends whose groups scatter freely, for what is
    known of them holds resonances where they are."""
    if fitted_at(setting, start).misfit <= HOPELESS * EXPLAINED:
        return start
    return fitted(replace(setting, loose=True), start, EFFORTS["coarse"]).p


def to_the_end(setting: ResponseSetting, found: Fit) -> Fit:
    """On for as long as it falls, where that may come to explain: along a narrow valley a dozen
    steps are not enough, and what is far off leads nowhere."""
    for _ in range(MORE):
        if not EXPLAINED < found.misfit <= HOPELESS * EXPLAINED:
            return found
        before, found = found, fitted(setting, found.p, EFFORTS["sharp"])
        if found.cost > FALLING * before.cost:
            return found
    return found


def nuisance_fits(evidence: Evidence) -> tuple[Fit, ...]:
    """The nuisance parameters alone, fitted level by level; far off, there is nothing to
    sharpen."""
    out: list[Fit] = []
    setting = evidence.setting(evidence.model, ())
    p = np.zeros(len(setting.columns))
    for level in range(evidence.levels):
        out.append(fitted(evidence.at_level(setting, level), p, EFFORTS["base"]))
        p = out[-1].p
        if level == evidence.levels - 2 and out[-1].misfit > HOPELESS * EXPLAINED:
            break
    return tuple(out)


def let_go(evidence: Evidence) -> Fit:
    """The nuisance parameters fitted far beyond their scatter, level by level."""
    setting = evidence.setting(
        let_far(evidence.model, elements_of(evidence.file or evidence.model)), ()
    )
    found = fitted(setting, np.zeros(len(setting.columns)), EFFORTS["base"])
    for level in range(1, evidence.levels):
        found = fitted(evidence.at_level(setting, level), found.p, EFFORTS["base"])
    return found

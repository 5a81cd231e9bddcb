"""Sizes on which no hypothesis may rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.soundness import _everywhere, fixity, said_plainly, sound, usual
from cvxupdate.diagnose.settings import AT_BOUND, LEAST_SIZE, MASS_STD, PIECE, STIFFNESS_STD
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics import candidates_of
from cvxupdate.physics.attached_resonator import AttachedResonator, attach
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import ChannelFault, Effect, HiddenOscillator
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import physical
from cvxupdate.recordings.types import ModeTable, Origin
from cvxupdate.residual.modal import modal_residual
from tests.cases.cantilever import load
from tests.cases.long_bar import text as long_bar
from tests.cases.plain_evidence import (
    PlainFit,
    PlainSetting,
    PlainType,
    effect,
    fault,
    parameter,
    rig,
    supposed,
)

FIT = PlainFit(1.0)
NOTHING = (PlainFit(100.0),)
GROUNDS = SimpleNamespace(band=(0.1, 1e3), file=None, bases=NOTHING)  # Hz: nothing swings yet
SOFT = 1.0 / (3.0 * 207e9 * 0.04 * 0.012**3 / 12.0)  # m/N, at the tip of the bar of a metre


def test_a_size_is_clearly_something() -> None:
    assert sound(supposed(FIT, effect(), size=0.5, std=0.5 / (1.01 * LEAST_SIZE)), GROUNDS)
    assert not sound(supposed(FIT, effect(), size=0.5, std=0.5 / (0.99 * LEAST_SIZE)), GROUNDS)


def on_members() -> Effect:
    """A factor on two elements."""
    factor = effect()
    assert factor.change is not None
    return replace(factor, action=replace(factor.change, members=(1, 2)))


@pytest.mark.parametrize(("of", "std"), [("stiffness", STIFFNESS_STD), ("mass", MASS_STD)])
def test_pieces_of_a_group_scatter_about_their_common_value(of: str, std: float) -> None:
    assert usual(on_members(), parameter("q", of)) == PIECE * std
    assert usual(effect(), parameter("q", of)) == 0.0, "a spring that nobody drew has no scatter"
    assert usual(fault("n1.x"), parameter("q", of)) == 0.0


def test_a_factor_within_the_scatter_of_its_pieces_is_nothing() -> None:
    least = LEAST_SIZE * PIECE * STIFFNESS_STD
    assert not sound(supposed(FIT, on_members(), size=0.9 * least, std=1e-6), GROUNDS)
    assert sound(supposed(FIT, on_members(), size=1.1 * least, std=1e-6), GROUNDS)
    assert sound(supposed(FIT, effect(), size=0.9 * least, std=1e-6), GROUNDS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_size_on_its_bound_would_rather_be_elsewhere(side: float) -> None:
    assert not sound(supposed(FIT, effect(), size=side * (1.0 - 0.5 * AT_BOUND)), GROUNDS)
    assert sound(supposed(FIT, effect(), size=side * (1.0 - 2.0 * AT_BOUND)), GROUNDS)


def test_a_compliance_may_be_as_large_as_it_can() -> None:
    """A joint that holds nothing is a hinge; one that is stiffer than rigid is none."""
    joint = effect()
    assert joint.change is not None
    joint = replace(joint, action=replace(joint.change, series=True))
    assert sound(supposed(FIT, joint, size=1.0), GROUNDS)
    assert not sound(supposed(FIT, joint, size=-1.0), GROUNDS)


@pytest.mark.parametrize("parts", [4, 32])
@pytest.mark.parametrize(("k", "there"), [(100.0, False), (1e6, True)])
def test_a_spring_may_be_nearly_rigid_but_not_nearly_nothing(
    tmp_path: Path, parts: int, k: float, there: bool
) -> None:
    """Both as large as their deviations: a roller 280 times as stiff as its place is there, "100 ±
    100 N/m" of a soft spring is nothing; however fine the mesh is."""
    _, bar = load(tmp_path, long_bar(parts, rows="rows = [{ frequency = 10.0 }]"))
    bare = bar.with_parameters(())
    m = bare.matrices(bare.zero())
    context = SearchContext(bare, m.K, m.M, 1.0, 0.1, (), (), lambda node, kind: bare, 0.01)
    tip = Place(nodes=(parts + 1,), dof="z")
    spring = next(e for e in candidates_of(context, ("grounding_spring",)) if e.place == tip)
    assert spring.change is not None
    model = spring.change.model
    unit, _ = spring.figures[0].value(model, model.parameters[-1], 1.0, 0.0)
    p = np.array([k / unit])
    fit = PlainFit(1.0, p=p, deviations=p, setting=PlainSetting(model))  # type: ignore[arg-type]
    h = Hypothesis((spring,), fit)  # type: ignore[arg-type]
    assert fixity(h, 0, 1e-4) == pytest.approx(1.0 + k * SOFT, rel=1e-5)
    assert sound(h, GROUNDS) is there


def test_every_effect_counts() -> None:
    a, b = effect(), effect(nodes=(2,))
    h = supposed(FIT, a, b)
    assert sound(h, GROUNDS)
    hardly = replace(h.fit, p=h.fit.p * [1.0, 1e-3])  # type: ignore[type-var]
    assert not sound(replace(h, fit=hardly), GROUNDS)


def test_an_exchange_of_channels_has_no_size() -> None:
    """Its figure is one when it is whole, the same as of a channel without fault."""
    gain = fault("n1.x")
    swap = replace(gain, action=ChannelFault(Fault("n1.x", "swap", other="n2.x")))
    assert not sound(supposed(FIT, gain, size=0.0), GROUNDS)
    assert sound(supposed(FIT, swap, size=0.0), GROUNDS)


@dataclass(frozen=True)
class Plain(PlainType):
    """An effect whose figures are said more plainly where they are below one."""

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        return max(values.values()) < 1.0


def test_what_a_plainer_effect_says_is_told_from_its_figures() -> None:
    """Of effects with several unknowns; one unknown is as plain as can be."""
    for count, size, plain in ((2, -0.5, True), (2, 0.5, False), (1, -0.5, False)):
        one = replace(effect(count=count), type=Plain())
        assert said_plainly(supposed(FIT, effect(nodes=(2,)), one, size=size)) == plain


def test_a_rig_does_everywhere_what_is_no_matter_of_one_place() -> None:
    """Beside that alone a mass that nothing tells is let pass."""
    feet, foot = rig("grounding_spring", nodes=(1, 2)), rig("grounding_spring", nodes=(1,))
    assert _everywhere(feet) and not _everywhere(foot) and not _everywhere(effect(nodes=(1, 2)))


@pytest.mark.parametrize(("measured", "there"), [(True, True), (False, False)])
def test_an_oscillator_whose_mode_was_measured_is_there(
    tmp_path: Path, measured: bool, there: bool
) -> None:
    """Its tuning is known, and its mass to two thirds of itself, or not at all."""
    _, bar = load(tmp_path, long_bar(12, rows="rows = [{ frequency = 10.0 }]"))
    bare = bar.with_parameters(())
    own, mass = model_modes(bare, 3), 0.05
    f = float(np.sqrt(own.frequencies[0] * own.frequencies[1]))
    grown = attach(bare, bare.place["n13.z"], f, mass, 0.0)
    among = model_modes(grown, 4).frequencies
    pairs = np.flatnonzero(np.abs(among / f - 1.0) > (0.0 if measured else 0.2)) + 1
    kept, nothing = among[pairs - 1], np.full(len(pairs), np.nan)
    table = ModeTable(
        Origin("t", "t", "fit"), kept, 1e-3 * kept, nothing, nothing, (), None, None, pairs
    )
    point = modal_residual(grown, (table,), (), False).evaluate(grown.zero())
    p, action = np.zeros(2), HiddenOscillator(0, f, 0.0, attach, mass)
    fit = PlainFit(1.0, p=p, deviations=p + 2.0 / 3.0, setting=PlainSetting(grown), point=point)  # type: ignore[arg-type]
    figures = (physical("m", "kg"), physical("k", "N/m", 1))
    hung = Effect(AttachedResonator(), Place(nodes=(13,), dof="z"), action, figures, 1)
    assert sound(Hypothesis((hung,), fit), GROUNDS) is there  # type: ignore[arg-type]
    point = replace(point, residual=replace(point.residual, fit=(replace(table, pairs=-pairs),)))
    untold = replace(fit, deviations=p + 1e3, point=point)  # type: ignore[arg-type]
    assert not sound(Hypothesis((hung,), untold), GROUNDS), "it leaves more than noise"  # type: ignore[arg-type]
    bare_of_shapes = replace(untold, spent=True)
    assert not sound(Hypothesis((hung,), bare_of_shapes), GROUNDS)  # type: ignore[arg-type]
    shaped = replace(point, residual=replace(point.residual, shapes=True))
    alone = replace(bare_of_shapes, point=shaped)
    assert sound(Hypothesis((hung,), alone), GROUNDS) is there  # type: ignore[arg-type]
    few = SimpleNamespace(band=GROUNDS.band, file=None, bases=(PlainFit(1.2),))
    assert not sound(Hypothesis((hung,), alone), few), "any oscillator meets a few frequencies"  # type: ignore[arg-type]
    beside = SimpleNamespace(band=GROUNDS.band, file=bare, bases=NOTHING)
    assert sound(Hypothesis((hung,), untold), beside) is there, "a mode that came since"
    paired = replace(fit, deviations=p + 1e3)
    assert not sound(Hypothesis((hung,), paired), beside), "the reference had it"  # type: ignore[arg-type]

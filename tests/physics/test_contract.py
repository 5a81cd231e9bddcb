"""The laws that every effect obeys, over every registered type: it is absent at zero, its tangent
is a derivative, it stays within its bounds, it says what it is, a problem file can say it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.physics import EFFECTS, candidates_of, effect_names
from cvxupdate.physics.alike import OWN
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import (
    MOTION,
    RESPONSES,
    Effect,
    EffectType,
    HiddenOscillator,
    Planted,
)
from cvxupdate.physics.internal_force import NonlinearForce
from cvxupdate.physics.joint_flexibility import LIMITS as JOINT_LIMITS
from cvxupdate.physics.low_rank import low_rank
from cvxupdate.physics.zone import ZoneChange
from cvxupdate.spec import Spec, check_problem, load_problem
from cvxupdate.spec.update import PHYSICS
from tests.cases.effects import (
    ACCELEROMETERS,
    CASES,
    STRUCTURES,
    Case,
    context_of,
    nuisance,
    problem,
)

Real = NDArray[np.float64]
RIGID = 3e-4  # a compliance begins at a ten thousandth of its place's own, not at zero
MASS, ZETA = 0.07, 0.03  # of a hidden oscillator, kg
ABOUT = np.array([0.031, -0.024])  # the nuisance parameters
FREQUENCIES = (7.0, 61.0, 333.0)
MOST = 12
PLANTED = HiddenOscillator | NonlinearForce  # those that are there as soon as they are planted


def type_of(case: Case) -> EffectType:
    return next(t for t in EFFECTS if type(t).__name__ == case.type)


@pytest.fixture(params=CASES, ids=lambda c: c.type)
def case(request: pytest.FixtureRequest) -> Case:
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def scene(case: Case, tmp_path: Path) -> tuple[Spec, Model, SearchContext]:
    spec = problem(tmp_path, STRUCTURES[case.structure])
    model = nuisance(undamped(build_model(spec)))
    sensors = ACCELEROMETERS[case.structure]
    context = context_of(spec, model, sensors)
    if case.apart:
        context = replace(context, driven=sensors[:2], forces=sensors[:2], apart=True)
    return spec, model, context


def planted(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> Iterator[tuple[Effect, Planted]]:
    """Some of its places (a hidden oscillator has many tunings at each), each on its model."""
    _, model, context = scene
    found = list({e.key: e for e in type_of(case).candidates(context)}.values())
    assert found
    for effect in found[:: max(1, len(found) // MOST)]:
        guess = np.array([MASS, *np.zeros(effect.count - 1)])
        yield effect, effect.action.plant(effect, model, guess, 1e-3)


def dense(model: Model, p: Real) -> dict[str, Real]:
    m = model.matrices(p)
    return {name: getattr(m, name).toarray() for name in "KMCD"}


def onto(base: Model, model: Model, m: dict[str, Real], name: str) -> Real:
    """A matrix of ``model`` on the DOFs of ``base``; those beyond are held by K and condensed."""
    keep = [model.place[label] for label in base.labels]
    rest = [i for i in range(model.size) if i not in set(keep)]
    if not rest:
        return m[name][np.ix_(keep, keep)]
    K = m["K"]
    T = np.zeros((model.size, len(keep)))
    T[keep] = np.eye(len(keep))
    T[rest] = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, keep)])
    return np.asarray(T.T @ m[name] @ T)


def assembled(size: int, blocks: tuple[DerivativeBlock, ...], name: str) -> Real:
    out = np.zeros((size + 1, size + 1))
    for b in blocks:
        part = getattr(b, name)
        if part is not None:
            for dofs, small in zip(b.dofs, part, strict=True):
                out[np.ix_(dofs, dofs)] += small
    return out[:-1, :-1]


def test_the_cases_are_the_registered_types() -> None:
    assert list(dict.fromkeys(c.type for c in CASES)) == [type(t).__name__ for t in EFFECTS]
    assert set(effect_names()) <= set(PHYSICS)


def test_places_are_hashable_and_each_its_own(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    """But for the tunings of a hidden oscillator or a fixture, which the fit refines."""
    found = type_of(case).candidates(scene[2])
    (tunings,) = set(Counter(e.key for e in found).values())
    refined = (e.change is None or e.change.start is not None for e in found)
    assert tunings == 1 or all(refined)
    every = [e for kind in (RESPONSES, MOTION) for e in candidates_of(scene[2], None, kind)]
    if type_of(case).sought:
        assert {e.key for e in found} <= {e.key for e in every}
    else:  # by themselves other types are
        assert all(type(e.type).__name__ != case.type for e in every)
    for e in found[:MOST]:
        again = e.on(scene[2])
        assert again is not None and again.key == e.key and again.physics == type_of(case).name


def test_at_its_start_the_model_is_what_it_was(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    _, model, _ = scene
    before = dense(model, ABOUT)
    for effect, put in planted(case, scene):
        assert len(put.start) == effect.columns
        assert len(put.model.parameters) == len(model.parameters) + effect.columns
        if isinstance(effect.action, HiddenOscillator):
            continue  # it is there once it is planted: its mass is that of its first-order size
        assert np.all(put.start[1:] == 0.0)
        after = dense(put.model, np.concatenate([ABOUT, 0.0 * put.start]))
        for name, was in before.items():
            zone = isinstance(effect.change, ZoneChange)  # its ends are joints
            rigid = zone or (effect.change is not None and effect.change.series)
            gap = np.abs(onto(model, put.model, after, name) - was).max()
            assert gap <= (RIGID if rigid else 1e-12) * max(np.abs(was).max(), 1e-300), effect.name


def test_its_tangent_is_the_derivative_of_its_model(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    """By complex step; by a difference where DOFs of its own have to be condensed."""
    _, model, _ = scene
    for effect, put in planted(case, scene):
        if effect.change is None:
            continue
        for k, blocks in enumerate(effect.change.tangent):
            p = put.model.zero()
            if put.model.size == model.size and not effect.change.series:
                step = p.astype(complex)
                step[len(model.parameters) + k] = 1e-30j
                m = put.model.matrices(step)
                wanted = {n: getattr(m, n).toarray().imag / 1e-30 for n in "KMCD"}
                tolerance = 1e-9
            else:
                before = dense(put.model, p)
                p[len(model.parameters) + k] = 1e-6
                after = dense(put.model, p)
                wanted = {
                    "K": (onto(model, put.model, after, "K") - onto(model, put.model, before, "K"))
                    / 1e-6
                }
                tolerance = 2e-3
            for name, rate in wanted.items():
                got = assembled(model.size, blocks, name)
                assert np.abs(got - rate).max() <= tolerance * max(np.abs(rate).max(), 1e-300), (
                    effect.name,
                    name,
                )


def test_parameters_keep_the_limits(case: Case, scene: tuple[Spec, Model, SearchContext]) -> None:
    _, model, _ = scene
    for effect, put in planted(case, scene):
        for q in put.model.parameters[len(model.parameters) :]:
            if q.group == OWN:  # of one of a class: no unknown
                continue
            joint = isinstance(effect.change, ZoneChange) and q.of == "a"
            limits = JOINT_LIMITS if joint else effect.limits
            assert (q.lower, q.upper) == limits, effect.name
            assert (
                q.lower <= 0.0 <= q.upper
                and q.lower < q.upper
                and (effect.sign == 0 or q.lower == 0.0 or not effect.change)
            )


def test_it_says_what_and_how_much(case: Case, scene: tuple[Spec, Model, SearchContext]) -> None:
    """One sentence with a number and, where the figure has one, its unit; nothing of the contract's
    spelling."""
    for effect in type_of(case).candidates(scene[2])[:MOST]:
        said = effect.says(case.figures)
        assert re.fullmatch(r"[A-Z].*\.", said) and said.count(". ") == 0, said
        assert effect.physics not in said and "_" not in said + effect.title
        assert re.search(r"\d", said) and not re.search(r"\de[+-]?\d|nan", said), said
        figure = effect.figures[0]
        units = {"N·m/rad", "N/m", "N·s/m", "kg", "N", "rad/s", "s", "1/s", ""}
        units |= {"N/m³", "N·s²/m²"}
        assert figure.unit in units
        spelled = {"kg": r"\d k?g", "1/s": "a second"}.get(figure.unit, re.escape(figure.unit))
        assert re.search(spelled, said), said
        assert {q.name for q in effect.figures} == set(case.figures)


def test_figures_come_from_its_unknowns(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    """A figure moves with its unknown as its deviation says; where nothing is there it is that of
    nothing."""
    _, model, _ = scene
    for effect, put in planted(case, scene):
        own = put.model.parameters[len(model.parameters) :]
        x, dx = np.full(effect.count, 0.3), np.full(effect.count, 1e-7)
        values, deviations = effect.reported(put.model, own, x, dx, 1e-3)
        moved, _ = effect.reported(put.model, own, x + dx, dx, 1e-3)
        nothing, _ = effect.reported(put.model, own, 0.0 * x, dx, 1e-3)
        for q in effect.figures:
            rate = abs(moved[q.name] - values[q.name])
            assert rate == pytest.approx(deviations[q.name], rel=1e-4)
            if q.nothing is not None and not isinstance(effect.action, PLANTED):
                assert nothing[q.name] == q.nothing


def test_it_is_tenable_as_it_was_planted(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    _, model, context = scene
    for effect, put in planted(case, scene):
        own = put.model.parameters[len(model.parameters) :]
        x = np.array(put.start) if effect.columns else np.array([0.0])
        x = np.array([own[0].lower]) if effect.type.total and own else x  # where it ends
        values, _ = put.effect.reported(put.model, own, x, np.zeros(effect.count), 1e-3)
        assert put.effect.tenable(values, context.bottom, context.top)


def sizes_of(effect: Effect, put: Planted, known: int) -> Real:
    """Nuisance parameters off by percents, the effect by much, within bounds."""
    rng = np.random.default_rng(len(effect.name))
    p = np.concatenate([ABOUT, rng.uniform(0.2, 0.45, effect.columns)])
    if effect.sign == 0 and len(effect.name) % 2:
        p[known:] *= -1.0
    return np.clip(
        p, *([getattr(q, side) for q in put.model.parameters] for side in ("lower", "upper"))
    )


def test_a_problem_file_can_say_it(
    case: Case, scene: tuple[Spec, Model, SearchContext], tmp_path: Path
) -> None:
    """Built anew, it has the same matrices; a model with DOFs of its own the same receptances."""
    spec, model, _ = scene
    for effect, put in planted(case, scene):
        p = sizes_of(effect, put, len(model.parameters))
        path = tmp_path / "again.toml"
        written = problem_file(spec, Updated(put.model, p, zeta=np.zeros(1)))
        path.write_text(written.text, encoding="utf-8")
        assert check_problem(path) == ()
        rebuilt = build_model(load_problem(path))
        assert rebuilt.size == put.model.size
        wanted, got = dense(put.model, p), dense(rebuilt, rebuilt.zero())
        if set(put.model.labels) <= set(rebuilt.labels):
            order = [rebuilt.place[label] for label in put.model.labels]
            for name, one in wanted.items():
                gap = np.abs(one - got[name][np.ix_(order, order)]).max()
                assert gap <= 1e-9 * max(np.abs(one).max(), 1e-300), (effect.name, name)
            continue
        for f in FREQUENCIES:
            one, other = (
                np.linalg.inv(
                    m["K"] + 1j * m["D"] + 2j * np.pi * f * m["C"] - (2 * np.pi * f) ** 2 * m["M"]
                )
                for m in (wanted, got)
            )
            a, b = ([x.place[n] for n in model.labels] for x in (put.model, rebuilt))
            one, other = one[np.ix_(a, a)], other[np.ix_(b, b)]
            direct = np.sqrt(np.abs(np.diag(one)))
            assert np.all(np.abs(one - other) <= 1e-8 * np.outer(direct, direct)), effect.name


def test_along_few_directions_any_size_is_in_closed_form(
    case: Case, scene: tuple[Spec, Model, SearchContext]
) -> None:
    """Z + W A Wᵀ is the dynamic stiffness of the grown model, its own DOFs condensed."""
    _, model, _ = scene
    base = dense(model, model.zero())
    for effect, put in planted(case, scene):
        change = low_rank(put.effect)
        if change is None:
            continue
        # a compliance is in series with the stiffness around it: a static law
        rigid = effect.change is not None and effect.change.series
        s = np.zeros(1, dtype=complex) if rigid else 2j * np.pi * np.array(FREQUENCIES) + 3.0
        size = 0.4
        p = put.model.zero()
        hidden = isinstance(put.effect.action, HiddenOscillator)
        p[len(model.parameters)] = 0.0 if hidden else size
        grown = dense(put.model, p)
        amount = change.at(np.array([MASS if hidden else size]), s)[:, 0]
        keep = [put.model.place[label] for label in model.labels]
        rest = [i for i in range(put.model.size) if i not in set(keep)]
        W = np.zeros((model.size, change.W.shape[1]))
        W[change.used] = change.W
        for point, own_size in zip(s, amount, strict=True):
            z, after = (
                m["K"] + 1j * m["D"] + point * m["C"] + point**2 * m["M"] for m in (base, grown)
            )
            got = z + W @ np.diag(own_size) @ W.T
            wanted = after[np.ix_(keep, keep)]
            if rest:
                inner, side = after[np.ix_(rest, rest)], after[np.ix_(rest, keep)]
                wanted = wanted - after[np.ix_(keep, rest)] @ np.linalg.solve(inner, side)
            tolerance = RIGID if rigid else 1e-9
            own = np.abs(scipy.linalg.norm(wanted - z))
            assert scipy.linalg.norm(got - wanted) <= tolerance * own + 1e-12 * np.abs(z).max(), (
                effect.name
            )

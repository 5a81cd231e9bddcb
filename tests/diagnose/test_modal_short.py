"""Short cuts on the way through tables of modes: many words at a time, a space of few modes, a
pairing taken over; each gives what the plain way gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cvxupdate.diagnose.data import held_dofs, ordinary, release_from
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.mesh import NONE
from cvxupdate.diagnose.modal_fit import (
    SIZES,
    _nearly,
    chi_square,
    fit_modes,
    prepared,
    prior_scales,
    residual_of,
)
from cvxupdate.diagnose.modal_search import ModalBench, shares
from scipy.linalg import LinAlgError, eigh
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose import modal_scan
from cvxupdate.fe.modes import model_modes, natural_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.modal import modal_residual
from tests.diagnose.test_modal_scan import load, text

WORDS = ("stiffness_change", "mass_change", "added_mass", "grounding_spring", "joint_flexibility")
SUPPORT = (
    '[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{ id = 90, nodes = [8], k = 2e6 }]'
)


SENSORS = (3, 6, 9, 12)


@pytest.fixture(params=[False, True], ids=["frequencies", "shapes"])
def tried(tmp_path, request):
    """(bench, ordinary fit, its candidates) of the bare cantilever beside four modes of one with a
    stiff support at node 8, with their shapes or without."""
    _, real = load(tmp_path, text(extra=SUPPORT, E="205.5e9"))
    spec, model = load(tmp_path, text())
    start = ordinary(undamped(model))
    modes = model_modes(real, 4)
    f, nothing = modes.frequencies[:4], np.full(4, np.nan)
    shapes = (
        modes.shapes[[real.place[f"n{n}.z"] for n in SENSORS], :4].T
        / np.abs(modes.shapes[:, :4]).max()
    )
    channels = tuple(Channel(n, "z", "displacement") for n in SENSORS)
    seen = (channels, shapes) if request.param else ((), None)
    table = ModeTable(
        Origin("table", "table", "fit"), f, 1e-3 * f, nothing, nothing, *seen, None, np.arange(1, 5)
    )
    data = prepared(start, [table], NONE)
    supports = tuple(
        held_dofs(model, [(s.nodes, s.dofs) for s in spec.model.supports], spec.model.dofs)
    )
    bench = ModalBench(data, WORDS, supports, release_from(spec), lambda said: None)
    base = fit_modes(start, data, start.zero())
    return bench, base, bench.candidates(base)


def scene_of(base):
    model, m = base.model, base.point.matrices
    return modal_scan.scene(base.point, prior_scales(model), natural_modes(m.K, m.M, model.size))


def left_one_by_one(where, c, sizes):
    """The residual left at each size, the modes followed by SciPy's solver of the pencil from size
    to size, without any of the short cuts."""
    basis = where.many.shapes
    K, M = (
        basis.T
        @ sum(
            dense(b.dofs, part, len(basis))
            for b in c.change.tangent[0]
            if (part := getattr(b, name)) is not None
        )
        @ basis
        if any(getattr(b, name) is not None for b in c.change.tangent[0])
        else np.zeros((basis.shape[1],) * 2)
        for name in "KM"
    )
    V, at, out = np.eye(basis.shape[1]), where.used, []
    for p in sizes:
        effective = p / (1.0 + p) if c.change.series else p
        mass = np.eye(len(V)) + effective * M
        try:
            lam, new = eigh(np.diag(where.many.eigenvalues) + effective * K, mass)
        except LinAlgError:
            break
        rows, columns = linear_sum_assignment((V[:, at].T @ mass @ new) ** 2, maximize=True)
        V, at = new, columns[np.argsort(rows)]
        ways = [(at, V[:, at])] + ([] if where.shapes else [(where.used, V[:, where.used])])
        out.append(min(squares(where, lam[places], basis @ shapes) for places, shapes in ways))
    return out


def dense(dofs, part, size):
    out = np.zeros((size + 1, size + 1))
    for rows, values in zip(dofs, part, strict=True):
        out[np.ix_(rows, rows)] += values
    return out[:-1, :-1]


def squares(where, eigenvalues, shapes):
    r = [w * (measured - eigenvalues[u]) for u, measured, w in where.values]
    for u, rows, x, std in where.shapes:
        q = np.linalg.lstsq((shapes[rows, u] / std)[:, None], x / std, rcond=None)[0]
        r += ((x - shapes[rows, u] * q) / std).tolist()
    r = np.concatenate([r, where.below])
    return float(np.sum((r - where.Q @ (where.Q.T @ r)) ** 2))


def test_many_words_at_a_time_are_followed_as_one_by_one(tried):
    _, base, candidates = tried
    where, local = scene_of(base), [c for c in candidates if modal_scan.local(c)]
    assert {c.physics for c in local} == {"added_mass", "grounding_spring", "joint_flexibility"}
    assert any(c.change.series and c.physics == "grounding_spring" for c in local) and any(
        c.limits[0] < 0.0 for c in local
    )
    for c, (left, size) in zip(
        local, modal_scan.best_sizes(where, local, modal_scan.FULL), strict=True
    ):
        coarse = [
            left_one_by_one(where, c, sizes) for sizes in modal_scan._sides(c, modal_scan.SIZES)
        ]
        assert left <= min(min(side) for side in coarse) * (1.0 + 1e-6), c.name
        way = np.sign(size) * np.geomspace(1e-3, abs(size), 40)
        assert left == pytest.approx(left_one_by_one(where, c, way)[-1], rel=1e-5), c.name


def test_a_trace_ends_where_more_mass_is_taken_off_than_there_is(tried):
    _, base, candidates = tried
    where = scene_of(base)
    lump = next(c for c in candidates if c.physics == "added_mass")
    alone = modal_scan._change(where.many.shapes, [lump])
    q, most = alone.K.shape[1], 1.0 / np.linalg.eigvalsh(alone.M[0])[-1]
    sizes = -most * np.array([[0.5, 0.9, 1.1, 0.9]])
    found = modal_scan._trace(where, alone, sizes, np.eye(q)[None], where.used[None]).left
    np.testing.assert_allclose(found[0, :2], left_one_by_one(where, lump, sizes[0])[:2], rtol=1e-6)
    assert len(left_one_by_one(where, lump, sizes[0])) == 2 and np.all(np.isinf(found[0, 2:])), (
        "not beyond, nor again from there"
    )


def test_of_very_many_the_best_of_each_kind_are_looked_at_closely(tried, monkeypatch):
    _, base, candidates = tried
    where = scene_of(base)
    closely = modal_scan.scan(where, candidates)
    monkeypatch.setattr(modal_scan, "MANY", 5)
    monkeypatch.setattr(modal_scan, "CLOSER", 6)
    quickly = modal_scan.scan(where, candidates)
    assert quickly.keys() == closely.keys() and quickly != closely
    for kind in {(candidates[k].physics, candidates[k].place.dof) for k in closely}:
        mine = [k for k in closely if (candidates[k].physics, candidates[k].place.dof) == kind]
        best = min(mine, key=lambda k: closely[k])
        assert (
            quickly[best] == closely[best] and sum(quickly[k] == closely[k] for k in mine) == 6
        ), kind


def test_shares_are_those_of_the_models_that_grow(tried):
    """Columns against differences of the grown model's own modes, shares against plain least
    squares beside the ordinary parameters."""
    _, base, candidates = tried
    few = [c for k, c in enumerate(candidates) if k % 5 == 0 and c.change and not c.change.series]
    assert {c.physics for c in few} >= {
        "stiffness_change",
        "mass_change",
        "added_mass",
        "grounding_spring",
    }
    values, weights, _ = base.point.differences
    scales, h = prior_scales(base.model), 1e-5
    A = np.vstack([base.point.system().weighted()[0], np.diag(1.0 / scales)])
    r = np.concatenate([-weights * values, -base.point.p / scales])
    told = {s.candidate.name: s for s in shares(base, candidates)}
    for c in few:
        residual = replace(base.point.residual, model=c.change.model)
        ends = [
            residual.evaluate(np.append(base.point.p, side * h)).differences[0]
            for side in (-1.0, 1.0)
        ]
        J = np.concatenate([weights * (ends[1] - ends[0]) / (2.0 * h), np.zeros(len(scales))])
        x, before, after = (
            np.linalg.lstsq(A if B is None else np.column_stack([A, B]), r, rcond=None)[0]
            for B in (J, None, J)
        )
        share = 1.0 - np.sum((r - np.column_stack([A, J]) @ after) ** 2) / np.sum(
            (r - A @ before) ** 2
        )
        if c.sign > 0 and x[-1] < 0.0:
            assert told[c.name].share == 0.0
        else:
            assert told[c.name].share == pytest.approx(share, abs=2e-4) and told[c.name].p[
                0
            ] == pytest.approx(x[-1], rel=1e-2, abs=1e-6), c.name


def test_a_pairing_is_taken_over_only_by_the_same_structure(tried):
    bench, base, candidates = tried
    like, data = base.point.residual, bench.data
    for word in ("stiffness_change", "grounding_spring", "joint_flexibility"):
        c = next(
            c
            for c in candidates
            if c.physics == word and (word != "grounding_spring" or not c.change.series)
        )
        over, afresh = (
            residual_of(c.change.model, data, like),
            modal_residual(c.change.model, data.fit, data.hold, data.shapes),
        )
        assert (over.start is like.start) == (
            c.change.model.labels == base.model.labels
        ) and over.model is c.change.model
        assert (
            over.count == afresh.count
            and over.muted == afresh.muted
            and over.unseen == afresh.unseen
        )
        assert all(
            np.array_equal(a, b)
            for a, b in zip(over.start.places, afresh.start.places, strict=True)
        )
        n = min(len(m.start.modes.eigenvalues) for m in (over, afresh))
        np.testing.assert_allclose(
            over.start.modes.eigenvalues[:n], afresh.start.modes.eigenvalues[:n], rtol=1e-9
        )
    heavier = replace(
        base.model,
        blocks=tuple(
            replace(b, properties={**b.properties, "rho": 1.1 * b.properties["rho"]})
            for b in base.model.blocks
        ),
    )
    assert residual_of(heavier, data, like).start is not like.start


@pytest.mark.parametrize("word", ["grounding_spring", "added_mass", "joint_flexibility"])
def test_modes_are_followed_far_in_the_space_of_both_ends(tried, word):
    """As by full solutions at every step, wherever the word stands and though modes cross on the
    way."""
    bench, base, candidates = tried
    some = [c for c in candidates if c.physics == word and c.change is not None][::4]
    crossed = 0
    for c in some:
        residual = residual_of(c.change.model, bench.data, base.point.residual)
        start = np.append(np.zeros(len(base.point.p)), 0.9 * c.limits[1])
        point = None
        for size in np.geomspace(1e-4, 1.0, SIZES):
            point = residual.evaluate(size * start, point)
        short = residual.evaluate(start, _nearly(residual, residual.evaluate(start)))
        assert all(np.array_equal(a, b) for a, b in zip(short.places, point.places, strict=True)), (
            c.name
        )
        crossed += any(
            not np.array_equal(a, b)
            for a, b in zip(point.places, residual.start.places, strict=True)
        )
    assert crossed or word != "grounding_spring"


def test_chi_square_is_that_of_the_tables():
    from scipy.stats import chi2

    assert all(
        chi_square(level, n) == pytest.approx(chi2.ppf(level, n), rel=1e-12)
        for level in (0.95, 0.99)
        for n in (1, 2, 13, 400)
    )

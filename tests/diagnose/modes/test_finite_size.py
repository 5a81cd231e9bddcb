"""Many effects at a time at finite sizes give what the plain way gives, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import LinAlgError, eigh
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose.modes import finite_size
from cvxupdate.diagnose.modes.scene import scene
from cvxupdate.fe.modes import natural_modes


def scene_of(base):
    model, m = base.setting.model, base.point.matrices
    return scene(base.point, base.setting.scales, natural_modes(m.K, m.M, model.size))


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
        near = nearest(where, at, lam, basis @ V)
        ways = [(at, V[:, at]), (near, V[:, near])]
        ways += [] if where.shapes else [(where.used, V[:, where.used])]
        out.append(min(squares(where, lam[places], basis @ shapes) for places, shapes in ways))
    return out


def nearest(where, at, lam, shapes):
    """Which mode each measured one is nearest to, one by one."""
    told = sorted({u for u, _, _ in where.values})
    cost = np.zeros((len(where.used), len(lam)))
    for u, measured, w in where.values:
        cost[u] += (w * (measured - lam)) ** 2
    for u, rows, x, std in where.shapes:
        for mode in range(len(lam)):
            phi = shapes[rows, mode] / std
            q = phi @ (x / std) / max(phi @ phi, 1e-300)
            cost[u, mode] += np.sum((x / std - phi * q) ** 2)
    out = at.copy()
    out[told] = linear_sum_assignment(cost[told])[1]
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


def test_many_effects_at_a_time_are_followed_as_one_by_one(tried):
    _, base, candidates = tried
    where, local = scene_of(base), [c for c in candidates if finite_size.local(c)]
    assert {c.physics for c in local} == {"added_mass", "grounding_spring", "joint_flexibility"}
    assert any(c.change.series and c.physics == "grounding_spring" for c in local) and any(
        c.limits[0] < 0.0 for c in local
    )
    for c, (left, size) in zip(
        local, finite_size.best_sizes(where, local, finite_size.FULL), strict=True
    ):
        coarse = [
            left_one_by_one(where, c, sizes) for sizes in finite_size._sides(c, finite_size.SIZES)
        ]
        assert left <= min(min(side) for side in coarse) * (1.0 + 1e-6), c.name
        way = np.sign(size) * np.geomspace(1e-3, abs(size), 40)
        assert left == pytest.approx(left_one_by_one(where, c, way)[-1], rel=1e-5), c.name


def test_a_trace_ends_where_more_mass_is_taken_off_than_there_is(tried):
    _, base, candidates = tried
    where = scene_of(base)
    lump = next(c for c in candidates if c.physics == "added_mass")
    alone = finite_size._change(where, where.many.shapes.shape[1], [lump])
    q, most = alone.K.shape[1], 1.0 / np.linalg.eigvalsh(alone.M[0])[-1]
    sizes = -most * np.array([[0.5, 0.9, 1.1, 0.9]])
    found = finite_size._trace(where, alone, sizes, np.eye(q)[None], where.used[None]).left
    np.testing.assert_allclose(found[0, :2], left_one_by_one(where, lump, sizes[0])[:2], rtol=1e-6)
    assert len(left_one_by_one(where, lump, sizes[0])) == 2 and np.all(np.isinf(found[0, 2:])), (
        "not beyond, nor again from there"
    )


def test_of_very_many_the_best_of_each_kind_are_looked_at_closely(tried, monkeypatch):
    _, base, candidates = tried
    where = scene_of(base)
    plain, looked = finite_size.best_sizes, []

    def best_sizes(where, some, effort):
        looked.append((effort, some))
        return plain(where, some, effort)

    closely = finite_size.scan(where, candidates)
    monkeypatch.setattr(finite_size, "MANY", 5)
    monkeypatch.setattr(finite_size, "CLOSER", 6)
    monkeypatch.setattr(finite_size, "best_sizes", best_sizes)
    quickly = finite_size.scan(where, candidates)
    assert quickly.keys() == closely.keys() and quickly != closely
    (quick, all_), (full, some) = looked
    assert (quick, full) == (finite_size.QUICK, finite_size.FULL) and len(all_) == len(closely)
    for kind in {(candidates[k].physics, candidates[k].place.dof) for k in closely}:
        mine = [k for k in closely if (candidates[k].physics, candidates[k].place.dof) == kind]
        best = min(mine, key=lambda k: closely[k])
        # a line of a product of matrices depends on how many others there are, in its last digit
        assert quickly[best] == pytest.approx(closely[best], rel=1e-9)
        assert sum((e.physics, e.place.dof) == kind for e in some) == 6, kind

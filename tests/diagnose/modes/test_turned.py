"""Imaginary parts of shapes to first order in damping, against exact complex modes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import eig, eigh

from cvxupdate.diagnose.modes.complexity import by_chance
from cvxupdate.diagnose.modes.damping import damping_trials
from cvxupdate.diagnose.modes.ratios import Ratios
from cvxupdate.diagnose.modes.turned import turned_of
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.fe.modes import Modes
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.recordings.types import Channel, ModeTable, Origin

ZETA, C = 0.004, 0.5


@pytest.fixture
def model(chain):
    return with_nuisance(undamped(chain[1]))


def complex_modes_of(K, M, C):
    """(s, shapes) of positive frequency, ascending."""
    n = len(K)
    zero, one = np.zeros((n, n)), np.eye(n)
    s, v = eig(np.block([[zero, one], [-K, -C]]), np.block([[one, zero], [zero, M]]))
    keep = np.flatnonzero(s.imag > 0.0)
    keep = keep[np.argsort(s[keep].imag)]
    return s[keep], v[:n, keep]


@pytest.fixture
def seen(model, lab):
    return lambda c=C: measured(model, lab, c)


def measured(model, lab, c):
    """A point of the chain, and its table with a dashpot of c N·s/m between two masses; the
    candidates."""
    m = model.matrices(model.zero())
    context = SearchContext(model, m.K, m.M, 60.0, 8.0, (), (), lambda node, kind: model, ZETA)
    candidates = candidates_of(context, ("viscous_damper",))
    K, M = m.K.toarray(), m.M.toarray()
    lam, phi = eigh(K, M)
    modal = M @ phi @ np.diag(2 * ZETA * np.sqrt(lam)) @ phi.T @ M
    real = lab(c=(0, 0, c, 0)).C
    s, shapes = complex_modes_of(K, M, modal + real)
    n = len(s)
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(n)]
    table = ModeTable(
        origin=Origin("table", "table"),
        channels=tuple(Channel(i, "x", "displacement") for i in model.node_ids.tolist()),
        frequency=np.abs(s) / (2 * np.pi),
        frequency_std=np.full(n, 1e-3),
        damping=-s.real / np.abs(s),
        damping_std=np.full(n, 1e-5),
        shapes=(shapes / largest).T,
        shape_std=np.full((n, n), 1e-4),
        pairs=np.full(n, -1),
    )
    modes = Modes(lam, phi, 0)
    residual = SimpleNamespace(model=model)
    point = SimpleNamespace(modes=modes, residual=residual, matrices=m, places=[np.arange(n)])
    return point, table, candidates


def test_they_are_linear_in_the_dashpot(seen):
    point, table, candidates = seen()
    turned = turned_of(point, [table])
    (own,) = [c for c in candidates if c.place.nodes == (2, 3)]
    size = C / own.change.model.parameters[-1].unit_size
    assert not by_chance(20.0 * turned.off)
    np.testing.assert_allclose(
        size * turned.rate(own.change), turned.off, atol=0.02 * np.abs(turned.off).max()
    )


def test_they_tell_its_place(seen):
    """By themselves, and they make its size surer."""
    point, table, candidates = seen(20.0)
    turned = turned_of(point, [table])
    assert not by_chance(turned.off)
    omega = np.sqrt(point.modes.eigenvalues)
    ratios = Ratios(
        table.damping, table.damping_std, np.full(len(omega), ZETA), point.modes.shapes, omega
    )
    before, (best, *_) = damping_trials(ratios, candidates, turned)
    assert best.effect.place.nodes == (2, 3) and best.strain < 0.1 * before
    (alone, *_) = damping_trials(ratios, candidates)[1]
    assert best.deviation < alone.deviation
    off, left = turned.off, {}
    for c in candidates:
        x = turned.rate(c.change)
        left[c.place.nodes] = float(off @ off - max(off @ x, 0.0) ** 2 / (x @ x))
    assert min(left, key=left.__getitem__) == (2, 3)
    assert sorted(left.values())[1] > 2.0 * left[2, 3]


def test_real_shapes_and_crowded_modes_have_none(seen):
    point, table, _ = seen()
    assert turned_of(point, [replace(table, shapes=table.shapes.real)]) is None
    lossy = replace(table, damping=np.full(len(table.damping), 0.5))
    assert turned_of(point, [lossy]) is None

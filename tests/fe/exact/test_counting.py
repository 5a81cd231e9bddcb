"""Wittrick and Williams on random frames: against dense eigenvalues of a fine mesh, and repeated
frequencies counted."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from cvxupdate.fe.exact.modes import Counter
from cvxupdate.fe.modes import model_modes
from tests.cases.elements import SPACE, build, lines

MATERIAL = {"E": 207e9, "G": 79.6e9, "rho": 7850.0}


def frame(seed: int, kind: str, parts: int) -> dict[str, object]:
    """Three to five members between random points, every one in ``parts``, clamped at node 1 for
    even seeds; with shear for every third."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 6))
    sides = rng.uniform(0.3, 0.9, (count + 1, 3)) * rng.choice([-1, 1], (count + 1, 3))
    corners = np.cumsum(sides, 0)
    pairs = [(i, i + 1) for i in range(count)] + [(0, int(rng.integers(2, count)))]
    points, nodes = [tuple(c) for c in corners], []
    for a, b in pairs:
        inner = [corners[a] + (corners[b] - corners[a]) * k / parts for k in range(1, parts)]
        row = [a, *range(len(points), len(points) + len(inner)), b]
        points += [tuple(c) for c in inner]
        nodes += [(i + 1, j + 1) for i, j in pairwise(row)]
    width, height = rng.uniform(0.01, 0.05, 2)
    section = {"shape": "rectangle", "width": width, "height": height}
    section |= {"kappa": 0.85} if seed % 3 == 0 else {}
    model = lines(kind, points, nodes, SPACE, section, MATERIAL)
    if seed % 2 == 0:
        model["supports"] = [{"nodes": [1], "dofs": SPACE}]
    return model


@pytest.mark.parametrize("seed", range(20))
def test_none_missed(seed: int) -> None:
    """The first twelve of the whole frame; the mesh's are above them by no more than its error."""
    exact = model_modes(build(frame(seed, "exact_beam", 1)), 12)
    fine = model_modes(build(frame(seed, "beam3d", 16)), 12)
    assert exact.rigid == fine.rigid == (0 if seed % 2 == 0 else 6)
    ratio = fine.flexible().frequencies / exact.flexible().frequencies
    assert np.all(ratio > 1 - 1e-8)
    assert np.all(ratio < 1 + 2e-3)


def test_repeated_frequencies_are_counted() -> None:
    """A round cantilever bends alike in two planes: every bending mode twice, orthogonal."""
    model = lines("exact_beam", [(0, 0, 0), (1, 0, 0)], [(1, 2)], SPACE, "round", MATERIAL)
    model["supports"] = [{"nodes": [1], "dofs": SPACE}]
    built = build(model)
    modes = model_modes(built, 6)
    f = modes.frequencies
    assert np.allclose(f[0::2], f[1::2], rtol=1e-9)
    beta = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    A, I = np.pi * 0.02**2 / 4, np.pi * 0.02**4 / 64
    thin = beta**2 * np.sqrt(207e9 * I / (7850 * A)) / (2 * np.pi)
    assert np.allclose(f[0::2], thin, rtol=3e-3)  # rotary inertia takes the rest
    for i in (0, 2, 4):
        a, b = modes.shapes[:3, i], modes.shapes[:3, i + 1]
        assert abs(a @ b) < 1e-6 * np.linalg.norm(a) * np.linalg.norm(b)


def test_modes_that_move_no_node_are_counted() -> None:
    """A member held at both ends: all its frequencies are those between held nodes, with no shape
    on the nodes, in the closed form of a clamped beam."""
    model = lines(
        "exact_beam",
        [(0, 0, 0), (1, 0, 0), (2, 0, 0)],
        [(1, 2), (2, 3)],
        ["y", "rz"],
        {"shape": "rectangle", "width": 0.01, "height": 0.02},
        MATERIAL,
        rotary_inertia=False,
    )
    model["supports"] = [{"nodes": [1, 3], "dofs": ["y", "rz"]}]
    found = model_modes(build(model), 4)
    beta = np.array([4.7300407449, 7.8532046241, 10.9956078380, 14.1371654913]) / 2.0
    A, I = 2e-4, 0.02 * 0.01**3 / 12
    expected = beta**2 * np.sqrt(207e9 * I / (7850 * A)) / (2 * np.pi)
    # β₂ and β₄ of the pair are those of one member clamped: its middle node stands still in none
    assert np.allclose(found.frequencies, expected, rtol=1e-8)


def test_the_count_rises_by_one_at_each_mode() -> None:
    built = build(frame(3, "exact_beam", 1))
    modes = model_modes(built, 8)
    m = built.matrices()
    assert m.beyond is not None
    counter = Counter(m, m.beyond.undamped())
    for k, f in enumerate(modes.flexible().frequencies):
        w = 2 * np.pi * f
        assert counter.below(w * (1 - 1e-8)) == modes.rigid + k
        assert counter.below(w * (1 + 1e-8)) == modes.rigid + k + 1


def test_shapes_have_unit_modal_mass() -> None:
    """φᵀ (−∂Z/∂ω²) φ = 1, which is the mass of the whole shape between the nodes too: a fine mesh
    of the same frame has the same values at the corners."""
    corners = build(frame(2, "exact_beam", 1))
    fine = build(frame(2, "beam3d", 16))
    exact, mesh = model_modes(corners, 3), model_modes(fine, 3)
    at = [fine.place[label] for label in corners.labels]
    for k in range(3):
        a, b = exact.shapes[:, k], mesh.shapes[at, k]
        assert np.abs(np.abs(a) - np.abs(b)).max() < 2e-3 * np.abs(b).max()

"""The matrices of a model in a space are those of the model, projected; of a model that grew from
another one too, though only what is new is worked out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.block import Block
from cvxupdate.fe.model import KINDS
from cvxupdate.fe.synthesis.derivatives import Among, modal_blocks
from cvxupdate.fe.synthesis.projected import grown, projected
from cvxupdate.fe.synthesis.space import space_of
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.growth import append_parameters, limited
from tests.cases.fine_plate import Plate, real

TOP = 330.0
EFFECTS = ("thickness_change", "mass_change", "orthotropy", "added_mass", "attached_resonator",
           "grounding_spring", "structural_damping")  # fmt: skip


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """Of two groups of parameters, and elements that none moves."""
    model = real(tmp_path_factory.mktemp("plate"), Plate(), (2, 1))
    ids = [int(i) for b in model.blocks for i in b.ids]
    left = append_parameters(model, [limited("left", "stiffness", ids[:12], (-0.3, 0.3))])
    return append_parameters(left, [limited("right", "mass", ids[9:30], (-0.3, 0.3))])


def space(model, at=None):
    at = model.zero() if at is None else at
    return space_of(model, at, TOP, np.flatnonzero(model.dof_kind < 3), [])


def off(space, p):
    """Largest entry by which the matrices in the space are not those of the model."""
    m, found = space.model.matrices(p), space.matrices(p)
    true = {name: space.V.T @ (getattr(m, name) @ space.V) for name in "KMCD"}
    sizes = {name: max(np.abs(x).max(), 1e-300) for name, x in true.items()}
    return max(np.abs(found[k] - x).max() / sizes[k] for k, x in true.items())


def values(model, rng):
    lower, upper = (np.array([getattr(q, s) for q in model.parameters]) for s in ("lower", "upper"))
    return np.clip(rng.uniform(0.0, 0.2, len(model.parameters)), lower, upper)


def test_of_a_model_as_it_is(plate):
    rng = np.random.default_rng(1)
    assert off(space(plate), values(plate, rng)) < 1e-11


def effects_on(model):
    m = model.matrices(model.zero())
    sensors = tuple(x for x in model.labels if x.endswith(".z"))[:3]
    context = SearchContext(model, m.K, m.M, TOP, 20.0, sensors, (), lambda n, k: model, 0.01)
    found = candidates_of(context, EFFECTS)
    for name in EFFECTS:
        own = [e for e in found if e.physics == name]
        yield from (own[0], own[len(own) // 2], own[-1])


def test_of_a_model_with_an_effect(plate):
    """One element of a part, a part and what nothing moved, all elements, new ones, new DOFs."""
    rng, root = np.random.default_rng(2), space(plate)
    assert {KINDS[k] for k in plate.dof_kind if k < 6} == {"z", "rx", "ry"}
    seen = 0
    for effect in effects_on(plate):
        model = effect.action.plant(effect, plate, np.zeros(effect.count), 1.0).model
        new = root.grown(model, range(len(plate.parameters), len(model.parameters)))
        assert new is not None
        assert not new.projected.still  # grown, not made anew
        assert off(new, values(model, rng)) < 1e-11
        seen += 1
    assert seen == 3 * len(EFFECTS)


def test_derivatives_of_many_dofs_are_taken_in_the_space(plate):
    """What a parameter does among the modes is φᵀ ∂K φ of its element blocks, in a model that grew
    too: whole parts, parts without one element, one that an effect shares with them."""
    rng, root, seen = np.random.default_rng(3), space(plate), 0
    for effect in effects_on(plate):
        model = effect.action.plant(effect, plate, np.zeros(effect.count), 1.0).model
        new = root.grown(model, range(len(plate.parameters), len(model.parameters)))
        p = values(model, rng)
        found = new.modes(p)
        low = 12
        own = new.derivatives(p, found.X[:, :low])
        for some, blocks in zip(own, model.derivatives(p), strict=True):
            among = [x for x in some if isinstance(x, Among)]
            seen += len(among)
            if not among:
                assert len(some) == len(blocks)
                continue
            shapes = found.modes.shapes[:, :low]
            true = [modal_blocks(shapes, b) for b in blocks]
            for k in range(4):
                mine, theirs = (
                    sum((s[k] for s in parts if s[k] is not None), np.zeros((low, low)))
                    for parts in ([x.small for x in among], true)
                )
                np.testing.assert_allclose(mine, theirs, atol=1e-10 * max(np.abs(theirs).max(), 1))
    assert seen > len(EFFECTS)


def test_a_hypothesis_brings_little(plate):
    """Of the sums of the old model only the columns of new shapes."""
    root = space(plate)
    model = append_parameters(plate, [limited("t", "thickness", [5, 6, 15], (-0.5, 1.0))])
    new = root.grown(model, [2]).projected
    k = new.fixed["K"].shape[0] - root.V.shape[1]
    assert 0 < k < 0.5 * root.V.shape[1]
    assert new.sums.terms is root.projected.sums.terms
    assert new.sums.further.shape[2] == k


def test_other_elements_are_projected_anew(plate):
    base, V = projected(plate, space(plate).V), space(plate).V
    blocks = tuple(_thicker(b) for b in plate.blocks)
    assert grown(base, plate, replace(plate, blocks=blocks), V) is None
    assert grown(base, plate, replace(plate, blocks=plate.blocks[:0]), V) is None
    assert grown(base, plate, plate, V) is not None


def _thicker(block: Block) -> Block:
    more = {**block.properties, "thickness": 1.1 * block.properties["thickness"]}
    return replace(block, properties=more)

"""Edges of sheets that a model lets turn freely."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.supports import held_dofs
from cvxupdate.fe.build import build_model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.held_edges import HeldEdges
from cvxupdate.spec import load_problem
from tests.cases.elements import STEEL, grid, toml

X, Y = [0.0, 0.1, 0.22, 0.33, 0.45], [0.0, 0.12, 0.2, 0.31]
NEAR = [1 + 5 * j for j in range(4)]  # at x = 0
EVERY = sorted({*NEAR, *(n + 4 for n in NEAR), *range(1, 6), *range(16, 21)})


def sheet(supports: list[dict[str, object]]) -> str:
    return f"model = {toml({**grid(X, Y, material=STEEL), 'supports': supports})}\n"


def opened(folder, text: str):
    path = folder / "problem.toml"
    path.write_text(text + '[[recordings]]\nkind = "modes"\nrows = [{ frequency = 10.0 }]\n')
    spec = load_problem(path)
    return spec, undamped(build_model(spec)).with_parameters(())


def candidates(folder, supports):
    spec, model = opened(folder, sheet(supports))
    m, held = model.matrices(model.zero()), held_dofs(spec, model)
    released = tuple(h for h in held if f"n{h[0]}.{h[1]}" not in model.place)
    context = SearchContext(
        model, m.K, m.M, 900.0, 20.0, (), released, lambda node, kind: model, 0.01
    )
    return model, HeldEdges().candidates(context)


def test_every_straight_edge_on_supports_that_may_turn_about_itself(tmp_path) -> None:
    _, found = candidates(tmp_path, [{"nodes": EVERY, "dofs": ["z"]}])
    assert {(e.place.nodes, e.place.dof) for e in found} == {
        (tuple(NEAR), "ry"),
        (tuple(n + 4 for n in NEAR), "ry"),
        (tuple(range(1, 6)), "rx"),
        (tuple(range(16, 21)), "rx"),
    }
    _, clamped = candidates(tmp_path, [{"nodes": NEAR, "dofs": ["z", "rx", "ry"]}])
    assert clamped == []
    _, across = candidates(tmp_path, [{"nodes": NEAR, "dofs": ["z", "rx"]}])
    assert [e.place.dof for e in across] == ["ry"]


def test_each_node_has_the_part_of_the_edge_that_is_its_own(tmp_path) -> None:
    model, (effect,) = candidates(tmp_path, [{"nodes": NEAR, "dofs": ["z"]}])
    assert effect.change is not None
    grown, k = effect.change.model, 70.0
    q = grown.parameters[-1]
    assert effect.figures[0].value(grown, q, k / q.unit_size, 0.0)[0] == pytest.approx(k)
    more = grown.matrices(np.array([k / q.unit_size])).K - model.matrices(model.zero()).K
    at = [model.place[f"n{n}.ry"] for n in NEAR]
    lengths = np.array([0.06, 0.1, 0.095, 0.055])
    assert more.toarray()[at, at] == pytest.approx(k * lengths / lengths.mean())
    assert abs(more).sum() == pytest.approx(4.0 * k)

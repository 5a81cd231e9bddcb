"""Modes of exact members beside measured ones: derivatives, the same answer as a mesh, and an
updated model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.residual.modal import modal_residual
from cvxupdate.spec import Spec
from cvxupdate.update.modal import update_modal
from tests.cases.elements import SPACE, chain, lines
from tests.cases.structures import measured, structure

BENT = [(0.0, 0.0, 0.0), (0.5, 0.1, 0.2), (0.9, -0.3, 0.35), (1.4, 0.2, 0.1)]
SECTION = {"shape": "rectangle", "width": 0.011, "height": 0.03, "kappa": 0.85}
MATERIAL = {"E": 207e9, "G": 79.6e9, "rho": 7850.0}
CHANNELS = [f"n{n}.{k}" for n in (2, 3, 4) for k in "xyz"]
WANTED = [
    {"elements": [1], "of": "E"},
    {"elements": [2, 3], "of": "rho"},
    {"elements": [3], "of": "height"},
    {"elements": [2], "of": "width"},
    {"elements": [9], "of": "mass"},
]


def frame(free: bool = False, **tables: Any) -> tuple[Spec, Model]:
    """A bent bar of three exact members with a lump, clamped or not, and a loss that must not
    matter."""
    model = lines("exact_beam", BENT, chain(3), SPACE, SECTION, MATERIAL)
    model["elements"].append({"type": "mass", "rows": [{"id": 9, "nodes": [3], "m": 0.3}]})
    model["damping"] = {"kind": "structural", "eta": 0.05}
    if not free:
        model["supports"] = [{"nodes": [1], "dofs": SPACE}]
    return structure(model, WANTED, update={"method": "sensitivity"}, **tables)


@pytest.mark.parametrize("free", [False, True], ids=["clamped", "free"])
def test_derivatives_of_the_rows(free: bool) -> None:
    """Along a direction that moves every parameter, against central differences of frequencies and
    shapes, in every form of comparison."""
    _, model = frame(free)
    table = measured(model, np.zeros(5), range(1, 4), channels=CHANNELS, shape_std=0.02)
    residual = modal_residual(model, [table], [], True)
    p = np.array([0.05, -0.06, 0.03, 0.08, 0.1])
    way = np.array([1.0, -0.7, 0.9, 0.4, -1.3])
    point = residual.evaluate(p)
    up, down = (residual.evaluate(p + x * way, point) for x in (1e-4, -1e-4))
    for form in ("scale", "difference", "mac"):
        at, more, less = (
            replace(q, residual=replace(residual, form=form)) for q in (point, up, down)
        )
        own = at.system().A @ way
        there = (more.differences[0] - less.differences[0]) / 2e-4
        np.testing.assert_allclose(own[:3], there[:3], rtol=1e-6)
        np.testing.assert_allclose(own[3:], there[3:], atol=1e-5 * np.abs(there[3:]).max())


def test_run_finds_what_the_members_were_measured_with() -> None:
    """Frequencies and shapes of four modes, three members for some forty elements."""
    spec, model = frame()
    truth = np.array([0.12, -0.1, 0.08, -0.06, 0.2])
    table = measured(model, truth, range(1, 5), channels=CHANNELS, std=1e-4, shape_std=1e-3)
    found = update_modal(spec, model, [table])
    assert found.status == "converged" and found.certificate["optimal"]
    np.testing.assert_allclose([q.p for q in found.parameters], truth, atol=2e-3)
    np.testing.assert_allclose(
        model_modes(model, 4, np.array([q.p for q in found.parameters])).frequencies,
        table.frequency,
        rtol=3e-4,
    )


def test_a_mode_that_moves_no_node_cannot_be_fitted() -> None:
    """Between clamped ends: it is counted, and said."""
    corner = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.2, 0.0)]
    model = lines("exact_beam", corner, chain(2), SPACE, SECTION, MATERIAL)
    model["supports"] = [{"nodes": [1, 2], "dofs": SPACE}]
    _, made = structure(model, [{"elements": [1], "of": "E"}], update={"method": "frequencies"})
    still = measured(made, np.zeros(1), [1])
    with pytest.raises(ModelError, match="Put a node inside the members"):
        modal_residual(made, [still], [], False).evaluate(np.zeros(1)).system()

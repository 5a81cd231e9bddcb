"""Orthogonality checks of the command: perfect shapes pass them, mixed ones do not, and what needs
no model does not mind a wrong one."""

from typing import Any

import numpy as np
import pytest

from cvxupdate import Model, Modes, Problem
from cvxupdate.report.correlate_page import correlate_page
from cvxupdate.report.orthogonality_rows import orthogonality_rows, static_sentence
from cvxupdate.study import correlate

AT = [f"n{i}.x" for i in range(1, 5)]
HEAVY = [2.0, 1.4, 1.1, 0.9]
LINES = np.arange(4.0, 60.0, 0.05)
ZETA = np.array([0.01, 0.02, 0.015, 0.01])


def chain(stiff: float = 1.0) -> Model:
    springs: dict[str, Any] = {
        "type": "spring",
        "dof": "x",
        "nodes": [[1], [1, 2], [2, 3], [3, 4]],
        "k": [6.0e4 * stiff, 4.0e4, 5.2e4, 3.1e4],
    }
    masses: dict[str, Any] = {
        "type": "mass",
        "nodes": [[1], [2], [3], [4]],
        "m": [2, 1.4, 1.1, 0.9],
    }
    x = np.array([[float(i), 0.1 * i] for i in range(4)])
    return Model(x, [springs, masses], dofs=["x"], damping={"kind": "modal", "zeta": ZETA.tolist()})


def compared(model: Model, mixed: float = 0.0) -> Any:
    """Measured on `chain`: its modes, each with a part of the next, and its FRFs."""
    real = chain()
    modes = real.modes(4)
    shapes = np.asarray(modes.shapes) + mixed * np.roll(np.asarray(modes.shapes), -1, axis=1)
    shapes = shapes / np.abs(shapes).max(axis=0)
    frf = real.frf(LINES, AT, ["n2.x"], "acceleration")
    table = Modes(modes.frequencies, shapes, AT, damping=ZETA)
    return correlate(Problem(model, [frf, table]).spec)


@pytest.fixture(scope="module")
def perfect() -> Any:
    return compared(chain())


def test_perfect_shapes_pass_every_check(perfect: Any) -> None:
    (s,) = perfect.shapes
    rows = {r["name"]: r for r in orthogonality_rows(s)}
    assert len(rows) == 8
    assert {(r["least"], r["most"], r["good"]) for r in rows.values()} == {("1.00", "0.00", "yes")}
    assert s.correlation.static_difference == pytest.approx(np.zeros(4), abs=1e-7)
    # a loss factor of 2 ζ is not quite viscous damping: off by about ζ at a bandwidth's distance
    assert s.reciprocal.fit == pytest.approx(np.zeros(4), abs=float(ZETA.max()))
    page = correlate_page(perfect)
    assert "(2.9, first)" in page
    assert static_sentence(s) in page


def test_mixed_shapes_fail_with_and_without_the_model() -> None:
    (s,) = compared(chain(), 0.4).shapes
    rows = orthogonality_rows(s)
    failed = [r["name"] for r in rows if r["good"] == "no"]
    assert any("no model" in name for name in failed)
    assert any("(2.7)" in name for name in failed)
    improved = s.correlation.pseudo_checks.normalised_improved
    assert improved != pytest.approx(np.eye(4), abs=0.1)  # the model's shapes are not the measured


def test_reciprocal_vectors_do_not_mind_a_wrong_model() -> None:
    (s,) = compared(chain(2.5)).shapes
    assert s.reciprocal.orthogonality == pytest.approx(np.eye(4), abs=2e-3)
    off = s.correlation.cross_orthogonality
    assert float(np.max(off - np.diag(np.diag(off)))) > 0.1
    assert s.correlation.static_difference.max() > 0.1


def test_without_frfs_at_its_sensors_there_is_none() -> None:
    real = chain()
    modes = real.modes(3)
    table = Modes(modes.frequencies, np.asarray(modes.shapes), AT)
    few = real.frf(LINES, AT[:2], ["n2.x"], "acceleration")
    (s,) = correlate(Problem(chain(), [few, table]).spec).shapes
    assert s.reciprocal is None
    assert len(orthogonality_rows(s)) == 7

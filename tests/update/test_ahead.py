"""Going ahead by a small model: it says what the large one says where it was made, and the end of
a fit does not depend on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.convex import CompiledStep
from cvxupdate.errors import ModelError
from cvxupdate.fe.modes import model_modes
from cvxupdate.residual import modal_point
from cvxupdate.residual.modal_point import ModalPoint
from cvxupdate.residual.modal_reduced import reduced_modal
from cvxupdate.update.ahead import Ahead
from cvxupdate.update.modal_fit import ModalFit, modal_fit
from cvxupdate.update.trust_region import iterate, objective_at
from tests.cases.structures import PORTAL, measured, portal, structure

STIFF = tuple({"group": g, "of": "stiffness"} for g in ("column", "roof", "arm", "tie"))
SEEN = ("n2.x", "n3.y", "n4.x")
MANY = ("n2.x", "n2.y", "n3.x", "n3.y", "n4.x", "n4.y")  # more than there are parameters


def portal_fit(
    monkeypatch: pytest.MonkeyPatch,
    form: str,
    noise: int | None = None,
    channels: tuple[str, ...] = SEEN,
    modes: int = 4,
) -> ModalFit:
    """Four stiffnesses of the portal by its first modes, taken for large. (Two of them, where the
    vectors of more would span all of its 15 DOFs.)"""
    monkeypatch.setattr(modal_point, "DENSE", 2)
    spec, model = structure(
        portal(),
        STIFF,
        update={"method": "sensitivity", "shape_residual": form},
        constraints={"bounds": {"lower": -0.5, "upper": 0.5}},
    )
    truth = np.array([0.3, -0.25, 0.2, 0.3])
    table = measured(model, truth, range(1, modes + 1), channels=channels, noise=noise)
    return modal_fit(spec, model, [table])


def exactly(fit: ModalFit, p: np.ndarray) -> ModalPoint:
    """The point at ``p``, its modes to rounding."""
    found, r = fit.residual.evaluate(p), fit.residual
    return replace(found, modes=model_modes(r.model, r.count, p, found.matrices), solved=None)


def known(point: ModalPoint) -> list[np.ndarray]:
    return [point.modes.shapes[:, :5], *point.solutions]


@pytest.mark.parametrize("form", ["mac", "scale", "difference"])
def test_where_it_was_made_rows_and_derivatives_are_those_of_the_model(
    monkeypatch: pytest.MonkeyPatch, form: str
) -> None:
    fit = portal_fit(monkeypatch, form, modes=2)
    here = exactly(fit, np.array([0.05, -0.03, 0.08, 0.02]))
    small = reduced_modal(here, known(here), 1.0, np.ones(4))
    assert small is not None
    A, b = small.evaluate(here.p).system().weighted()
    exact, right = here.system().weighted()
    assert np.allclose(A, exact, rtol=1e-6, atol=1e-6 * np.abs(exact).max())
    assert np.allclose(b, right, rtol=1e-6, atol=1e-6 * np.abs(right).max())


def test_away_from_there_eigenvalues_err_with_the_fourth_power(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Shapes in a basis that holds their derivatives err with the square of the step, eigenvalues
    with the square of that."""
    fit = portal_fit(monkeypatch, "scale", channels=MANY, modes=2)
    here = exactly(fit, np.full(4, 0.05))
    small = reduced_modal(here, [here.modes.shapes[:, :2], *here.solutions], 1.0, np.ones(4))
    assert small is not None
    apart = []
    for t in (0.2, 0.1):
        p = here.p + t * np.array([0.3, 0.5, -0.4, 0.2])
        exact, found = exactly(fit, p), small.evaluate(p)
        apart.append(np.abs(found.values[:2] / exact.modes.eigenvalues[:2] - 1.0).max())
    assert apart[0] < 1e-3 and apart[1] < apart[0] / 12.0


def test_out_of_reach_it_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    here = portal_fit(monkeypatch, "mac").residual.evaluate(np.zeros(4))
    small = reduced_modal(here, known(here), 0.1, np.ones(4))
    assert small is not None
    with pytest.raises(ModelError, match="not trusted"):
        small.evaluate(np.full(4, 0.2))


def test_masses_that_move_have_no_small_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modal_point, "DENSE", 2)
    spec, model = structure(portal(), PORTAL[:4], update={"method": "sensitivity"})
    table = measured(model, model.zero(), range(1, 4), channels=SEEN)
    residual = modal_fit(spec, model, [table]).residual
    here = residual.evaluate(model.zero())
    assert not residual.reducible
    assert reduced_modal(here, known(here), 1.0, np.ones(4)) is None


@pytest.mark.parametrize("form", ["mac", "scale"])
def test_the_end_is_that_of_the_loop_alone(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    fit = portal_fit(monkeypatch, form, noise=5)
    start = np.array([-0.3, 0.3, -0.2, -0.3])
    alone = iterate(fit.residual, fit.problem, fit.choice, fit.options, start)
    led = replace(fit.options, ahead=Ahead(fit.options.radius))
    found = iterate(fit.residual, fit.problem, fit.choice, led, start)
    assert alone.status == found.status == "converged"
    values = [objective_at(fit.problem, x.point) for x in (alone, found)]
    assert values[1] == pytest.approx(values[0], rel=1e-5)
    assert np.allclose(found.point.p, alone.point.p, atol=1e-3)
    assert len(found.history) <= len(alone.history)


def test_broken_promises_shorten_its_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """A basis without derivatives promises too much; it is then trusted less far, and kept
    promises bring the trust back."""
    fit = portal_fit(monkeypatch, "mac")
    ahead = Ahead(0.4)
    ahead._judge(0.4, 1.0, 0.1)
    assert ahead.reach == pytest.approx(0.1)
    ahead._judge(0.1, 1.0, 0.9)
    assert ahead.reach == pytest.approx(0.2)
    here = fit.residual.evaluate(np.full(4, -0.2))
    compiled = CompiledStep(fit.problem, len(here.differences[0]), fit.choice)
    value = objective_at(fit.problem, here)
    trial = ahead.lead(fit.residual, compiled, here, value, np.full(4, 0.2), fit.options)
    assert trial.point is not None and trial.objective < value


def test_a_step_back_to_a_known_minimum_ends_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = portal_fit(monkeypatch, "scale", noise=5)
    end = iterate(fit.residual, fit.problem, fit.choice, fit.options, np.zeros(4))
    lowest = objective_at(fit.problem, end.point)
    back = replace(fit.options, known=tuple(end.point.p.tolist()), below=lowest * (1.0 - 1e-4))
    near = end.point.p + 0.02
    again = iterate(fit.residual, fit.problem, fit.choice, back, near)
    assert again.reason == "the step leads back to a minimum that is known"
    lower = replace(back, below=2.0 * lowest)  # as if the known one were not so low
    assert iterate(fit.residual, fit.problem, fit.choice, lower, near).reason != again.reason

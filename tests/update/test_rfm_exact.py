"""Updating with exact elements: derivatives of the residual, and a bent frame recovered from all
of its motion and from some of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.convex import Bounds, LeastSquares, SolverChoice, StepProblem
from cvxupdate.convex.regularisers.prior import Prior
from cvxupdate.errors import ProblemFileError
from cvxupdate.fe.model import Model
from cvxupdate.fe.responses import condense, matrices_with_damping
from cvxupdate.fe.select import select_parameters
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.residual import contraction
from cvxupdate.residual.contraction import HELD
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData, frf_data
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import LoopResult, Options
from tests.cases.elements import SPACE, build, chain, lines
from tests.cases.structures import structure
from tests.fe.test_derivatives import Wanted

BENT = [(0.0, 0.0, 0.0), (0.5, 0.1, 0.2), (0.9, -0.3, 0.35), (1.4, 0.2, 0.1)]
SECTION = {"shape": "rectangle", "width": 0.01, "height": 0.1, "kappa": 0.85}
MATERIAL = {"E": 207e9, "G": 79.6e9, "rho": 7850.0}
LINES = np.array([22.0, 50.0, 95.0, 140.0, 190.0, 228.0])


def text(kind: str = "exact_beam", **block: Any) -> dict[str, Any]:
    model = lines(kind, BENT, chain(3), SPACE, SECTION, MATERIAL, **block)
    model["damping"] = {"kind": "structural", "eta": 0.02}
    return model


def frame(words: tuple[str, ...]) -> Model:
    model = build(text())
    wanted = [Wanted(f"e{e}.{w}", w, (e,)) for w in words for e in (1, 2, 3)]
    return model.with_parameters(select_parameters(wanted, model, -0.5, 0.5))


def data_of(model: Model, p: np.ndarray, measured: list[str]) -> FrfData:
    at = np.array([model.place[label] for label in measured])
    H = frequency_responses(model, LINES, at, at[:1], p=p)

    def channel(label: str, quantity: Any) -> Channel:
        node, dof = label[1:].split(".")
        return Channel(int(node), dof, quantity)

    recording = FrequencyResponse(
        Origin("simulated", "simulated"),
        LINES,
        H,
        "displacement",
        tuple(channel(q, "displacement") for q in measured),
        (channel(measured[0], "force"),),
    )
    return frf_data(recording, model, 1e-3)


@pytest.mark.parametrize("kind", ["force-balance", "flexibility", "receptance"])
def test_derivatives_of_the_residual(kind: str) -> None:
    """Against central differences, with unmeasured motion taken out exactly at every line."""
    model = frame(("E", "rho", "width"))
    rng = np.random.default_rng(1)
    data = data_of(model, rng.uniform(-0.1, 0.1, 9), ["n1.z", "n3.y", "n4.x", "n4.z"])
    residual = FrfResidual(model, (data,), kind)
    p = rng.uniform(-0.05, 0.05, 9)
    J = residual.evaluate(p).jacobian
    for j in range(9):
        d = 1e-4 * np.eye(9)[j]
        a, b = (
            residual.evaluate(p + k * d).values - residual.evaluate(p - k * d).values
            for k in (1, 2)
        )
        central = (8 * a - b) / 12e-4
        assert np.abs(J[:, j] - central).max() < 1e-6 * np.abs(J[:, j]).max()


@pytest.mark.parametrize("held", [0, HELD])
def test_many_lines_together_are_those_of_each(held: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """∂Z of damped members of unlike geometry: contracted at all lines in one product, foreseen or
    not, as at each by itself."""
    monkeypatch.setattr(contraction, "HELD", held)
    model = frame(("E", "rho", "width"))
    d, omega = contraction.derivatives(model, model.zero()), 2 * np.pi * LINES
    assert any(part.exact is not None for part in d.parts)
    rng = np.random.default_rng(3)
    X = rng.normal(size=(model.size + 1, len(LINES), 4)) + 1j * rng.normal(
        size=(model.size + 1, len(LINES), 4)
    )
    X[-1] = 0.0
    got = d.over_lines(omega, X, np.array([0, 1, 3]), np.array([2, 1]))
    alone = [d.between(w, X[:-1, k, [0, 1, 3]], X[:-1, k, [2, 1]]) for k, w in enumerate(omega)]
    d.foresee(omega)
    kept = [d.between(w, X[:-1, k, [0, 1, 3]], X[:-1, k, [2, 1]]) for k, w in enumerate(omega)]
    for every, one, other in zip(got, alone, kept, strict=True):
        assert np.abs(every - one).max() < 1e-12 * np.abs(one).max()
        assert np.abs(other - one).max() < 1e-12 * np.abs(one).max()


def test_condensation_is_exact() -> None:
    """The structure seen from some of its DOFs: the inverse of its receptances there."""
    model = frame(("E",))
    at = np.array([model.place[label] for label in ("n1.z", "n4.x", "n4.ry")])
    m = matrices_with_damping(model)
    Z = condense(m, 95.0, at, at[:1]).Z
    H = frequency_responses(model, [95.0], at, at)[0]
    assert np.abs(Z @ H - np.eye(3)).max() < 1e-9


def loop_of(
    model: Model, data: FrfData, options: Options, prior: float | None = None
) -> LoopResult[FrfPoint]:
    n = len(model.parameters)
    problem = StepProblem(
        LeastSquares(),
        () if prior is None else (Prior(1.0, np.full(n, prior**2)),),
        (Bounds(np.full(n, -0.5), np.full(n, 0.5)),),
        tuple(q.name for q in model.parameters),
    )
    return fit_responses(model, (data,), problem, SolverChoice(), options)


@pytest.mark.parametrize(
    ("measured", "words"), [("all", ("E", "rho", "G")), ("translations", ("E", "rho"))]
)
def test_the_frame_is_found_again(measured: str, words: tuple[str, ...]) -> None:
    model = frame(words)
    truth = np.array([0.1, 0, -0.12, 0, -0.1, 0.08, 0.15, 0, -0.1])[: len(model.parameters)]
    labels = [label for label in model.labels if measured == "all" or ".r" not in label]
    labels.sort(key=lambda label: label != "n1.z")
    p = loop_of(model, data_of(model, truth, labels), Options(1e-9, 60, 0.1)).point.p
    assert np.abs(p - truth).max() < 1e-6


def test_wide_errors_with_second_order_terms() -> None:
    """8.7: larger errors are slower or diverge, and second-order terms are the way out: every E, G,
    rho and width up to 30 % wrong."""
    model = frame(("E", "G", "rho", "width"))
    truth = np.random.default_rng(2).uniform(-0.3, 0.3, 12)
    labels = sorted(model.labels, key=lambda label: label != "n1.z")
    data = data_of(model, truth, labels)
    plain, curved = (
        loop_of(model, data, Options(1e-9, 60, 0.3, second_order=second))
        for second in (False, True)
    )
    assert np.abs(curved.point.p - truth).max() < 1e-6
    assert len(curved.history) < len(plain.history)


def test_noise_with_what_is_probable_before() -> None:
    """5 % noise on translations: with a prior of 0.2 the loop converges, and every p is within four
    of its posterior deviations of the truth."""
    model = frame(("E", "G", "rho", "width"))
    rng = np.random.default_rng(4)
    truth = rng.uniform(-0.25, 0.25, 12)
    labels = sorted(
        (label for label in model.labels if ".r" not in label), key=lambda label: label != "n1.z"
    )
    data = data_of(model, truth, labels)
    error = 0.05 / np.sqrt(2) * np.abs(data.X)
    X = data.X + error * (rng.normal(size=error.shape) + 1j * rng.normal(size=error.shape))
    noisy = replace(data, X=X, std=np.maximum(50.0 * data.std, error))
    loop = loop_of(model, noisy, Options(1e-6, 40, 0.3, second_order=True), 0.2)
    assert loop.status == "converged"
    J, _ = loop.point.system().weighted()
    std = np.sqrt(np.diag(np.linalg.inv(J.T @ J + np.eye(12) / 0.2**2)))
    assert np.all(np.abs(loop.point.p - truth) < 4.0 * std)
    assert std[9:].max() < 0.05  # of the widths: told by the recordings, not by the prior


def test_what_needs_k_and_m_is_refused_in_words() -> None:
    wanted = [{"elements": "all", "of": "E"}]
    with pytest.raises(ProblemFileError, match='Take method = "rfm"'):
        structure(text(), wanted, update={"method": "ceam"})
    with pytest.raises(ProblemFileError, match='Take basis = "full"'):
        structure(text(), wanted, update={"method": "rfm", "basis": "reduced"})
    modes = {"damping": {"kind": "modal", "zeta": [0.01]}}
    with pytest.raises(ProblemFileError, match='Take kind = "structural" or "rayleigh"'):
        structure({**text(), **modes}, wanted, update={"method": "rfm"})

"""What the studies of chapters 3 to 5 share: the bay structure, its data with noise, and one
fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cvxupdate.convex import Bounds, LeastSquares, SolverChoice, StepProblem
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.residual.frf_data import frf_data
from cvxupdate.study import open_problem
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Options
from validation import make_rfm

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
bay = make_rfm.bay
CORNER = ("n1.x", "n1.y", "n1.z")
NINETEEN = ("n1.x", "n1.y", *(f"n{i}.z" for i in range(1, 20)))
WRONG = np.array([i - 1 for i in bay.STIFF])
SOUND = np.setdiff1d(np.arange(20), WRONG)
TRUTH = np.zeros(40)
TRUTH[WRONG] = 1 / 1.08 - 1


def fe1():
    """Model FE1 with its 40 p-values (20 of stiffness, then 20 of mass)."""
    return open_problem(PROBLEMS / "bay/fe1_x1_complete" / "problem.toml")[1]


def data_of(model, frequency, H, responses, references, noise=None):
    """Receptances as the method takes them; ``noise`` the relative standard deviation."""

    def channel(label, quantity):
        node, dof = label[1:].split(".")
        return Channel(int(node), dof, quantity)

    recording = FrequencyResponse(
        Origin("simulated", "simulated"),
        np.asarray(frequency, dtype=float),
        H,
        "displacement",
        tuple(channel(q, "displacement") for q in responses),
        tuple(channel(q, "force") for q in references),
    )
    return frf_data(recording, model, noise)


def step(model, regularisers=(), bound=0.5, loss=None):
    """Least squares with bounds on every p."""
    n = len(model.parameters)
    return StepProblem(
        loss or LeastSquares(),
        tuple(regularisers),
        (Bounds(np.full(n, -bound), np.full(n, bound)),),
        tuple(q.name for q in model.parameters),
    )


def fit(model, data, regularisers=(), kind="auto", radius=0.1, tolerance=1e-6, iterations=60):
    """The loop's result."""
    return fit_responses(
        model,
        (data,),
        step(model, regularisers),
        SolverChoice(),
        Options(tolerance, iterations, radius),
        kind,
    )


def error(p):
    """‖p − p_true‖ / ‖p_true‖."""
    return float(np.linalg.norm(p - TRUTH) / np.linalg.norm(TRUTH))


def ranked(p):
    """Whether the ten wrong elements stand above the ten sound ones by the size of their stiffness
    p."""
    return bool(np.abs(p[WRONG]).min() > np.abs(p[SOUND]).max())

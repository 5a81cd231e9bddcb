"""Residuals on frequency responses: derivatives by differences, linearity where it must be, noise
weights, points, accuracy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.convex import Bounds, LeastSquares, SolverChoice, StepProblem
from cvxupdate.errors import InputError, ModelError, RecordingError
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.fe.synthesis import DirectLines, receptance
from cvxupdate.fe.synthesis.direct import ordered
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.residual.contraction import constant, derivatives
from cvxupdate.residual.frf import KINDS, FrfResidual
from cvxupdate.residual.frf_accuracy import accuracy
from cvxupdate.residual.frf_data import frf_data
from cvxupdate.residual.frf_points import choose_points, most_informative, resonances, sensitivities
from cvxupdate.residual.frf_reduced import ReducedResidual, make_basis
from cvxupdate.study import open_problem
from cvxupdate.update.rfm_loop import fit_reduced
from cvxupdate.update.trust_region import Options
from validation import make_rfm

ROOT = Path(__file__).resolve().parents[2]
bay = make_rfm.bay
# Modes need more sensors than these structures have, and what is filled in is the model's own: both
# in tests/update/test_rfm_equation_error.py
EXACT = [k for k in KINDS if k not in ("modal-balance", "filled")]
SENSORS = tuple(f"n{i}.z" for i in (1, 8, 23, 31, 44, 60))


def channel(label, quantity):
    node, dof = label[1:].split(".")
    return Channel(int(node), dof, quantity)


def recording(frequency, H, responses, references, quantity="displacement", **more):
    return FrequencyResponse(
        Origin("test", "test.npz"),
        np.asarray(frequency, dtype=float),
        H,
        quantity,
        tuple(channel(q, quantity) for q in responses),
        tuple(channel(q, "force") for q in references),
        **more,
    )


@pytest.fixture(scope="module")
def plate():
    """A damped plate with 135 parameters of stiffness, mass and damping, and receptances of the
    true one at six sensors, two forces (one unmeasured)."""
    model = open_problem(ROOT / "problems" / "plate_complex/0pct" / "problem.toml")[1]
    real = make_rfm.build(make_rfm.plate_toml(False))
    f = [13.0, 41.0, 77.0]
    return model, recording(
        f, bay.receptance(real, f, SENSORS, ("n1.z", "n17.z")), SENSORS, ("n1.z", "n17.z")
    )


@pytest.fixture(scope="module")
def frame():
    model = open_problem(ROOT / "problems" / "bay/fe1_x1_complete" / "problem.toml")[1]
    return model, bay.build("X1")


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "modal-balance"])
def test_derivatives_of_every_kind_of_parameter(plate, kind):
    model, frf = plate
    residual = FrfResidual(model, (frf_data(frf, model),), kind)
    p = np.random.default_rng(0).uniform(-0.05, 0.05, 135)
    point = residual.evaluate(p)
    h = 2e-4
    for j in (3, 20, 47, 70, 95, 130):
        e = np.zeros(135)
        e[j] = h
        numerical = (residual.evaluate(p + e).values - residual.evaluate(p - e).values) / (2 * h)
        assert numerical == pytest.approx(
            point.jacobian[:, j], abs=1e-4 * np.abs(point.jacobian[:, j]).max()
        )


@pytest.mark.parametrize("kind", EXACT)
def test_truth_is_a_root_and_the_system_holds_there(plate, kind):
    model, frf = plate
    residual = FrfResidual(model, (frf_data(frf, model),), kind)
    truth = np.zeros(135)
    for k, of in enumerate(("stiffness", "mass", "damping")):
        truth[[45 * k + i - 1 for i in make_rfm.PLATE_HIGH[of]]] = 1 / 1.1 - 1
    point = residual.evaluate(truth)
    start = np.abs(residual.evaluate(model.zero()).values * residual.weights).max()
    assert np.abs(point.values * residual.weights).max() < 1e-6 * start
    system = point.system()
    assert system.residual(truth) == pytest.approx(point.values * residual.weights, abs=1e-6)
    assert len(system.rows) == len(set(system.rows)) == 3 * 6 * 2 * 2


def test_contraction_is_the_full_matrix_product(plate):
    model, _ = plate
    p = np.linspace(-0.1, 0.1, 135)
    d = derivatives(model, p)
    rng = np.random.default_rng(1)
    left, right = (
        rng.standard_normal((model.size, k)) + 1j * rng.standard_normal((model.size, k))
        for k in (3, 2)
    )
    got = d.between(50.0, left, right)
    for j in (0, 60, 120):
        Z = np.zeros((model.size, model.size), dtype=complex)
        for b in model.derivative(j, p):
            for e, dofs in enumerate(b.dofs):
                full = sum(
                    f * m[e]
                    for f, m in ((1, b.K), (1j, b.D), (50j, b.C), (-2500, b.M))
                    if m is not None
                )
                Z[np.ix_(dofs, dofs)] += full
        assert got[:, :, j] == pytest.approx(left.T @ Z @ right, rel=1e-9)


def test_contraction_of_many_lines_is_that_of_each(plate, frame):
    """Stiffness, mass and damping; an element a parameter, and parameters of many elements (summed
    another way)."""
    rng = np.random.default_rng(2)
    model = plate[0]
    patches = [
        replace(
            q,
            targets=(
                replace(
                    q.targets[0],
                    rows=np.arange(k, 45, 4),
                    scales=np.ones((1, len(range(k, 45, 4)))),
                ),
            ),
        )
        for k, q in (
            (0, model.parameters[0]),
            (1, model.parameters[1]),
            (2, model.parameters[50]),
            (3, model.parameters[100]),
        )
    ]
    for some in (model, replace(model, parameters=tuple(patches)), frame[0]):
        d = derivatives(some, some.zero())
        omega = np.array([20.0, 150.0, 900.0])
        X = rng.standard_normal((some.size + 1, 3, 5)) + 1j * rng.standard_normal(
            (some.size + 1, 3, 5)
        )
        X[-1] = 0.0
        got = d.over_lines(omega, X, np.array([0, 1, 4]), np.array([2, 1]))
        assert got.shape == (3, 3, 2, d.count)
        for k, w in enumerate(omega):
            one = d.between(w, X[:-1, k, [0, 1, 4]], X[:-1, k, [2, 1]])
            assert got[k] == pytest.approx(one, abs=1e-11 * np.abs(one).max())


def test_derivatives_of_p_values_do_not_depend_on_p(plate, frame):
    for model in (plate[0], frame[0]):
        assert constant(model)
        here, there = (
            derivatives(model, p)
            for p in (model.zero(), np.linspace(-0.3, 0.4, len(model.parameters)))
        )
        for a, b in zip(here.parts, there.parts, strict=True):
            for name in "KMCD":
                x, y = getattr(a, name), getattr(b, name)
                assert (x is None) == (y is None) and (
                    x is None or y == pytest.approx(x, rel=1e-12, abs=1e-12 * np.abs(x).max())
                )
    assert not constant(open_problem(ROOT / "problems" / "bay/fe2_x1" / "problem.toml")[1])


def test_lines_in_one_order_are_the_receptances(plate, frame, monkeypatch):
    """A fill-reducing order found once, few lines held at a time, and matrices whose patterns
    differ: all the same numbers."""
    for model, f in (
        (plate[0], np.array([13.0, 40.0, 77.0])),
        (frame[0], np.array([30.0, 75.0, 160.0])),
    ):
        places = np.array([3, 10, 40])
        m = matrices_with_damping(model)
        wanted = receptance(model, f, np.arange(model.size), places)
        s = 2j * np.pi * f
        X = DirectLines(m, places).at(s)
        assert X.shape == (model.size + 1, 3, 3) and not np.any(X[-1])
        assert X[:-1].transpose(1, 0, 2) == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())
        other = Matrices(m.K, m.M, sp.csc_array(m.C.shape), sp.csc_array(np.diag(m.D.diagonal())))
        assert ordered(other, np.arange(model.size)) is None
        assert DirectLines(other, places).at(s)[:, 0] == pytest.approx(
            DirectLines(other, places).at(s[:1])[:, 0]
        )
    residual = FrfResidual(plate[0], (frf_data(plate[1], plate[0]),), "receptance")
    together = residual.evaluate(plate[0].zero())
    monkeypatch.setattr("cvxupdate.fe.synthesis.direct.HELD", 1)
    alone = residual.evaluate(plate[0].zero())
    assert alone.values == pytest.approx(
        together.values, rel=1e-9, abs=1e-12 * np.abs(together.values).max()
    )
    assert alone.jacobian == pytest.approx(
        together.jacobian, abs=1e-9 * np.abs(together.jacobian).max()
    )


def test_output_error_says_which_line_is_singular(plate):
    """A free plate at 0 Hz, or an undamped one at its own frequency, has no response."""
    m = plate[0].matrices()
    with pytest.raises(ModelError, match="the dynamic stiffness at 0 Hz is singular"):
        DirectLines(Matrices(m.K, m.M, 0.0 * m.C, 0.0 * m.D), np.array([0])).at(
            2j * np.pi * np.array([30.0, 0.0])
        )


def test_complete_coordinates_are_linear_everywhere(frame):
    """(3.9): with every DOF measured and the weights held, A p − b is exact at any p, and one
    least-squares solution is the truth."""
    model, real = frame
    f = [30.0, 120.0, 240.0, 330.0]
    data = frf_data(
        recording(
            f, bay.receptance(real, f, real.labels, ("n1.z", "n1.x")), real.labels, ("n1.z", "n1.x")
        ),
        model,
    )
    for kind in ("force-balance", "flexibility"):
        residual = FrfResidual(model, (data,), kind)
        system = residual.evaluate(model.zero()).system()
        p = np.random.default_rng(2).uniform(-0.3, 0.3, 40)
        there = residual.evaluate(p)
        assert system.residual(p) == pytest.approx(
            there.values * residual.weights,
            abs=1e-7 * np.abs(there.values * residual.weights).max(),
        )
        A, b = system.weighted()
        truth = np.zeros(40)
        truth[[i - 1 for i in bay.STIFF]] = 1 / 1.08 - 1
        assert np.linalg.lstsq(A, b, rcond=None)[0] == pytest.approx(truth, abs=1e-8)


def test_flexibility_weights_make_the_output_error(frame):
    """(3.35): at the parameters of its weights the weighted force balance equals the receptance
    difference."""
    model, real = frame
    f = [30.0, 75.0]
    data = frf_data(
        recording(f, bay.receptance(real, f, bay.TEN, ("n1.z",)), bay.TEN, ("n1.z",)), model
    )
    p = np.linspace(-0.1, 0.1, 40)
    weighted = FrfResidual(model, (data,), "flexibility", p).evaluate(p)
    output = FrfResidual(model, (data,), "receptance").evaluate(p)
    assert weighted.values == pytest.approx(
        output.values, rel=1e-6, abs=1e-9 * np.abs(output.values).max()
    )


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "modal-balance"])
def test_rows_at_the_truth_have_unit_variance(frame, kind):
    """The noise of H_X is carried into the rows: chi-squared per row is 1 for the true parameters,
    to its own scatter."""
    model, real = frame
    truth = np.zeros(40)
    truth[[i - 1 for i in bay.STIFF]] = 1 / 1.08 - 1
    f = [30.0, 75.0, 117.0, 145.0]
    exact = bay.receptance(real, f, bay.TEN, ("n1.x", "n1.z"))
    total, count = 0.0, 0
    rng = np.random.default_rng(3)
    for _ in range(15):
        clean = frf_data(recording(f, exact, bay.TEN, ("n1.x", "n1.z")), model, 1e-3)
        noisy = exact + clean.std * rng.standard_normal(exact.shape)
        noisy[:, ~clean.used] = 0.0
        data = frf_data(recording(f, noisy, bay.TEN, ("n1.x", "n1.z")), model, 1e-3)
        residual = FrfResidual(model, (data,), kind, truth)
        total += float(np.sum((residual.evaluate(truth).values * residual.weights) ** 2))
        count += len(residual.weights)
    assert total / count == pytest.approx(1.0, abs=5 * np.sqrt(2 / count) + 0.05)


def test_quantities_are_brought_to_receptance(plate):
    model, frf = plate
    w = 2j * np.pi * frf.frequency[:, None, None]
    for quantity, power in (("velocity", 1), ("acceleration", 2)):
        other = recording(frf.frequency, frf.H * w**power, SENSORS, ("n1.z", "n17.z"), quantity)
        assert pytest.approx(frf.H, rel=1e-12) == frf_data(other, model).X
    variance = np.full(frf.H.shape, 1e-20)
    stated = frf_data(
        recording(
            frf.frequency,
            frf.H * w**2,
            SENSORS,
            ("n1.z", "n17.z"),
            "acceleration",
            variance=variance * np.abs(w) ** 4,
        ),
        model,
    )
    assert not stated.relative_only and stated.std.min() >= 1e-10 * (1 - 1e-12)


def test_decoupled_functions_do_not_count(frame):
    model, real = frame
    f = [30.0, 75.0]
    data = frf_data(
        recording(f, bay.receptance(real, f, bay.TEN, ("n1.x", "n1.z")), bay.TEN, ("n1.x", "n1.z")),
        model,
    )
    assert data.used.sum() == 2 + 8  # in-plane motion under x, out-of-plane under z
    assert len(FrfResidual(model, (data,), "receptance").weights) == 2 * 10


def test_messages(plate):
    model, frf = plate
    with pytest.raises(InputError, match="displacement, velocity or acceleration"):
        frf_data(recording(frf.frequency, frf.H, SENSORS, ("n1.z", "n17.z"), "strain"), model)
    lost = recording(frf.frequency, frf.H[:, :1], ("n99.z",), ("n1.z", "n17.z"))
    with pytest.raises(RecordingError, match="node 99"):
        frf_data(lost, model)
    with pytest.raises(InputError, match="there is no line near 500 Hz"):
        choose_points(model, frf_data(frf, model), (13.0, 500.0), None)


# ── points
# ──────────────────────────────────────────────────────────────────────────────────────────────────


@pytest.fixture(scope="module")
def fine(frame):
    model, real = frame
    f = np.arange(10.0, 400.5, 1.0)
    return model, frf_data(
        recording(
            f,
            bay.noisy(bay.receptance(real, f, bay.TEN, ("n1.x", "n1.z")), 0.005, 1),
            bay.TEN,
            ("n1.x", "n1.z"),
        ),
        model,
        0.003,
    )


def test_resonances_are_the_peaks(fine):
    _, data = fine
    found = resonances(data)
    for f in (42.2, 50.8, 102.2, 133.4, 155.3, 218.0, 265.8, 289.3):
        assert np.min(np.abs(found - f)) <= 1.0


@pytest.mark.parametrize("rule", ["between", "best", "log-function"])
def test_points_stay_away_from_resonances_and_gaps(fine, rule):
    model, data = fine
    points = choose_points(model, data, rule, 20)
    f = data.frequency[points.lines]
    warned = any("Choose more points" in w for w in points.warnings)
    assert len(f) == 20 and np.isfinite(points.ratio)
    # the log function does not care for what a line adds, and is warned of one mode too few
    assert warned == (points.rank < points.modes) == (rule == "log-function")
    for real, own in ((133.4, 136.1), (217.98, 223.1), (265.8, 269.9)):
        assert not np.any((f > real - 1) & (f < own + 1)), rule
    for bad in np.concatenate([points.model, points.held]):
        assert np.all(np.abs(f - bad) > 0.015 * bad)


def test_between_visits_every_interval(fine):
    model, data = fine
    f = data.frequency[choose_points(model, data, "between", 12).lines]
    # between 42/51 nothing is allowed (1.5 % and the gap to 43/52); the wide ones all have a line
    for low, high in (
        (53.0, 100.0),
        (106.0, 131.0),
        (161.0, 214.0),
        (227.0, 262.0),
        (274.0, 287.0),
        (320.0, 352.0),
    ):
        assert np.any((f > low) & (f < high)), (low, high)


def test_few_points_are_reported(fine):
    model, data = fine
    few = choose_points(model, data, (60.0, 350.0), None)
    assert any("rank" in w and "Choose more points" in w for w in few.warnings)


def test_the_rank_is_compared_with_the_modes_of_the_whole_recording(fine):
    """Not with those between the chosen lines (3.48): few lines side by side know little."""
    model, data = fine
    near = choose_points(model, data, (60.0, 61.0, 62.0), None)
    assert near.modes == len(near.measured) > 3
    assert near.rank < near.modes and any("Choose more points" in w for w in near.warnings)


def test_informative_lines_beat_every_exchange_of_one(fine):
    """Greedy A-optimal: the trace of the covariance rises for nearly every single exchange, and
    random sets are worse."""
    model, data = fine
    J = sensitivities(model, data)
    allowed = np.ones(len(J), dtype=bool)
    chosen = most_informative(J, allowed, 6)

    def spread(lines):
        A = J[lines].reshape(-1, J.shape[2])
        return np.trace(np.linalg.inv(np.eye(J.shape[2]) / 0.05**2 + A.T @ A))

    rng = np.random.default_rng(0)
    best = spread(chosen)
    assert all(spread(rng.choice(len(J), 6, replace=False)) > best for _ in range(50))
    other = chosen.copy()
    worse = 0
    for k in range(6):
        for line in rng.choice(len(J), 10, replace=False):
            other[:] = chosen
            other[k] = line
            worse += spread(other) > best
    assert worse >= 55


# ── accuracy (chapter 5)
# ─────────────────────────────────────────────────────────────────────────────────────────


def test_accuracy_is_its_definition(frame):
    model, real = frame
    at = np.array([model.place[q] for q in bay.TEN])
    truth = np.zeros(40)
    truth[[i - 1 for i in bay.STIFF]] = 1 / 1.08 - 1
    f = np.array([30.0, 75.0])
    a = accuracy(model, f, at, 1e-3, truth, rounds=40)
    for k, x in enumerate(f):
        HX, HA = (bay.receptance(m, [x], bay.TEN, bay.TEN)[0].real for m in (real, model))
        ZX, ZA = np.linalg.inv(HX), np.linalg.inv(HA)
        delta = np.linalg.norm(ZX - ZA)
        assert a.system[k] == pytest.approx(np.log10(delta / np.linalg.norm(ZX) ** 2), abs=1e-5)
        assert a.error[k] == pytest.approx(np.log10(1e-3 * np.linalg.norm(HX)), abs=1e-6)
        assert a.relative_model[k] == pytest.approx(delta / np.linalg.norm(ZX), rel=1e-4)
    # (5.32) is linear in the noise: it is 0 at the bearable noise, and the radius scales with it
    again = accuracy(model, f[:1], at, float(a.bearable[0]), truth, rounds=40)
    assert again.log_function[0] == pytest.approx(0.0, abs=1e-9)
    assert again.radius[0] / a.radius[0] == pytest.approx(a.bearable[0] / 1e-3, rel=1e-9)


def test_expected_change_is_the_mean_square_over_draws(frame):
    model, _ = frame
    at = np.array([model.place[q] for q in bay.TEN])
    f = np.array([60.0])
    guess = accuracy(model, f, at, 1e-3, 1e-3, rounds=0)
    rng = np.random.default_rng(0)
    drawn = [
        accuracy(model, f, at, 1e-3, 1e-3 * rng.standard_normal(40), rounds=0) for _ in range(60)
    ]
    mean = np.sqrt(np.mean([10 ** (2 * d.system[0]) for d in drawn]))
    assert 10 ** guess.system[0] == pytest.approx(mean, rel=0.3)


# ── reduced basis
# ────────────────────────────────────────────────────────────────────────────────────────────────


def test_reduced_basis_agrees_with_the_full_model(plate):
    """Rows and derivatives of a damped model, at the basis's parameters and a little away."""
    model, frf = plate
    full = FrfResidual(model, (frf_data(frf, model),), "receptance")
    at = np.array([model.place[q] for q in (*SENSORS, "n17.z")])
    basis = make_basis(model, model.zero(), 77.0, at, (12.0, 45.0, 80.0))
    assert basis.V.shape[1] < 45 < model.size
    reduced = ReducedResidual(full, basis)
    for size, close in ((0.0, 1e-4), (1e-4, 1e-3)):
        p = size * np.random.default_rng(0).standard_normal(135)
        a, b = full.evaluate(p), reduced.evaluate(p)
        assert b.values == pytest.approx(a.values, abs=close * np.abs(a.values).max())
        assert b.jacobian == pytest.approx(a.jacobian, abs=10 * close * np.abs(a.jacobian).max())
    assert reduced.evaluate(model.zero()).system().rows == full.evaluate(model.zero()).system().rows


def test_loop_on_a_reduced_basis_reaches_the_full_answer(frame):
    model, real = frame
    f = [20.0, 30, 43.5, 66, 75, 90, 117, 124, 145, 160]
    three = ("n1.x", "n1.y", "n1.z")
    data = frf_data(recording(f, bay.receptance(real, f, bay.TEN, three), bay.TEN, three), model)
    problem = StepProblem(
        LeastSquares(),
        (),
        (Bounds(np.full(40, -0.5), np.full(40, 0.5)),),
        tuple(q.name for q in model.parameters),
    )
    loop = fit_reduced(model, (data,), problem, SolverChoice(), Options(1e-8, 60, 0.1))
    truth = np.zeros(40)
    truth[[i - 1 for i in bay.STIFF]] = 1 / 1.08 - 1
    assert loop.status == "converged" and loop.point.p == pytest.approx(truth, abs=1e-6)


def test_a_full_damping_matrix_is_no_factorisation_for_every_line(monkeypatch):
    """Modal damping fills C. The output error of a model with many DOFs then comes from one basis:
    the same rows and derivatives as by direct solution, which is what finer parts under elements
    would wait minutes for."""
    import cvxupdate.residual.frf_output as output
    from cvxupdate.api.problem import Problem
    from cvxupdate.fe.build import build_model

    n = 340
    tables = {
        "dofs": ["x"],
        "nodes": [{"id": i, "x": float(i)} for i in range(n + 1)],
        "elements": [
            {
                "type": "spring",
                "dof": "x",
                "rows": [
                    {"id": i, "nodes": [i - 1, i], "k": 4e8 * (1.0 + 0.3 * np.sin(i))}
                    for i in range(1, n + 1)
                ],
            },
            {
                "type": "mass",
                "rows": [{"id": n + i, "nodes": [i], "m": 1.0 + (i % 3)} for i in range(1, n + 1)],
            },
        ],
        "supports": [{"nodes": [0], "dofs": ["x"]}],
        "damping": {"kind": "modal", "zeta": [0.01, 0.02, 0.015]},
    }
    rows = [{"elements": [n + 50], "of": "m"}, {"elements": [7], "of": "stiffness"}]
    update = {"method": "rfm", "parameters": rows}
    model = build_model(Problem(tables, update=update).spec)
    f = np.linspace(1.0, 60.0, 40)
    data = frf_data(
        recording(f, np.ones((40, 2, 1), dtype=complex), ("n60.x", "n200.x"), ("n90.x",)), model
    )
    d, p = derivatives(model, model.zero()), model.zero()
    whole = list(output.output_rows(matrices_with_damping(model, p), d, data))
    values, changes = (np.concatenate(x) for x in zip(*whole, strict=True))

    def never(*arguments):
        raise AssertionError("a factorisation of a full matrix for each line")

    monkeypatch.setattr(output, "output_rows", never)
    point = FrfResidual(model, (data,), "receptance").evaluate(p)
    half = len(point.values) // 2
    mine = point.values[:half] + 1j * point.values[half:]
    columns = point.jacobian[:half] + 1j * point.jacobian[half:]
    H = values.reshape(-1) + data.X.reshape(-1)
    assert np.linalg.norm(mine - values.reshape(-1)) < 1e-5 * np.linalg.norm(H)
    exact = changes.reshape(-1, 2)
    assert np.all(np.linalg.norm(columns - exact, axis=0) < 1e-4 * np.linalg.norm(exact, axis=0))

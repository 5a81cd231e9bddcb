"""The loop on modal data: parameters come back, clauses hold, hold-outs stay out, pairs are
reconsidered."""

import itertools
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import Spec
from cvxupdate.update.modal import update_modal
from cvxupdate.update.result import Updated
from tests.cases.structures import (
    PORTAL,
    TRUTH,
    crossing,
    free_chain,
    measured,
    portal,
    square,
    structure,
)

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")
BOUNDS = {"bounds": {"lower": -0.5, "upper": 0.5}}
SEEN = PORTAL[:6]  # without the dashpot, which no undamped mode sees


def portal_problem(parameters: Any = SEEN, **tables: Any) -> tuple[Spec, Model]:
    return structure(portal(), parameters, **{"constraints": BOUNDS, **tables})


def values(updated: Updated) -> np.ndarray:
    return np.array([q.p for q in updated.parameters])


def consistent(updated: Updated) -> None:
    """What every result keeps, whatever the problem: a history that falls, strict JSON, a stated
    reason."""
    objectives = [h["objective"] for h in updated.history]
    assert all(b <= a for a, b in itertools.pairwise(objectives))
    assert all(h["ratio"] is None or np.isfinite(h["ratio"]) for h in updated.history)
    assert updated.reason and updated.status in ("converged", "stopped", "infeasible")
    assert [h["number"] for h in updated.history] == list(range(1, len(updated.history) + 1))
    if updated.history:
        assert np.allclose(updated.history[-1]["p"], values(updated), atol=1e-14)
        assert updated.fit["fit"]["objective"]["after"] == pytest.approx(
            objectives[-1], rel=1e-6, abs=1e-12
        )
    json.dumps(
        {
            "parameters": [q.__dict__ for q in updated.parameters],
            "history": updated.history,
            "undetermined": updated.undetermined,
        },
        allow_nan=False,
    )


def solve(problem: tuple[Spec, Model], *tables: ModeTable) -> Updated:
    updated = update_modal(*problem, list(tables))
    consistent(updated)
    return updated


@pytest.mark.parametrize("method", ["frequencies", "sensitivity"])
def test_known_stiffness_and_mass_come_back(method: str) -> None:
    problem = portal_problem(update={"method": method})
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9), channels=CHANNELS))
    assert updated.status == "converged"
    assert np.abs(values(updated) - TRUTH[:6]).max() < 1e-6
    assert (
        updated.fit["fit"]["frequency_error_percent_max"]["after"] < 1e-6
        and updated.fit["fit"]["mac_min"]["after"] > 1 - 1e-9
    )
    assert updated.certificate["optimal"]


def test_shapes_without_a_stated_deviation_are_fitted_too() -> None:
    problem = portal_problem(update={"method": "sensitivity"})
    table = replace(measured(problem[1], TRUTH[:6], range(1, 6), channels=CHANNELS), shape_std=None)
    assert np.abs(values(solve(problem, table)) - TRUTH[:6]).max() < 1e-5


def test_shapes_tell_what_frequencies_cannot() -> None:
    """E of all and rho of all move every frequency alike; shapes of a bar with a lump do see their
    ratio to it."""
    parameters = [
        {"groups": ["column", "roof", "arm"], "of": "E", "name": "E"},
        {"group": "lump", "of": "m"},
        {"group": "column", "of": "rho"},
    ]
    truth = np.array([0.1, 0.2, -0.1])
    problem = portal_problem(parameters, update={"method": "sensitivity"})
    table = measured(problem[1], truth, [1, 2, 3], channels=CHANNELS)
    assert np.abs(values(solve(problem, table)) - truth).max() < 1e-5


def test_a_bound_that_bites_is_reported_and_kept() -> None:
    problem = portal_problem(constraints={"bounds": {"lower": -0.05, "upper": 0.05}})
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9)))
    p = values(updated)
    assert np.all(np.abs(p) <= 0.05 + 1e-9)
    at = [q for q in updated.parameters if q.at_bound]
    assert at and all(
        abs(abs(q.p) - 0.05) < 1e-6 and q.bound == ("upper" if q.p > 0 else "lower") for q in at
    )
    assert any("bounds on" in name for name in updated.active)


def test_tied_parameters_share_one_value_and_one_deviation() -> None:
    truth = TRUTH[:6].copy()
    truth[1] = truth[0]
    problem = portal_problem(
        constraints={**BOUNDS, "tied": [{"parameters": ["column.stiffness", "roof.E"]}]}
    )
    updated = solve(problem, measured(problem[1], truth, range(1, 9)))
    assert np.abs(values(updated) - truth).max() < 1e-6
    a, b = updated.parameters[:2]
    assert a.p == pytest.approx(b.p, abs=1e-9) and a.p_std == pytest.approx(b.p_std, rel=1e-9)
    free = solve(portal_problem(), measured(problem[1], truth, range(1, 9)))
    assert (
        a.p_std is not None
        and free.parameters[0].p_std is not None
        and a.p_std < free.parameters[0].p_std
    )


def test_total_mass_is_conserved() -> None:
    model = portal_problem()[1]
    gradient = model.mass_gradient(model.zero())
    truth = TRUTH[:6].copy()
    truth[4] = -gradient[3] * truth[3] / gradient[4]
    problem = portal_problem(constraints={**BOUNDS, "total_mass": {"conserve": True}})
    updated = solve(problem, measured(model, truth, range(1, 9)))
    assert updated.model["mass_after"] == pytest.approx(updated.model["mass_before"], rel=1e-9)
    assert np.abs(values(updated) - truth).max() < 1e-6


def test_a_linear_equality_holds_where_the_data_disagree() -> None:
    row = {"coefficients": {"column.stiffness": 1.0, "arm.stiffness": -2.0}, "equals": 0.1}
    problem = portal_problem(constraints={**BOUNDS, "linear": [row]})
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9)))
    p = values(updated)
    assert p[0] - 2 * p[2] == pytest.approx(0.1, abs=1e-8)
    assert updated.status == "converged" and updated.fit["fit"]["objective"]["after"] > 1.0


def test_l1_finds_the_one_that_changed() -> None:
    problem = portal_problem(regularisation={"kind": "l1", "weight": 50.0})
    truth = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    p = values(solve(problem, measured(problem[1], truth, range(1, 9))))
    assert np.abs(p[[0, 1, 3, 4, 5]]).max() < 2e-3 and p[2] == pytest.approx(0.2, abs=0.01)
    weak = np.abs(
        values(solve(portal_problem(), measured(problem[1], truth, range(1, 9), noise=3)))[
            [0, 1, 3, 4, 5]
        ]
    ).sum()
    strong = np.abs(
        values(solve(problem, measured(problem[1], truth, range(1, 9), noise=3)))[[0, 1, 3, 4, 5]]
    ).sum()
    assert strong < 0.5 * weak


def test_group_l1_switches_groups_as_one() -> None:
    groups = [["column.stiffness", "column.mass"], ["roof.E", "tie.k"], ["arm.stiffness", "lump.m"]]
    problem = portal_problem(regularisation={"kind": "group-l1", "weight": 8.0, "groups": groups})
    truth = np.array([0.0, 0.0, 0.2, 0.0, 0.15, 0.0])
    p = values(solve(problem, measured(problem[1], truth, range(1, 9))))
    assert np.abs(p[[0, 3, 1, 5]]).max() < 5e-3 and min(abs(p[2]), abs(p[4])) > 0.1


def test_tikhonov_draws_towards_the_drawing() -> None:
    table = measured(portal_problem()[1], TRUTH[:6], range(1, 9))
    sizes = [
        np.linalg.norm(
            values(solve(portal_problem(regularisation={"kind": "tikhonov", "weight": w}), table))
        )
        for w in (1e-3, 1e3, 1e8)
    ]
    assert sizes[0] > sizes[1] > sizes[2] and sizes[2] < 0.02


@pytest.mark.parametrize(("loss", "limit"), [("l1", 1e-6), ("huber", 0.02)])
def test_robust_losses_forgive_one_wrong_mode(loss: str, limit: float) -> None:
    parameters = (SEEN[0], SEEN[1], SEEN[5])
    truth = np.array([0.12, -0.08, 0.2])
    plain = portal_problem(parameters)
    table = measured(plain[1], truth, range(1, 9), pairs=range(1, 9))
    frequency = table.frequency.copy()
    frequency[4] *= 1.06  # sixty deviations
    table = replace(table, frequency=frequency)
    robust = solve(portal_problem(parameters, update={"loss": loss}), table)
    misled = solve(plain, table)
    assert (
        np.abs(values(robust) - truth).max() < limit < 0.05 < np.abs(values(misled) - truth).max()
    )


def test_an_infeasible_problem_names_its_clauses_and_changes_nothing() -> None:
    rows = [
        {"coefficients": {"column.stiffness": 1.0}, "at_least": 0.3},
        {"coefficients": {"column.stiffness": 1.0}, "at_most": 0.2},
    ]
    problem = portal_problem(constraints={**BOUNDS, "linear": rows})
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9)))
    assert updated.status == "infeasible" and len(updated.conflict) == 2 and updated.relaxation
    assert (
        "cannot hold together" in updated.reason
        and not np.any(values(updated))
        and not updated.history
    )


def test_a_start_outside_the_clauses_is_moved_inside() -> None:
    rows = [{"coefficients": {"column.stiffness": 1.0}, "at_least": 0.05}]
    problem = portal_problem(constraints={**BOUNDS, "linear": rows})
    other = measured(problem[1], TRUTH[:6], [9], pairs=[9], use="hold-out")
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9)), other)
    assert updated.status == "converged" and np.abs(values(updated) - TRUTH[:6]).max() < 1e-6
    assert all(h["p"][0] >= 0.05 - 1e-8 for h in updated.history)
    assert updated.fit["hold_out"]["frequency_error_percent_mean"]["after"] < 1e-6


def test_the_limit_of_iterations_is_a_stop() -> None:
    problem = portal_problem(update={"max_iterations": 1})
    updated = solve(problem, measured(problem[1], TRUTH[:6], range(1, 9)))
    assert (
        updated.status == "stopped"
        and "limit of 1 iterations" in updated.reason
        and updated.iterations == 1
    )


@pytest.mark.parametrize("pairs", [(), range(1, 7)])
def test_a_second_measurement_is_scored_beside_the_first(pairs: Any) -> None:
    """The same modes held out, as the file numbers them or not: same partners at both ends, and the
    fit is that without them."""
    problem = portal_problem()
    fit = measured(problem[1], TRUTH[:6], range(1, 7), noise=1, pairs=pairs)
    again = measured(problem[1], TRUTH[:6], range(1, 7), noise=2, pairs=pairs, use="hold-out")
    both, alone = solve(problem, fit, again), solve(problem, fit)
    assert np.array_equal(values(both), values(alone))
    scored = both.fit["hold_out"]["frequency_error_percent_mean"]
    assert scored["after"] < 0.2 < 2.0 < scored["before"]  # 0.1 % of noise in each
    for which in ("model_mode_before", "model_mode_after"):
        first, second = (
            [getattr(m, which) for m in both.modes if m.use == use] for use in ("fit", "hold-out")
        )
        assert first == second and len(set(first)) == 6


def test_hold_out_data_never_change_the_fit() -> None:
    """Whatever is held out, its number, values and pairing: the parameters and the history are the
    same to the last bit."""
    problem = portal_problem()
    fit = measured(problem[1], TRUTH[:6], range(1, 7), noise=5)
    alone = solve(problem, fit)
    others = (
        measured(problem[1], TRUTH[:6], [7, 8], use="hold-out"),
        measured(problem[1], TRUTH[:6], [9], noise=8, std=0.1, pairs=[12], use="hold-out"),
        measured(problem[1], TRUTH[:6], [1, 2, 3], noise=9, std=0.2, use="hold-out"),
    )
    for other in others:
        both = solve(problem, fit, other)
        assert values(both).tobytes() == values(alone).tobytes()
        assert both.history == alone.history
        assert [q.standard_deviation for q in both.parameters] == [
            q.standard_deviation for q in alone.parameters
        ]
        assert both.fit["hold_out"] and not alone.fit["hold_out"]
    scored = solve(problem, fit, others[0])
    hold = scored.fit["hold_out"]["frequency_error_percent_mean"]
    assert hold["after"] < hold["before"] / 2
    assert [m.model_mode_after for m in scored.modes if m.use == "hold-out"] == [7, 8]


def test_crossing_modes_are_updated_under_their_own_names() -> None:
    """The measured modes are named by the initial model's order; the updated model has them the
    other way round."""
    problem = structure(
        crossing(), [{"group": "bar", "of": "Iy"}, {"group": "bar", "of": "Iz"}], constraints=BOUNDS
    )
    truth = np.array([0.35, -0.1])
    updated = solve(problem, measured(problem[1], truth, [2, 1, 4, 3], pairs=[1, 2, 3, 4]))
    assert np.abs(values(updated) - truth).max() < 1e-6
    assert [(m.model_mode_before, m.model_mode_after) for m in updated.modes] == [
        (1, 2),
        (2, 1),
        (3, 4),
        (4, 3),
    ]


SHEET = [
    {"elements": "all", "of": "E"},
    {"elements": "all", "of": "Dxy"},
    {"elements": "all", "of": "Dx"},
]


def test_another_pairing_is_tried_after_convergence() -> None:
    """A sheet far stiffer than drawn: frequencies alone pair it wrongly at first; the updated model
    shows a better pairing, which finds the truth."""
    truth = np.array([0.34, -0.23, -0.06])
    problem = structure(square(1.3), SHEET, constraints=BOUNDS)
    table = measured(problem[1], truth, [1, 2, 3, 4, 7, 10, 12])
    updated = solve(problem, table)
    notes = [note for note in updated.notes if "another pairing" in note]
    assert 1 <= len(notes) <= 5 and all(
        "Hz fitted the updated model better (objective" in note for note in notes
    )
    assert np.abs(values(updated) - truth).max() < 1e-6
    first = solve(
        structure(
            square(1.3),
            SHEET,
            constraints=BOUNDS,
            update={"max_iterations": len(updated.history) // 2},
        ),
        table,
    )
    assert (
        first.iterations <= len(updated.history) // 2 and first.status == "stopped"
    )  # restarts spend the same iterations


def test_a_fixed_pairing_is_never_reconsidered() -> None:
    parameters = [
        {"group": "bar", "of": "Iy", "lower": -0.1, "upper": 0.9},
        {"group": "bar", "of": "Iz", "lower": -0.05, "upper": 0.02},
    ]
    problem = structure(crossing(), parameters)
    updated = solve(problem, measured(problem[1], [0.5, 0.0], [1, 2, 3, 4], pairs=[1, 2, 3, 4]))
    assert [m.model_mode_before for m in updated.modes] == [1, 2, 3, 4] and not any(
        "another pairing" in note for note in updated.notes
    )


def test_steps_into_an_indefinite_mass_are_rejected() -> None:
    """λ falls like 1/m, so the first wide linear step to a fifth of the mass ends far below zero;
    the loop shortens it and still arrives."""
    spec, model = structure(
        free_chain(),
        [{"group": "m2", "of": "m"}, {"group": "k3", "of": "k"}],
        update={"trust_radius": 50.0},
    )
    wide = model.with_parameters([replace(q, lower=-40.0, upper=40.0) for q in model.parameters])
    truth = np.array([-0.8, 2.0])
    updated = solve((spec, wide), measured(wide, truth, [1, 2, 3, 4], pairs=[1, 2, 3, 4]))
    assert any(not h["accepted"] and h["ratio"] is None for h in updated.history), [
        h["ratio"] for h in updated.history
    ]
    assert updated.status == "converged" and all(
        1.0 + h["p"][0] > 0.0 for h in updated.history if h["accepted"]
    )
    assert np.abs(values(updated) - truth).max() < 1e-6


@pytest.mark.parametrize("truth", [(0.12, -0.05, 0.04), (-0.04, 0.03, 0.05)])
@pytest.mark.parametrize("channels", [(), ("n1.z", "n3.z", "n8.z", "n25.z", "n12.z")])
def test_repeated_pairs_split_to_the_measured_frequencies(
    channels: tuple[str, ...], truth: tuple[float, ...]
) -> None:
    """A square sheet with pairs; the real one is orthotropic. By frequencies alone its mirror image
    (Dx and Dy exchanged) is as good an answer."""
    parameters = [
        {"elements": "all", "of": "Dx"},
        {"elements": "all", "of": "Dy"},
        {"elements": "all", "of": "Dxy"},
    ]
    problem = structure(square(), parameters, update={"method": "sensitivity"}, constraints=BOUNDS)
    updated = solve(problem, measured(problem[1], truth, range(1, 8), channels=channels))
    assert updated.status == "converged"
    assert any("repeats the eigenvalue" in note for note in updated.notes) == bool(channels)
    error = np.abs(values(updated) - truth).max()
    mirrored = np.abs(values(updated)[[1, 0, 2]] - truth).max()
    assert error < 1e-5 or (mirrored < 1e-5 and not channels)


def test_a_nearly_square_sheet_is_no_obstacle() -> None:
    parameters = [
        {"elements": "all", "of": "Dx"},
        {"elements": "all", "of": "Dy"},
        {"elements": "all", "of": "Dxy"},
    ]
    problem = structure(square(1.002), parameters, constraints=BOUNDS)
    truth = np.array([0.12, -0.05, 0.04])
    updated = solve(problem, measured(problem[1], truth, range(1, 9), std=1e-3))
    assert (
        updated.status == "converged"
        and updated.fit["fit"]["frequency_error_percent_max"]["after"] < 1e-3
    )


def test_a_support_spring_grows_from_zero() -> None:
    problem = structure(
        free_chain(),
        [
            {"group": "support", "of": "k", "scale": 1e5, "lower": 0.0, "upper": 5.0},
            {"group": "k2", "of": "k"},
        ],
        constraints=BOUNDS,
    )
    truth = np.array([0.4, 0.1])
    table = measured(problem[1], truth, [2, 3, 4, 5], pairs=[1, 2, 3, 4])
    assert np.abs(values(solve(problem, table)) - truth).max() < 1e-6


def test_nothing_to_fit_is_told() -> None:
    problem = portal_problem()
    with pytest.raises(InputError, match='use = "fit"'):
        update_modal(*problem, [measured(problem[1], TRUTH[:6], [1], use="hold-out")])


def test_modes_without_a_partner_are_named() -> None:
    problem = structure(free_chain(), [{"group": "k2", "of": "k"}])
    table = measured(problem[1], [0.1], [1, 2, 3, 4])
    more = replace(
        table,
        frequency=np.append(table.frequency, 900.0),
        frequency_std=np.append(table.frequency_std, 9.0),
        pairs=np.zeros(5, dtype=np.int64),
        damping=np.full(5, np.nan),
        damping_std=np.full(5, np.nan),
    )
    updated = solve(problem, more)
    assert any("900 Hz: not compared" in note for note in updated.notes) and len(updated.modes) == 4
    assert model_modes(problem[1], 9).frequencies.size == 5

"""One changed element of the bay structure (thesis 3.4), located by force balance and by energies,
complete and with the ten sensors of 3.4.1."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from cvxupdate.correlate import element_balance, element_batches, energy_map, pair_modes
from cvxupdate.fe.modes import model_modes
from cvxupdate.reduction import dynamic, partition, serep
from validation import make_bay

COUNT = 8


@pytest.fixture(scope="module")
def bay():
    model = make_bay.build("X1")
    return (
        model,
        model.matrices(),
        np.array([model.place[s] for s in make_bay.TEN]),
        model_modes(model, 15).flexible(),
    )


def changed(model, element, factor):
    """The model with the stiffness of one element times ``factor``."""
    return replace(
        model,
        blocks=tuple(
            replace(
                b,
                properties={
                    **b.properties,
                    "stiffness": np.where(b.ids == element, factor, b.properties["stiffness"]),
                },
            )
            for b in model.blocks
        ),
    )


@dataclass(frozen=True)
class Found:
    """For every element changed in turn: its rank by force balance and by energy, and the change
    that the force balance gives, each (20,)."""

    force: np.ndarray
    energy: np.ndarray
    change: np.ndarray


def locate(bay, factor, sensors, noise=0.0, seed=0):
    model, m, ten, modes = bay
    rng = np.random.default_rng(seed)
    batches, ids = element_batches(model)
    split, T = (
        (partition(m.K, m.M, ten), serep(modes.shapes[:, :COUNT], ten))
        if sensors == "ten"
        else (None, None)
    )
    rows = []
    for k, element in enumerate(ids.tolist()):
        truth = model_modes(changed(model, element, factor), COUNT).flexible()
        f, x = truth.frequencies, truth.shapes if sensors == "all" else truth.shapes[ten]
        x = x * (1.0 + noise * rng.standard_normal(x.shape))
        b = element_balance(
            batches, m.K, m.M, x, f, None if split is None else [dynamic(split, v) for v in f]
        )
        pairs = pair_modes(
            modes.shapes if sensors == "all" else modes.shapes[ten], x, modes.frequencies, f
        )
        e = energy_map(
            batches,
            modes.shapes[:, pairs.model],
            (x if T is None else T.expand(x))[:, pairs.measured],
        )
        rows.append(
            (1 + np.sum(b.stiffness > b.stiffness[k]), 1 + np.sum(e > e[k]), b.stiffness_change[k])
        )
    return Found(*np.array(rows).T)


@pytest.mark.parametrize("factor", [0.7, 1.3, 0.92])
def test_complete_shapes_locate_every_element_both_ways_and_say_by_how_much(bay, factor):
    found = locate(bay, factor, "all")
    assert np.all(found.force == 1) and np.all(found.energy == 1)
    assert found.change == pytest.approx(factor - 1.0, rel=1e-4)


@pytest.mark.parametrize("factor", [0.7, 1.3, 0.92])
def test_ten_sensors_locate_every_element_by_force_balance(bay, factor):
    found = locate(bay, factor, "ten")
    assert np.all(found.force == 1)
    assert np.all(np.sign(found.change) == np.sign(factor - 1.0))
    assert np.median(found.change) == pytest.approx(
        factor - 1.0, rel=0.25
    )  # the expansion assumes the model: right to first order
    assert (
        np.sum(found.energy <= 3) >= 16
    )  # SEREP smooths the jump of deformation away: the energy map is blunter


def test_change_found_from_ten_sensors_is_exact_to_first_order(bay):
    """The relative error goes to zero in proportion to the change (close modes make it large at one
    per cent)."""
    worst = [np.max(np.abs(locate(bay, 1.0 + d, "ten").change / d - 1.0)) for d in (1e-3, 1e-4)]
    assert worst[1] == pytest.approx(0.1 * worst[0], rel=0.2) and worst[1] < 0.01


@pytest.mark.slow
def test_noise_of_one_per_cent(bay):
    """Complete: energies survive it, the force balance finds large losses only. Ten sensors: the
    force balance is the better of the two."""
    seeds = range(3)
    hits = {
        (s, f): np.array(
            [
                [np.sum(r == 1) for r in (x.force, x.energy)]
                for x in (locate(bay, f, s, 0.01, k) for k in seeds)
            ]
        )
        for s, f in (("all", 0.7), ("all", 1.3), ("ten", 0.7))
    }
    assert np.all(hits["all", 0.7] == 20)
    assert np.all(hits["all", 1.3][:, 1] == 20) and np.all(hits["all", 1.3][:, 0] < 18)
    assert np.all(hits["ten", 0.7][:, 0] >= 18) and np.all(
        hits["ten", 0.7][:, 1] < hits["ten", 0.7][:, 0]
    )

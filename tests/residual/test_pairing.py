"""Which mode is which: fixed, by MAC, by frequency, mixed; what is only scored stays out of it."""

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError, RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.follow import follow
from cvxupdate.residual.misfit import scored_by_frequency
from cvxupdate.residual.pairing import pairing_modes, start_pairing
from cvxupdate.residual.shape_rows import channel_rows, real_shapes
from tests.cases.structures import PORTAL, TRUTH, crossing, free_chain, measured, portal, structure

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


def model() -> Model:
    return structure(portal(), PORTAL)[1]


def places(
    m: Model, *tables: ModeTable, rule: str = "auto", first: int | None = None
) -> list[list[int]]:
    start = start_pairing(m, pairing_modes(m, tables, rule), tables, rule, first)
    return [p.tolist() for p in start.places]


def test_by_mac_whatever_the_order() -> None:
    m = model()
    order = [5, 2, 7, 1, 3]
    assert places(m, measured(m, TRUTH, order, channels=CHANNELS), rule="mac") == [
        [i - 1 for i in order]
    ]


def test_complex_shapes_are_turned_to_real_ones() -> None:
    m = model()
    t = measured(m, TRUTH, [1, 2, 3], channels=CHANNELS)
    turned = replace(t, shapes=t.shapes * np.exp(1j * np.array([0.3, 2.0, -1.1]))[:, None])
    back = real_shapes(turned.shapes)
    assert np.allclose(np.abs(np.sum(back * t.shapes, axis=1)), np.sum(t.shapes**2, axis=1))
    assert places(m, turned, rule="mac") == [[0, 1, 2]]


def test_by_frequency_when_there_are_no_shapes() -> None:
    m = model()
    assert places(m, measured(m, TRUTH, [4, 1, 2, 6, 3, 5])) == [[3, 0, 1, 5, 2, 4]]


def test_a_table_that_begins_high_up_finds_its_modes() -> None:
    """Two modes far above the lowest: more modes of the model are computed than there are measured
    ones."""
    m = model()
    assert places(m, measured(m, m.zero(), [10, 11])) == [[9, 10]]


def test_fixed_keeps_what_the_file_says_and_the_rest_find_theirs() -> None:
    m = model()
    t = measured(m, TRUTH, [1, 2, 3, 4], pairs=[0, 3, 2, 0])
    assert places(m, t) == [[0, 2, 1, 3]]
    assert places(m, t, rule="frequency") == [[0, 1, 2, 3]]


def test_mixed_fixed_then_mac_then_frequency() -> None:
    m = model()
    t = measured(m, TRUTH, [1, 2, 3, 5], channels=CHANNELS, pairs=[4, 0, 0, 0])
    shapes = t.shapes.copy()
    shapes[3] = np.nan  # no shape: by frequency
    found = start_pairing(m, pairing_modes(m, [t], "auto"), [replace(t, shapes=shapes)])
    assert found.places[0].tolist() == [3, 1, 2, 4]
    assert found.loose[0].tolist() == [False, False, False, True]


@pytest.mark.parametrize("channels", [("n2.x", "n3.x"), ("n4.y", "n5.y"), ("n5.x", "n4.x")])
def test_a_model_that_is_off_as_a_whole_pairs_what_is_scored_beside_what_is_fitted(channels):
    """Two sensors tell modes 4 and 5 hardly apart, and of a structure that is half as stiff as its
    drawing the frequency alone would say mode 4: all fitted modes lie as far below the model's."""
    m = model()
    fitted = measured(m, TRUTH, [1, 2, 3], channels=CHANNELS)
    held = measured(m, TRUTH, [5], channels=channels, use="hold-out")
    lower = [replace(t, frequency=t.frequency / 2.0) for t in (fitted, held)]
    assert places(m, *lower, first=1) == [[0, 1, 2], [4]]


def test_what_is_scored_goes_to_no_mode_that_is_further_off_than_gross_effects_move_any() -> None:
    """At two sensors mode 5 looks like mode 4, which lies a third lower while the fitted modes are
    within some per cent."""
    m = model()
    fitted = measured(m, TRUTH, [1, 2, 3], channels=CHANNELS)
    held = measured(m, TRUTH, [5], channels=("n6.y", "n2.y"), use="hold-out")
    assert places(m, fitted, held, first=1) == [[0, 1, 2], [4]]


def test_no_model_mode_serves_two_different_modes() -> None:
    m = model()
    a, b = measured(m, TRUTH, [1, 2]), measured(m, TRUTH, [3, 4])
    together = places(m, a, b)
    assert sorted(together[0] + together[1]) == [0, 1, 2, 3]


@pytest.mark.parametrize("use", ["fit", "hold-out"])
@pytest.mark.parametrize("pairs", [(), (1, 2, 4)])
def test_the_same_modes_measured_again_have_the_same_partners(use, pairs) -> None:
    """A second measurement, 0.1 % off, whether the file says which modes they are or not, fitted or
    held out."""
    m = model()
    a, b = (
        measured(m, TRUTH, [1, 2, 4], noise=k, pairs=pairs, use=u)
        for k, u in ((1, "fit"), (2, use))
    )
    assert places(m, a, b, first=1 if use == "hold-out" else 2) == [[0, 1, 3]] * 2


def test_a_second_run_with_one_more_mode_shares_what_is_the_same() -> None:
    m = model()
    assert places(
        m,
        measured(m, TRUTH, [1, 2, 4], noise=1),
        measured(m, TRUTH, [1, 2, 3, 4], noise=2, use="hold-out"),
        first=1,
    ) == [[0, 1, 3], [0, 1, 2, 3]]


def test_shapes_tell_neighbours_of_one_frequency_apart() -> None:
    """Another mode measured at nearly the frequency of the first table's is another mode, because
    its shape is."""
    m = model()
    a, b = (measured(m, TRUTH, modes, channels=CHANNELS) for modes in ([1, 2], [3]))
    near = replace(b, frequency=1.002 * a.frequency[1:])
    assert places(m, a, near) == [[0, 1], [2]]
    assert places(
        m, replace(a, shapes=None, shape_std=None), replace(near, shapes=None, shape_std=None)
    ) == [[0, 1], [1]]


def test_what_is_only_scored_chooses_last() -> None:
    m = model()
    fit, other = measured(m, TRUTH, [1, 2, 3]), measured(m, m.zero(), [1, 2, 4], use="hold-out")
    alone = places(m, fit)
    both = places(m, fit, other, first=1)
    assert both[0] == alone[0] and not set(both[1]) & set(both[0])


@pytest.mark.parametrize(
    ("pairs", "rule", "says"),
    [
        ([2, 2, 0], "auto", "both paired with mode 2"),
        ([1, 99, 0], "auto", "only 15 flexible modes"),
        ([1, 2, 0], "fixed", "names no `mode`"),
        ([0, 0, 0], "mac", "has no shape"),
    ],
)
def test_conflicts_are_told(pairs, rule, says) -> None:
    m = model()
    with pytest.raises(InputError, match=says) as error:
        places(m, measured(m, TRUTH, [1, 2, 3], pairs=pairs), rule=rule)
    assert "Hz" in str(error.value)


def test_hold_out_that_names_the_partner_of_another_mode_is_told() -> None:
    m = model()
    with pytest.raises(InputError, match="both paired with mode 2"):
        places(
            m,
            measured(m, TRUTH, [1, 2]),
            measured(m, TRUTH, [3], pairs=[2], use="hold-out"),
            first=1,
        )


def test_a_shape_like_no_other_is_told_under_mac() -> None:
    m = model()
    t = measured(m, TRUTH, [1, 2, 3], channels=CHANNELS)
    modes = model_modes(m, 15, m.zero())
    at = channel_rows(t, m)
    foreign = np.linalg.svd(modes.shapes[at][:, :4].T)[2][
        -1
    ]  # orthogonal to the four lowest at these channels
    shapes = t.shapes.copy()
    shapes[2] = foreign
    some = Modes(modes.eigenvalues[:4], modes.shapes[:, :4], 0)
    with pytest.raises(InputError, match="resembles none"):
        start_pairing(m, some, [replace(t, shapes=shapes)], "mac")
    assert start_pairing(m, some, [replace(t, shapes=shapes)], "auto").loose[0].tolist() == [
        False,
        False,
        True,
    ]


def test_channels_where_the_model_has_no_node_or_is_held() -> None:
    m = model()
    t = measured(m, TRUTH, [1], channels=CHANNELS)
    held = replace(t, channels=(Channel(1, "x", "displacement"), *t.channels[1:]))
    assert channel_rows(held, m)[0] == -1 and channel_rows(held, m)[1] >= 0
    with pytest.raises(RecordingError, match=r"n77\.x sits at node 77"):
        channel_rows(replace(t, channels=(Channel(77, "x", "displacement"), *t.channels[1:])), m)


def test_modes_that_cross_keep_their_identity() -> None:
    """Bending in y and in z of one bar change places as Iy overtakes Iz; each shape is followed
    through."""
    m = structure(crossing(), [{"group": "bar", "of": "Iy"}])[1]
    p = m.zero()
    modes = model_modes(m, 4, p)
    at = np.arange(4)
    vertical = [
        modes.shapes[[m.place["n4.z"]], i][0] ** 2 > modes.shapes[[m.place["n4.y"]], i][0] ** 2
        for i in at
    ]
    assert vertical == [True, False, True, False]
    for value in np.linspace(0.02, 0.4, 20):
        matrices = m.matrices([value])
        now = model_modes(m, 4, np.array([value]))
        at = follow(modes.shapes[:, at], matrices.M, now)
        modes = now
    assert at.tolist() == [1, 0, 3, 2]
    assert [
        modes.shapes[m.place["n4.z"], i] ** 2 > modes.shapes[m.place["n4.y"], i] ** 2 for i in at
    ] == vertical


def test_follow_through_one_large_step_and_without_the_taken() -> None:
    m = structure(crossing(), [{"group": "bar", "of": "Iy"}])[1]
    before, after = model_modes(m, 4, m.zero()), model_modes(m, 4, np.array([0.4]))
    M = m.matrices([0.4]).M
    assert follow(before.shapes, M, after).tolist() == [1, 0, 3, 2]
    assert follow(before.shapes[:, :1], M, after, np.array([1])).tolist() != [1]


def test_rigid_modes_that_become_flexible_are_counted_on() -> None:
    """The support spring of a free chain grows from zero: the rigid mode becomes the lowest
    flexible one and no measured mode slips."""
    m = structure(free_chain(), [{"group": "support", "of": "k", "scale": 1e5}])[1]
    before, after = model_modes(m, 3, m.zero()), model_modes(m, 4, np.array([0.05]))
    assert (before.rigid, after.rigid) == (1, 0)
    assert follow(before.shapes[:, 1:4], m.matrices([0.05]).M, after).tolist() == [1, 2, 3]


def test_too_few_modes_left_is_a_model_error() -> None:
    m = model()
    modes = model_modes(m, 3, m.zero())
    with pytest.raises(ModelError, match="only 3 modes left for the 5"):
        follow(model_modes(m, 5, m.zero()).shapes, m.matrices().M, modes)


def test_what_is_held_out_without_a_shape_is_found_again_by_frequency() -> None:
    """The nominal model stood between: 502 Hz was nearer to its 509 than to its 494, which became
    509 itself. One that was fitted and measured again stays that, and so does one with a shape."""

    def table(*f: float) -> ModeTable:
        nothing = np.full(len(f), np.nan)
        at = np.array(f)
        return ModeTable(
            Origin("t", "t", "fit"), at, 1e-3 * at, nothing, nothing, (), None, None, 0 * at
        )

    f = np.array([0.0, 70.0, 131.0, 447.0, 509.0, 522.0])
    modes = Modes((2.0 * np.pi * f) ** 2, np.eye(6), 1)
    held, places = [table(442.0, 502.0, 70.5), table(520.0)], [np.array([1, 2])]
    places += [np.array([3, 5, 1]), np.array([4])]
    loose = [np.ones(2, bool), np.ones(3, bool), np.zeros(1, bool)]
    out = scored_by_frequency(held, loose, places, modes)
    assert [q.tolist() for q in out] == [[1, 2], [3, 4, 1], [4]]
    assert scored_by_frequency([], [], places, modes) == tuple(places)

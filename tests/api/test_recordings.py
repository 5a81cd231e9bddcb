"""Recordings from arrays, pandas, xarray, pyuff: nothing changes on the way through a problem."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cvxupdate import Frf, InputError, Modes, TimeHistory
from cvxupdate.recordings.load import load_recordings
from cvxupdate.spec import spec_of

RNG = np.random.default_rng(11)
F = np.array([1.0, 1.5, 2.5, 4.0])
H = RNG.standard_normal((4, 3, 2)) + 1j * RNG.standard_normal((4, 3, 2))
OUT, IN = ["n1.x", "n2.y", "n3.rz"], ["n1.x", "n2.y"]
MODEL = {
    "dofs": ["x", "y", "rz"],
    "nodes": [{"id": i, "x": float(i)} for i in (1, 2, 3)],
    "materials": {"m": {"E": 1e9, "rho": 1e3}},
    "sections": {"s": {"shape": "circle", "diameter": 0.1}},
    "elements": [
        {
            "type": "beam2d",
            "material": "m",
            "section": "s",
            "rows": [{"id": i, "nodes": [i, i + 1]} for i in (1, 2)],
        }
    ],
}


def through(recording: Any) -> Any:
    """What a command sees of it."""
    return load_recordings(spec_of({"model": MODEL, "recordings": [recording.table()]}))[0]


def test_an_frf_goes_through_unchanged() -> None:
    v = RNG.random(H.shape)
    frf = Frf(F, H, OUT, IN, quantity="accelerance", variance=v, name="tap", level=2.0)
    seen = through(frf)
    assert np.array_equal(seen.H, H) and np.array_equal(seen.frequency, F)
    assert np.array_equal(seen.variance, v) and seen.quantity == "acceleration"
    assert [c.label for c in seen.responses] == OUT and [c.label for c in seen.references] == IN
    assert (seen.origin.name, seen.origin.level) == ("tap", 2.0)


def test_signs_and_units_are_taken_out() -> None:
    frf = Frf(F, H[:, 0, 0], "1:-X", "n1.x", quantity="acceleration", unit="g/N")
    assert np.allclose(frf.H[:, 0, 0], -9.80665 * H[:, 0, 0])
    both = Frf(F, H[:, 0, 0], "1:-X", "1:-X", quantity="mobility", variance=abs(H[:, 0, 0]))
    assert np.allclose(both.H[:, 0, 0], H[:, 0, 0])
    assert np.allclose(both.variance[:, 0, 0], abs(H[:, 0, 0]))


def test_pandas_there_and_back() -> None:
    pytest.importorskip("pandas")
    frf = Frf(F, H, OUT, IN, quantity="displacement")
    again = Frf.from_pandas(frf.to_dataframe(), quantity="displacement")
    assert np.array_equal(again.H, H) and again.references == frf.references
    one = frf.to_dataframe().xs("n1.x", axis=1, level="reference")
    assert np.array_equal(Frf.from_pandas(one, "n1.x", quantity="displacement").H, H[:, :, :1])
    modes = Modes(
        [3.0, 7.0], RNG.standard_normal((2, 2)), IN, damping=0.01, frequency_std=[0.1, 0.2]
    )
    back = Modes.from_pandas(modes.to_dataframe())
    assert np.array_equal(back.shapes, modes.shapes) and back.labels == modes.labels
    assert np.array_equal(back.frequency_std, [0.1, 0.2]) and np.array_equal(
        back.damping, [0.01] * 2
    )
    wild = Modes([3.0, 7.0], RNG.standard_normal((2, 2)) * (1 + 0.3j), IN)
    assert np.array_equal(Modes.from_pandas(wild.to_dataframe()).shapes, wild.shapes)
    time = TimeHistory(
        RNG.standard_normal((50, 2)), 200.0, [("n1.x", "force"), ("n2.y", "velocity")]
    )
    frame = time.to_dataframe()
    names = {frame.columns[0]: ("n1.x", "force"), frame.columns[1]: ("2:+Y", "velocity")}
    same = TimeHistory.from_pandas(frame, names)
    assert np.array_equal(same.data, time.data) and same.rate == pytest.approx(200.0)


def test_headers_of_other_programs() -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {"frequency_Hz": [2.0], "damping_pct": [1.5], "1:-X": [0.5], "2:+Y": [1.0]}
    )
    modes = Modes.from_pandas(frame)
    assert modes.damping[0] == pytest.approx(0.015)
    assert modes.labels == ("n1.x", "n2.y") and np.array_equal(modes.shapes[:, 0], [-0.5, 1.0])


def test_xarray() -> None:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(
        H.transpose(1, 0, 2),
        dims=("response", "frequency", "reference"),
        coords={"response": OUT, "frequency": F, "reference": IN},
    )
    assert np.array_equal(Frf.from_xarray(array, quantity="mobility").H, H)
    single = array.isel(reference=1)
    assert np.array_equal(Frf.from_xarray(single, quantity="mobility").H, H[:, :, 1:])
    with pytest.raises(InputError, match="frequency, response and reference"):
        Frf.from_xarray(array.rename(frequency="f"), quantity="mobility")


def sets() -> list[dict[str, Any]]:
    return [
        {
            "type": 58,
            "func_type": 4,
            "rsp_node": o,
            "rsp_dir": d,
            "ref_node": 1,
            "ref_dir": 1,
            "x": F,
            "data": H[:, k, 0],
            "ordinate_spec_data_type": 12,
        }
        for k, (o, d) in enumerate([(1, 1), (2, -2), (3, 6)])
    ]


def test_data_sets_of_pyuff() -> None:
    frf = Frf.from_uff(sets())
    assert frf.quantity == "acceleration" and [p.label for p in frf.responses] == OUT
    assert np.allclose(frf.H[:, :, 0], H[:, :, 0] * [1, -1, 1])


def test_modes_go_through_unchanged() -> None:
    shapes = RNG.standard_normal((3, 2))
    std = np.full((3, 2), 0.1)
    modes = Modes([3.0, 2.0], shapes, OUT, damping=[0.01, 0.02], frequency_std=0.1, shape_std=std)
    seen = through(modes)
    assert np.array_equal(seen.frequency, [2.0, 3.0])  # in rising order
    assert np.array_equal(seen.shapes, shapes.T[::-1]) and np.array_equal(
        seen.damping, [0.02, 0.01]
    )
    part = modes.at(["3:-RZ"])
    assert np.array_equal(part.shapes, -shapes[2:]) and part.labels == ("n3.rz",)
    assert Modes.of_recording(seen).labels == tuple(OUT)


def test_time_goes_through_unchanged() -> None:
    data = RNG.standard_normal((64, 2))
    time = TimeHistory(data, 512, [("n1.x", "force"), (3, "-rz", "acceleration")], units=["kN", ""])
    seen = through(time)
    assert np.array_equal(seen.data, data * [1000.0, -1.0]) and seen.rate == 512.0
    assert [c.quantity for c in seen.channels] == ["force", "acceleration"]


def test_files_come_as_objects(tmp_path) -> None:
    frf = Frf(F, H, OUT, IN, quantity="displacement")
    copy = tmp_path / "a.npz"
    copy.write_bytes(Path(frf.table()["file"]).read_bytes())
    assert np.array_equal(Frf.from_file(copy, response="displacement").H, H)
    moved = Frf.from_file(copy, response="displacement", node_map={3: 30}, use="hold-out")
    assert moved.table()["use"] == "hold-out"
    assert moved.responses[2].label == "n30.rz"
    (tmp_path / "m.csv").write_text("frequency,4:+X,9:-Y\n2.0,1.0,0.5\n3.0,0.2,1.0\n")
    modes = Modes.from_file(tmp_path / "m.csv")
    assert modes.labels == ("n4.x", "n9.y") and np.array_equal(modes.shapes[1], [-0.5, -1.0])
    with pytest.raises(InputError, match="there is no file"):
        Frf.from_file(tmp_path / "none.npz", response="displacement")
    with pytest.raises(InputError, match="unknown key 'respons'"):
        Frf.from_file(copy, respons="displacement")


def test_short_words_for_a_prompt() -> None:
    frf = Frf(F, H, OUT, IN, quantity="mobility")
    assert repr(frf) == "Frf(3 responses to 2 references, 4 lines from 1 to 4 Hz, velocity)"
    assert repr(Modes([1.0], [[1.0]], ["n1.x"])) == "Modes(1 mode: 1 Hz, shapes at 1 DOF)"
    assert len(frf.plot().axes) == 2


OK = [("n1.x", "force")]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Frf(F, H[:3], OUT, IN, quantity="mobility"), "3 lines for 4 frequencies"),
        (lambda: Frf(F[::-1], H, OUT, IN, quantity="mobility"), "increasing"),
        (lambda: Frf(F, H, OUT[:2], IN, quantity="mobility"), "2 places for 3"),
        (lambda: Frf(F, H, OUT, None, quantity="mobility"), "say where"),
        (lambda: Frf(F, H, OUT, IN, quantity="speed"), "no motion"),
        (lambda: Frf(F, H, OUT, IN, quantity="mobility", unit="g"), "unit"),
        (lambda: Frf(F, H, OUT, IN, quantity="mobility", unit="/0"), "unit"),
        (lambda: Frf(F, H * np.nan, OUT, IN, quantity="mobility"), "not finite"),
        (lambda: Frf(F, "abc", OUT, IN, quantity="mobility"), "not a number"),
        (lambda: Frf(F, H, OUT, IN, quantity="mobility", variance=F), "must agree"),
        (lambda: Frf(F, H, OUT, IN, quantity="mobility", file="x"), "follows from the arrays"),
        (lambda: Frf(F, H, ["n1.q"] * 3, IN, quantity="mobility"), "no degree of freedom"),
        (lambda: Frf(F, H, [(1, 7)] * 3, IN, quantity="mobility"), "no degree of freedom"),
        (lambda: Frf(F, H, 5, IN, quantity="mobility"), "list of places"),
        (lambda: Frf.from_uff([]), "none of the data sets"),
        (lambda: Frf.from_uff(sets() + sets()[:1]), "twice"),
        (lambda: Frf.from_uff([{**s, "ordinate_spec_data_type": 0} for s in sets()]), "quantity"),
        (lambda: Modes([1.0, 2.0], [[1.0]], ["n1.x"]), "1 columns for 2"),
        (lambda: Modes([0.0]), "above 0"),
        (lambda: Modes([1.0], labels=["n1.x"]), "no shapes"),
        (lambda: Modes([1.0], [[1.0], [2.0]], ["n1.x", "1:-X"]), "one place"),
        (lambda: Modes([1.0], damping=[0.1, 0.2]), "2 for 1 modes"),
        (lambda: Modes([1.0], damping=-0.1), "negative"),
        (lambda: Modes([1.0]).at(["n1.x"]), "no shapes"),
        (lambda: TimeHistory([1.0, 2.0], 0.0, OK), "rate above 0"),
        (lambda: TimeHistory([1.0, 2.0], 10.0, [("n1.x", "noise")]), "not understood"),
        (lambda: TimeHistory([1.0, 2.0], 10.0, "n1.x"), "0 for 1 columns"),
        (lambda: TimeHistory([1.0, 2.0], 10.0, OK, units=["m"]), "units"),
        (lambda: TimeHistory([1.0 + 1j, 2.0], 10.0, OK), "complex"),
    ],
)
def test_bad_input_is_said_in_words(make, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()

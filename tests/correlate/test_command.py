"""`correlate` as a whole: a model against recordings of itself is perfect, what differs is said,
nothing is changed."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from cvxupdate import cli
from cvxupdate.errors import InputError
from cvxupdate.fe.modes import model_modes
from cvxupdate.report import correlate_files, correlate_summary
from cvxupdate.study import correlate, run
from tests.cases.pages import assert_self_contained
from validation import make_bay as BAY

ROOT = Path(__file__).resolve().parents[2]
PLATE = ROOT / "problems" / "structure_a" / "problem.toml"
BRIDGE = ROOT / "problems" / "real" / "smu-modal-data" / "problem_footbridge.toml"
LOSSY = '[model.damping]\nkind = "structural"\neta = 0.01\n'
Z = tuple(f"n{i}.z" for i in (1, 4, 5, 7, 9, 11, 13, 15, 16, 18))


def modes_toml(shapes, frequencies, labels, name="hammer test", use="fit", std=0.002):
    places = [q[1:].split(".") for q in labels]
    channels = "\n".join(
        f'  {{ column = {k}, quantity = "displacement", node = {n}, dof = "{d}" }},'
        for k, (n, d) in enumerate(places)
    )
    rows = "\n".join(
        f"  {{ frequency = {f!r}, frequency_std = {std * f!r}, damping = 0.004, shape = "
        f"{s.tolist()!r} }},"
        for f, s in zip(frequencies.tolist(), shapes.T, strict=True)
    )
    return (
        f'\n[[recordings]]\nkind = "modes"\nname = "{name}"\nuse = "{use}"\nchannels = '
        f"[\n{channels}\n]\nrows = [\n{rows}\n]\n"
    )


def own_modes(which="X1", count=7):
    model = BAY.build(which)
    return model, model_modes(model, count).flexible()


def write(folder, text):
    path = folder / "problem.toml"
    path.write_text('title = "Bay"\n' + text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def itself(tmp_path_factory):
    """The bay against its own modes at ten sensors: scaled, signs turned, in another order, one
    held out; and its own FRFs."""
    folder = tmp_path_factory.mktemp("itself")
    model, modes = own_modes()
    rows = [model.place[q] for q in Z]
    order = [2, 0, 1, 3, 4]
    text = BAY.model_toml("X1", LOSSY)
    text += modes_toml(
        modes.shapes[rows][:, order] * [3.0, -1.0, 0.2, -7.0, 1.0], modes.frequencies[order], Z
    )
    text += modes_toml(
        modes.shapes[rows][:, [5]], modes.frequencies[[5]], Z, "second test", "hold-out"
    )
    f = np.linspace(20.0, 180.0, 161)
    damped = BAY.build("X1", LOSSY)
    BAY.save_frf(folder / "frf.npz", f, BAY.receptance(damped, f, Z[:4], Z[:2]), Z[:4], Z[:2])
    text += (
        '\n[[recordings]]\nkind = "frf"\nname = "shaker test"\nfile = "frf.npz"\nresponse = '
        '"displacement"\n'
    )
    return correlate(write(folder, text))


def test_a_model_against_itself_is_perfect_by_every_measure(itself):
    fit, held = itself.fit["fit"], itself.fit["hold_out"]
    assert (
        fit["frequency_error_percent_max"]["before"] < 1e-6
        and held["frequency_error_percent_max"]["before"] < 1e-6
    )
    assert fit["mac_min"]["before"] == pytest.approx(1.0) and held["mac_min"][
        "before"
    ] == pytest.approx(1.0)
    assert fit["frf_error"]["before"] < 1e-6
    assert all(
        pair["before"] == pair["after"]
        for metrics in itself.fit.values()
        for pair in metrics.values()
    )
    assert [m.mode for m in itself.modes] == [1, 2, 3, 4, 5, 6] and [
        m.number for m in itself.modes
    ] == [1, 2, 3, 4, 5, 1]
    assert all(m.by == "shape" for m in itself.modes)
    first, frf = itself.shapes[0], itself.frfs[0]
    c = first.correlation
    assert np.allclose(c.cross_orthogonality, np.eye(5), atol=1e-7) and np.allclose(c.comac, 1.0)
    assert c.element_balance.imbalance < 1e-5 and first.element_ids.tolist() == list(range(1, 21))
    assert np.allclose(frf.correlation.frac, 1.0)
    assert np.allclose(np.einsum("iij->ij", frf.correlation.fdac), 1.0) and frf.measured.shape == (
        161,
        4,
        2,
    )


def test_sensors_report_rank_and_better_places(itself):
    shapes = next(s for s in itself.sensors if s.recordings == ("hammer test", "second test"))
    assert len(shapes.labels) == 10 and len(shapes.frequency) == 6 and shapes.rank == 6
    assert shapes.alike.shape == (6, 6) and np.allclose(np.diag(shapes.alike), 1.0)
    assert shapes.better_condition is not None and shapes.better_condition <= 1.3 * shapes.condition
    few = next(s for s in itself.sensors if s.recordings == ("shaker test",))
    assert len(few.labels) == 4 and all(f <= 180.0 for f in few.frequency)


@pytest.fixture(scope="module")
def softer(tmp_path_factory):
    """FE1 of the thesis (ten elements 8 % stiff) against the modes and FRFs of X1."""
    folder = tmp_path_factory.mktemp("softer")
    model, modes = own_modes()
    rows = [model.place[q] for q in Z]
    f = np.linspace(20.0, 180.0, 161)
    truth = BAY.build("X1", LOSSY)
    BAY.save_frf(folder / "frf.npz", f, BAY.receptance(truth, f, Z, Z[:1]), Z, Z[:1])
    text = BAY.model_toml("FE1", LOSSY) + modes_toml(modes.shapes[rows], modes.frequencies, Z)
    return correlate(
        write(
            folder,
            text + '\n[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nresponse = "displacement"\n',
        )
    )


def test_a_stiffer_model_has_positive_errors_and_a_ridge_above_the_line(softer):
    assert all(
        0.0 < m.error_percent < 4.0 for m in softer.modes
    )  # E 8 % high in half of the elements: f 0 … 3.9 % high
    assert softer.fit["fit"]["frf_error"]["before"] > 0.5
    frf = softer.frfs[0]
    lines, fdac = frf.correlation.lines, frf.correlation.fdac[:, :, 0]
    for m in softer.modes[
        2:5
    ]:  # at a measured resonance the model's response has that shape at its own
        column = int(np.argmin(np.abs(lines - m.measured)))
        near = np.flatnonzero(np.abs(lines - m.measured) < 12.0)
        assert lines[near[np.argmax(fdac[near, column])]] >= lines[column] - 1e-9
    assert 0.0 < softer.shapes[0].correlation.element_balance.imbalance < 0.2
    changes = softer.shapes[0].correlation.element_balance.stiffness_change
    assert np.sum(changes[[i - 1 for i in BAY.STIFF]] < 0.0) >= 8, (
        "elements that are too stiff should be softened"
    )


@pytest.fixture(scope="module")
def pages(itself, softer):
    return [(compared, *correlate_files(compared)) for compared in (itself, softer)]


def test_page_and_json(pages):
    for compared, files, text in pages:
        page = assert_self_contained(files["report.html"])
        assert (
            len(files["report.html"]) < 1_200_000
            and set(files) == {"result.json", "report.html"}
            and files["result.json"] == text
        )
        for words in (
            "Natural frequencies",
            "Mode shapes",
            "Coordinate MAC",
            "Cross-orthogonality",
            "45° line",
            "FDAC",
            "FRAC",
            "What the sensors can see",
            "Nothing was changed",
        ):
            assert words in page.text, words
        data = json.loads(text)
        assert (data["status"], data["method"], data["parameters"], data["iterations"]) == (
            "converged",
            "correlate",
            [],
            0,
        )
        assert {"problem", "solver", "fit", "certificate", "time", "correlation"} <= set(data)
        assert {"modes", "shapes", "frfs", "sensors"} == set(data["correlation"])
        assert len(data["correlation"]["shapes"][0]["correlation"]["mac"][0]) == len(
            compared.shapes[0].measured_frequency
        )
    assert "in balance with the model" in assert_self_contained(pages[0][1]["report.html"]).text
    assert "out of balance" in assert_self_contained(pages[1][1]["report.html"]).text


def test_same_comparison_same_page(pages):
    compared, files, _ = pages[0]
    assert correlate_files(compared)[0] == files


def test_summary_on_a_terminal(softer, tmp_path):
    from rich.console import Console

    console = Console(record=True, width=100)
    console.print(correlate_summary(softer, tmp_path))
    said = console.export_text()
    assert "mode of the model" in said and "lowest FRAC" in said and "report.html" in said


def test_names_cannot_break_out_of_the_page(tmp_path):
    evil = "<script>alert(1)</script>&'"
    model, modes = own_modes("X1", 3)
    rows = [model.place[q] for q in Z]
    compared = correlate(
        write(
            tmp_path,
            BAY.model_toml("X1") + modes_toml(modes.shapes[rows], modes.frequencies, Z, evil),
        )
    )
    page = assert_self_contained(correlate_files(compared)[0]["report.html"])
    assert "<script" in page.text and "script" not in page.tags


def test_swapped_gaps_and_repeated_channels_are_said(tmp_path):
    model, modes = own_modes()
    rows = [model.place[q] for q in Z]
    f = modes.frequencies[:5].copy()
    f[[2, 3]] = f[[3, 2]]  # the measurement has the shapes of modes 3 and 4 the other way round
    labels = (*Z, Z[0])
    text = BAY.model_toml("X1") + modes_toml(modes.shapes[[*rows, rows[0]]][:, :5], f, labels)
    compared = correlate(write(tmp_path, text))
    page = assert_self_contained(correlate_files(compared)[0]["report.html"])
    assert "are swapped in the model: they are its modes 4 and 3" in page.text
    assert any("1 of 11 channels" in n for n in compared.notes)
    assert [m.mode for m in compared.modes] == [1, 2, 4, 3, 5]


def test_time_histories_become_responses_with_deviations(tmp_path):
    """Two masses under white noise, integrated exactly between samples: resonances ten lines wide,
    so the comparison agrees within 5 %."""
    import scipy.linalg as la

    k, m, c, rate, samples = (
        np.array([[7e5, -3e5], [-3e5, 3e5]]),
        np.diag([6.5, 5.0]),
        np.array([[200.0, -100.0], [-100.0, 100.0]]),
        512.0,
        1 << 15,
    )
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])
    B = np.concatenate([np.zeros(2), np.linalg.solve(m, [1.0, 0.0])])
    E = la.expm(np.block([[A, B[:, None]], [np.zeros((1, 5))]]) / rate)
    force, x, out = (
        np.repeat(np.random.default_rng(4).standard_normal(samples // 4), 4),
        np.zeros(4),
        [],
    )
    for f in force:  # force held between samples
        out.append(x[:2])
        x = E[:4, :4] @ x + E[:4, 4] * f
    np.savez(tmp_path / "noise.npz", force=force, d1=np.array(out)[:, 0], d2=np.array(out)[:, 1])
    (tmp_path / "problem.toml").write_text(
        """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 4e5 }, { id = 2, nodes = [1, 2], k = 3e5 }]
[[model.elements]]
type = "dashpot"
dof = "x"
rows = [{ id = 3, nodes = [1], c = 100.0 }, { id = 4, nodes = [1, 2], c = 100.0 }]
[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 6.5 }, { id = 12, nodes = [2], m = 5.0 }]
[[recordings]]
kind = "time"
file = "noise.npz"
rate = 512.0
band = [5.0, 60.0]
channels = [
  { column = "force", quantity = "force", node = 1, dof = "x" },
  { column = "d1", quantity = "displacement", node = 1, dof = "x" },
  { column = "d2", quantity = "displacement", node = 2, dof = "x" },
]
""",
        encoding="utf-8",
    )
    compared = correlate(tmp_path / "problem.toml")
    (frf,) = compared.frfs
    assert frf.frequency[0] >= 5.0 and frf.frequency[-1] <= 60.0 and frf.variance is not None
    assert "time history" in frf.origin_of
    held = np.exp(-1j * np.pi * frf.frequency / rate)[
        :, None, None
    ]  # a force held for a sample acts half a sample late
    assert np.linalg.norm(frf.model * held - frf.measured) < 0.05 * np.linalg.norm(frf.measured)
    assert np.all(frf.correlation.frac > 0.9)
    assert_self_contained(correlate_files(compared)[0]["report.html"])


def test_nothing_to_compare_is_said(tmp_path):
    with pytest.raises(InputError, match="no recording"):
        correlate(write(tmp_path, BAY.model_toml("X1")))
    np.savez(tmp_path / "free.npz", v=np.random.default_rng(0).standard_normal(4096))
    text = (
        '\n[[recordings]]\nkind = "time"\nfile = "free.npz"\nrate = 100.0\nchannels = [{ column '
        '= "v", quantity = "displacement", node = 1, dof = "z" }]\n'
    )
    with pytest.raises(
        InputError, match=r"none of the recordings can be compared.*no force channel"
    ):
        correlate(write(tmp_path, BAY.model_toml("X1") + text))


def test_quality_of_the_recordings_is_said(tmp_path):
    rng = np.random.default_rng(1)
    force = rng.standard_normal(8192)
    motion = np.convolve(
        force, np.exp(-np.arange(60) / 9.0) * np.sin(np.arange(60)), "same"
    ) + 0.05 * rng.standard_normal(8192)
    np.savez(tmp_path / "t.npz", force=np.clip(force, -1.5, 1.5), z=motion)
    model, modes = own_modes("X1", 3)
    text = BAY.model_toml("X1") + modes_toml(
        modes.shapes[[model.place[q] for q in Z]], modes.frequencies, Z
    )
    text += """
[[recordings]]
kind = "time"
use = "hold-out"
name = "clipped one"
file = "t.npz"
rate = 400.0
channels = [{ column = "force", quantity = "force", node = 1, dof = "z" },
            { column = "z", quantity = "displacement", node = 4, dof = "z" }]
[update]
method = "frequencies"
parameters = [{ elements = "all", of = "E", lower = -0.2, upper = 0.2 }]
"""
    path = write(tmp_path, text)
    for result in (correlate(path), run(path)):
        warnings = [w for w in result.warnings if w.recording == "clipped one"]
        assert any("is clipped" in w.says for w in warnings), result.warnings
        errors = {r.recording: r for r in result.recordings}
        assert errors["clipped one"].metric == "response_error" and len(errors) == 2


# ── real structures
# ──────────────────────────────────────────────────────────────────────────────────────────────


def test_structure_a():
    """Table 9.1 gives no shapes: its pairs are compared by frequency and shown with the model's
    nodal lines."""
    compared = correlate(PLATE)
    assert (
        len(compared.modes) == 20
        and sum(m.use != "fit" for m in compared.modes) == 2
        and not compared.shapes
    )
    assert compared.fit["fit"]["frequency_error_percent_mean"]["before"] == pytest.approx(
        4.37, abs=0.005
    )
    page = assert_self_contained(correlate_files(compared)[0]["report.html"])
    assert (
        "modes measured at 66.60 Hz and 67.70 Hz are swapped" in page.text
        and "no shapes were recorded" in page.text
    )
    assert len(compared.nominal) == 20


@pytest.mark.slow
def test_footbridge(data_folder):
    if not (data_folder / "smu-modal-data").is_dir():
        pytest.skip("smu-modal-data is not under CVXUPDATE_DATA")
    compared = correlate(BRIDGE)
    fit = compared.fit["fit"]
    assert fit["frequency_error_percent_mean"]["before"] == pytest.approx(8.06, abs=0.005)
    assert [m.mode for m in compared.modes] == [2, 1, 3, 4, 5]
    assert [m.mac for m in compared.modes] == pytest.approx(
        [0.97, 0.99, 0.955, 0.97, 0.90], abs=0.0061
    )
    page = assert_self_contained(correlate_files(compared)[0]["report.html"])
    assert (
        "mean frequency error 8.06 %" in page.text
        and "measured at 4.063 Hz and 4.550 Hz are swapped" in page.text
        and "58 sensors" in page.text
    )
    assert np.min(np.diag(compared.shapes[0].correlation.cross_orthogonality)) > 0.97
    assert compared.shapes[0].groups is not None and "noise" in " ".join(compared.notes)
    assert "locate nothing" in page.text


# ── the commands
# ─────────────────────────────────────────────────────────────────────────────────────────────────


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def go(*arguments):
        monkeypatch.setattr(sys, "argv", ["cvxupdate", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return go


def test_correlate_command(call, tmp_path):
    code, out, err = call("correlate", PLATE, "--json", "--out", "here")
    data = json.loads(out)
    assert (
        (code, err) == (0, "")
        and data["problem"] == "structure_a"
        and json.loads((tmp_path / "here" / "result.json").read_text(encoding="utf-8")) == data
    )
    assert sorted(os.listdir(tmp_path / "here")) == ["report.html", "result.json"]
    code, out, err = call("correlate", PLATE)
    assert (
        (code, err) == (0, "")
        and "mean frequency error" in out
        and (tmp_path / "out" / "structure_a" / "correlate" / "report.html").is_file()
    )
    code, out, err = call("correlate", "nowhere.toml")
    assert (
        (code, out) == (2, "")
        and "there is no such file" in err
        and sorted(os.listdir(tmp_path)) == ["here", "out"]
    )


def test_inspect_command(call, tmp_path):
    t = np.arange(4096) / 500.0
    np.savetxt(
        tmp_path / "a.csv",
        np.column_stack([t, np.sin(2 * np.pi * 31.0 * t)]),
        delimiter=",",
        header="Time (s),Acc (g)",
        comments="",
    )
    code, out, err = call("inspect", "a.csv")
    assert (
        (code, err) == (0, "")
        and "500 Hz" in out
        and "lines at 31" in out
        and "[[recordings]]" in out
    )
    code, out, err = call("inspect", "a.csv", "--json")
    data = json.loads(out)
    assert (
        (code, err) == (0, "")
        and data["kind"] == "time"
        and data["rate"] == pytest.approx(500.0)
        and data["channels"][0]["unit"] == "g"
    )
    (tmp_path / "bad.mat").write_bytes(b"not a file of anything\0\1\2")
    for name in ("missing.csv", "bad.mat"):
        code, out, err = call("inspect", name)
        assert (
            (code, out) == (2, "")
            and name in err
            and err.startswith("cvxupdate: ")
            and "Traceback" not in err
        )
    assert sorted(os.listdir(tmp_path)) == ["a.csv", "bad.mat"], "inspect writes nothing"

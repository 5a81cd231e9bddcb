"""`identify`: from recordings to a table of modes that reads back as it is, a page, and clear
refusals."""

import json
import re
import sys
import tomllib

import numpy as np
import pytest
import scipy.linalg

from cvxupdate import cli
from cvxupdate.commands.identify import METHODS, Options, identify
from cvxupdate.errors import InputError
from cvxupdate.recordings.realise import ROUTES
from cvxupdate.report.identify_page import identify_page
from cvxupdate.study import open_problem

STIFFNESS = np.array([9.0, 6.0, 8.0, 5.0]) * 1e5
MASSES = np.array([2.0, 1.5, 1.0, 1.7])
DASHPOT = 120.0
MODEL = """
title = "Four masses"

[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.7 }, { id = 3, x = 1.1 }, { id = 4, x = 2.0 }]

[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 9.0e5 }, { id = 2, nodes = [1, 2], k = 6.0e5 },
        { id = 3, nodes = [2, 3], k = 8.0e5 }, { id = 4, nodes = [3, 4], k = 5.0e5 }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 2.0 }, { id = 12, nodes = [2], m = 1.5 },
        { id = 13, nodes = [3], m = 1.0 }, { id = 14, nodes = [4], m = 1.7 }]
"""
RECORDING = """
[[recordings]]
kind = "frf"
file = "frf.npz"
response = "acceleration"
channels = [
  { column = 0, quantity = "acceleration", node = 1, dof = "x" },
  { column = 1, quantity = "acceleration", node = 2, dof = "x" },
  { column = 2, quantity = "acceleration", node = 3, dof = "x" },
  { column = 3, quantity = "acceleration", node = 4, dof = "x" },
]
references = [{ node = 2, dof = "x" }, { node = 4, dof = "x" }]
"""


def truth():
    """Poles (modes,) of the chain with its dashpot, and its receptances."""
    k = STIFFNESS
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    M, C = np.diag(MASSES), 1e-5 * K + np.diag([0.0, DASHPOT, 0.0, 0.0])
    n = 4
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values = np.linalg.eigvals(A)
    values = values[values.imag > 0]
    lines = np.linspace(20.0, 230.0, 841)
    s = 2j * np.pi * lines
    H = np.array([x**2 * np.linalg.inv(K + x * C + x * x * M)[:, [1, 3]] for x in s])
    return values[np.argsort(np.abs(values))], lines, H, scipy.linalg.eigvalsh(K, M)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with FRFs of a little noise, a problem file, and the recordings alone."""
    monkeypatch.chdir(tmp_path)
    _, lines, H, _ = truth()
    rng = np.random.default_rng(2)
    noise = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    H = H + 0.002 * np.sqrt(np.mean(np.abs(H) ** 2)) * noise
    np.savez("frf.npz", frequency=lines, H=H)
    (tmp_path / "problem.toml").write_text(MODEL + RECORDING, encoding="utf-8")
    (tmp_path / "alone.toml").write_text('title = "Alone"\n' + RECORDING, encoding="utf-8")
    return tmp_path


@pytest.fixture
def call(here, monkeypatch, capsys):
    def go(*arguments):
        monkeypatch.setattr(sys, "argv", ["cvxupdate", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return go


def test_from_frfs_to_a_table_that_reads_back(call, here):
    code, out, _ = call("identify", "problem.toml", "--out", "o", "--normal", "all", "--order", 24)
    assert code == 0 and "4 modes" in out
    poles = truth()[0]
    data = json.loads((here / "o/result.json").read_text())
    (found,) = data["sets"]
    f = np.array([m["frequency"] for m in found["modes"]])
    sd = np.array([m["frequency_std"] for m in found["modes"]])
    assert np.all(np.abs(f - np.abs(poles) / (2 * np.pi)) < 5.0 * sd)
    assert data["status"] == "converged" and data["method"] == "identify"
    (here / "o/pasted.toml").write_text(MODEL + (here / "o/recordings.toml").read_text())
    _, _, (table,) = open_problem(here / "o/pasted.toml")
    assert np.allclose(table.frequency, f, rtol=1e-9)
    assert np.allclose(table.damping, [m["damping"] for m in found["modes"]], rtol=1e-9)
    shapes = np.array([[e["re"] + 1j * e["im"] for e in m["shape"]] for m in found["modes"]])
    assert np.allclose(table.shapes, shapes, atol=1e-9)
    assert [c.label for c in table.channels] == found["channels"]


def test_the_damping_that_a_model_may_begin_with_is_read_as_it_was_measured(call, here):
    """Three forms in one block: the first holds, the others are comments that hold once free."""
    code, _, _ = call("identify", "problem.toml", "--out", "o", "--order", 24)
    assert code == 0
    (found,) = json.loads((here / "o/result.json").read_text())["sets"]
    w = np.array([2 * np.pi * m["frequency"] for m in found["modes"]])
    zeta = np.array([m["damping"] for m in found["modes"]])
    text = (here / "o/damping.toml").read_text()
    given = tomllib.loads(text)["model"]["damping"]
    A = np.column_stack([0.5 / w, 0.5 * w])
    best = np.linalg.lstsq(A, zeta, rcond=None)[0]
    assert np.all(best > 0.0)
    assert [given["alpha"], given["beta"]] == pytest.approx(best.tolist(), rel=1e-5)
    freed = text.replace("# kind", "kind").replace("# eta", "eta").replace("# zeta", "zeta")
    forms = [tomllib.loads(part) for part in freed.split("\n\n")]
    assert forms[1]["eta"] == pytest.approx(2.0 * zeta.mean(), rel=1e-5)
    assert forms[2]["zeta"] == pytest.approx(zeta.tolist(), rel=1e-3)
    own = MODEL.partition("[model.damping]")[0]
    (here / "o/damped.toml").write_text(own + text + (here / "o/recordings.toml").read_text())
    assert open_problem(here / "o/damped.toml")[0].model.damping.kind == "rayleigh"


def test_normal_modes_are_those_of_the_undamped_chain(here):
    (found,) = identify("problem.toml", Options(normal="ibrahim", order=24)).sets
    (normal,) = found.normal
    wanted = np.sqrt(truth()[3]) / (2 * np.pi)
    assert np.allclose(normal.frequency, wanted, rtol=1e-3)
    assert np.max(np.abs(found.frequency - wanted)) > 3 * np.max(np.abs(normal.frequency - wanted))


def test_modes_that_were_not_measured_are_filled_up_with_the_models(here):
    """Two of the chain's four modes: the other two are its model's, which the problem file has."""
    low = Options(normal="ibrahim-fill", order=24, band=(25.0, 125.0))
    (found,) = identify("problem.toml", low).sets
    (normal,) = found.normal
    wanted = np.sqrt(truth()[3]) / (2 * np.pi)
    assert normal.says == "" and len(normal.frequency) == 2
    assert np.allclose(normal.frequency, wanted[:2], rtol=1e-3)
    (alone,) = identify("alone.toml", low).sets
    assert "give a problem file" in alone.normal[0].says


@pytest.mark.parametrize("method", [m for m in METHODS if m != "ssi"])
def test_every_method_finds_the_modes(here, method):
    (found,) = identify("problem.toml", Options(method=method, order=30)).sets
    assert np.allclose(found.frequency, np.abs(truth()[0]) / (2 * np.pi), rtol=0.01)


def test_recordings_alone_and_a_raw_file(call, here):
    names = [identify(p, Options(order=24)).sets[0] for p in ("alone.toml", "frf.npz")]
    for found in names:
        assert np.allclose(found.frequency, np.abs(truth()[0]) / (2 * np.pi), rtol=1e-3)
    code, out, _ = call("identify", "frf.npz", "--json", "--order", 24)
    assert code == 0 and len(json.loads(out)["sets"]) == 1
    assert (here / "out/frf/identify/modes.csv").is_file()


def test_the_page_moves_the_shapes_and_runs_no_script(here):
    found = identify("problem.toml", Options(order=24, normal="all"))
    page = identify_page(found)
    assert page.count("<animate ") == 2 * 4 and "<script" not in page
    assert "Stabilisation diagram" in page and "zhang-lallement" in page
    assert "cvxupdate identify --normal all --order 24 problem.toml" in page
    assert len(re.findall("<svg", page)) >= 7
    # several routes: one table of what they do, each by itself behind its name
    assert page.count("<details>") == page.count("<summary>") == len(ROUTES)
    assert page.count("Largest shift") == 1
    alone = identify_page(identify("problem.toml", Options(order=24, normal="simple")))
    assert "<details>" not in alone and "Largest shift" not in alone


def test_a_channel_of_force_and_motion(here):
    """A time history with its force: FRFs by local polynomials, then modes."""
    poles = truth()[0]
    rate, n = 512.0, 8192
    rng = np.random.default_rng(3)
    force = rng.standard_normal(n)
    f = np.fft.rfftfreq(n, 1 / rate)
    s = 2j * np.pi * f
    k = STIFFNESS
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    C = 1e-5 * K + np.diag([0.0, DASHPOT, 0.0, 0.0])
    G = np.array([x**2 * np.linalg.inv(K + x * C + x * x * np.diag(MASSES))[:, 1] for x in s])
    motion = np.fft.irfft(G * np.fft.rfft(force)[:, None], n, axis=0)
    np.savetxt(here / "t.csv", np.column_stack([force, motion]), delimiter=",")
    rows = "\n".join(
        f'  {{ column = {k}, quantity = "{q}", node = {node}, dof = "x" }},'
        for k, (q, node) in enumerate([("force", 2), *[("acceleration", i) for i in (1, 2, 3, 4)]])
    )
    (here / "time.toml").write_text(
        f'[[recordings]]\nkind = "time"\nfile = "t.csv"\nrate = {rate}\nchannels = [\n{rows}\n]\n'
    )
    (found,) = identify("time.toml", Options(order=24, band=(20.0, 230.0))).sets
    assert found.kind == "time"
    assert np.allclose(found.frequency, np.abs(poles) / (2 * np.pi), rtol=5e-3)
    (alone,) = identify("time.toml", Options(method="ssi", order=24, band=(20.0, 230.0))).sets
    assert alone.kind == "ambient" and "left aside" in " ".join(alone.notes)
    assert all(
        np.abs(alone.frequency - f).min() < 0.02 * f for f in np.abs(poles[1:]) / (2 * np.pi)
    )
    assert "cross spectra" in identify_page(identify("time.toml", Options(method="ssi")))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("problem.toml", "--method", "prony"), "no method 'prony'.*plscf"),
        (("problem.toml", "--band", "90", "20"), "no band"),
        (("problem.toml", "--band", "400", "500"), "too few"),
        (("problem.toml", "--band", "400", "500"), "cvxupdate: frf.npz: [^:]*$"),  # named once
        (("problem.toml", "--recording", "7"), "no recording '7'.*1 frf.npz"),
        (("problem.toml", "--normal", "best"), "no route.*zhang-lallement"),
        (("nothing.csv",), "nothing.csv"),
        (("problem.toml", "--order", "1"), "too low"),
    ],
)
def test_a_refusal_is_one_clear_message(call, here, arguments, says):
    code, out, error = call("identify", *arguments)
    assert code == 2 and out == ""
    assert re.search(says, error) and "Traceback" not in error
    assert not (here / "out").exists()


def test_a_file_without_a_rate_asks_for_it(here):
    np.savetxt(here / "t.csv", np.random.default_rng(0).standard_normal((500, 2)), delimiter=",")
    with pytest.raises(InputError, match="--rate"):
        identify(here / "t.csv")

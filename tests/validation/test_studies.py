"""Every study runs at its smallest, leaves its figures in the folder it was given, and shows there
already what it is quoted for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from validation.studies.__main__ import listed, main, names, perform
from validation.studies.rfm_accuracy import rank_correlation
from validation.studies.wish import Wish

ROOT = Path(__file__).resolve().parents[2]
QUICK = Wish(quick=True)
ON_DATA = {
    "footbridge_front": "smu-modal-data",
    "modal_starts": "smu-modal-data",
    "silverbox_sindy": "silverbox",
}
DATA = Path(os.environ.get("CVXUPDATE_DATA", ""))


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")


def check_ceam_table(rows):
    found = {(r["case"], r["file"]): r for r in rows}
    assert {r["status"] for r in rows} == {"converged"}
    assert found[1, "problem.toml"]["after"] < 1e-6 and found[1, "rfm.toml"]["after"] < 1e-4
    assert found[4, "problem.toml"]["right"] == 10 and found[4, "problem.toml"]["away"] < 1e-6


def check_ceam_cases(rows):
    assert [r[0] for r in rows] == [4]
    assert all(
        status == "converged" and after < 0.1 * before for _, status, _, _, before, after in rows
    )


def check_ranking(results):
    assert results["two bays", "good", 0.0]["SEREPa"] < results["two bays", "good", 0.0]["SEREP"]


def check_accuracy(found):
    guess, known, errors, drowned = found
    alike = rank_correlation(guess.log_function, known.log_function)
    assert alike > 0.6  # the model alone tells which lines are best
    assert all(0.0 < e < 0.1 for both in errors.values() for e in both["auto"])
    assert drowned[-1][1] == pytest.approx(-1.0, abs=0.05)  # (5.30): noise takes the model away


def check_bay_noise(found):
    ((level, rows),) = found.items()
    errors = {name: float(mean) for _, name, _, mean, *_ in rows}
    assert level == 0.02
    assert errors["tikhonov (5 % prior)"] < errors["none"] < errors["plain SVD"]


def check_nothing_given(found):
    assert found is None


def check_iterations(found):
    ((_, variants),) = found.items()
    assert all(ok and away < 1e-6 for name, (_, ok, away) in variants.items() if "convex" in name)


def check_noise_in_a(found):
    (methods,) = found.values()
    size = {name: float(np.linalg.norm(p)) for name, p in methods.items()}
    assert set(size) == set(methods) and all(np.isfinite(v) for v in size.values())


def check_regularisation(found):
    assert max(found[0.0]["LLS"]) < 1e-6  # without noise every method is exact
    assert np.mean(found[1e-3]["TSVD (best level)"]) < np.mean(found[1e-3]["LLS"])


def check_mesh(results):
    assert len(results) == 2
    assert all(updated.status == "converged" for updated, _ in results.values())


def check_strings(results):
    error = {
        name: u.fit["fit"]["frequency_error_percent_mean"]["after"] for name, u in results.items()
    }
    assert min(error, key=error.get) == "middle of the short edges"


def check_domains(found):
    domains, _ = found
    same, other = domains["X1"], domains["X2"]
    assert same[0] < 1e-9 < 1e-5 < other[0]  # a second solution only where the target is one's own
    assert same[1] < 1e-8 and other[2] < 1e-9  # of another structure p = -1 alone is left
    assert same[3] < 1e-9


def check_chapter4(found):
    rows, sweeps = found
    at = {(title, name): (p, seen) for title, name, p, seen, *_ in rows}
    first = "chain, 10 %: truncated SVD, n_t (Fig. 4.3)"
    assert at[first, "17"][0] < at[first, "21"][0]  # truncation pays
    assert np.median(sweeps["landweber"]) > 10 * np.median(sweeps["conjugate gradients"])


def check_conditions(found):
    rows, printed = found
    _, one, _, _, _, away, _, left, _, _ = rows[0]
    assert one < 1e-2 and away < 1e-2 and left < 1e-4  # case 1: near the truth, by the series
    assert rows[-1][2] < 1e-3 and rows[-1][6] < 1e-3 and rows[-1][8] < 1e-6  # case 2: near -1
    assert max(row[9] for row in rows) < 1e-5  # (5.30) at every size
    assert printed[0.0][0][0] < 1e-6 and printed[0.001][0][2]


def check_plates(found):
    updated, error, seen = found["A", False]
    assert updated.status == "converged" and len(updated.parameters) == 140
    assert error[1] < 0.5 * error[0] and seen[1] < 0.5 * seen[0]


def check_starts(found):
    for (start,), minima, there in found.values():
        assert start.status == "converged" and len(minima) == 1 and len(there) == 1
    assert found["concrete frame"][2] == [True]


def check_front(found):
    for points in found.values():
        (error, mean, _, _), (after, kept, _, held) = points.values()
        assert error > 8.0 and mean > 0.955 and after < 0.5 and kept < 0.945 and held < 17


def check_sindy(found):
    error = {name: mv for name, (_, _, mv) in found.items()}
    assert error["weak"] < 1.0 < error["strong"] < error["usual"]
    (_, weak, _) = found["weak"]
    cubes = weak.coefficients[1][np.all(weak.powers == (3, 0, 0), axis=1)]
    assert len(cubes) == 1 and cubes[0] < 0.0  # y'' = … − y³: it hardens


CHECKS = {
    "ceam_cases": check_ceam_cases,
    "ceam_domains": check_domains,
    "ceam_table_6_2": check_ceam_table,
    "expansion_ranking": check_ranking,
    "footbridge_front": check_front,
    "modal_starts": check_starts,
    "plates_rfm": check_plates,
    "rfm_accuracy": check_accuracy,
    "rfm_bay_noise": check_bay_noise,
    "rfm_chapter3": check_nothing_given,
    "rfm_chapter4": check_chapter4,
    "rfm_conditions": check_conditions,
    "rfm_iterations": check_iterations,
    "rfm_noise_in_a": check_noise_in_a,
    "rfm_regularisation": check_regularisation,
    "silverbox_sindy": check_sindy,
    "structure_a_mesh": check_mesh,
    "structure_a_strings": check_strings,
}


@pytest.mark.parametrize("name", names())
def test_quick_look(name, tmp_path, monkeypatch, capsys):
    if name in ON_DATA and not (DATA / ON_DATA[name]).is_dir():
        pytest.skip(f"needs the data set {ON_DATA[name]} under CVXUPDATE_DATA")
    if name == "silverbox_sindy":
        pytest.importorskip("pysindy", reason="needs pysindy (the extra 'bench')")
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "results"
    found = perform(name, out, QUICK)
    figures = [p for p in out.rglob("*") if p.suffix in (".png", ".svg")]
    assert figures and all(p.stat().st_size > 2000 for p in figures)
    assert capsys.readouterr().out.strip()
    assert not (tmp_path / "out").exists(), "the folder given was not honoured"
    CHECKS[name](found)


def test_list_and_faults(capsys):
    assert set(CHECKS) == set(names())
    main([])
    assert capsys.readouterr().out.strip() == listed()
    assert [line.split()[0] for line in listed().splitlines()] == names()
    with pytest.raises(SystemExit):
        main(["no_such_study"])


def test_as_a_command(tmp_path):
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "validation.studies",
            "structure_a_mesh",
            "--quick",
            "--out",
            str(tmp_path),
        ],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=300,
        env={**os.environ, "MPLBACKEND": "agg"},
    )
    assert done.returncode == 0, done.stderr
    assert "held out %" in done.stdout
    assert (tmp_path / "structure_a_mesh" / "mesh.png").stat().st_size > 2000

"""An effect from outside the package: one class and its place in the registry, and `cvxupdate
diagnose` finds it, sizes it, says it and writes it. (To add one for good: its file, its line in
cvxupdate/physics/__init__.py, its instance in tests/cases/effects.py.)"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

import cvxupdate.physics
from cvxupdate.cli import main
from cvxupdate.fe.build import build_model
from cvxupdate.spec import load_problem
from tests.cases.elements import nodes, toml
from tests.cases.toy_effect import Foundation

SPRINGS, MASSES = (6.0e4, 4.0e4, 5.2e4, 3.1e4), (2.0, 1.4, 1.1, 1.7)
SENSORS = (1, 2, 4)
ZETA, NOISE = 0.005, 1e-3
LINES = np.arange(5.0, 75.0, 0.1)
CHAIN: dict[str, Any] = {
    "dofs": ["x"],
    "nodes": nodes([(float(i), 0.0, 0.0) for i in range(4)]),
    "elements": [
        {
            "type": "spring",
            "dof": "x",
            "rows": [
                {"id": i, "nodes": [i - 1, i][i < 2 :], "k": k, "group": f"spring {i}"}
                for i, k in enumerate(SPRINGS, 1)
            ],
        },
        {
            "type": "mass",
            "rows": [
                {"id": 10 + i, "nodes": [i], "m": m, "group": "floors"}
                for i, m in enumerate(MASSES, 1)
            ],
        },
    ],
    "damping": {"kind": "modal", "zeta": ZETA},
}


def laboratory(folder: Path, stiffer: float, heavier: float) -> Path:
    """A problem file of the chain, and FRFs of one with springs under every floor and masses at
    every accelerometer, by dense inversion, with noise; one recording is held out."""
    a, b, c, d = SPRINGS
    K = np.array([[a + b, -b, 0, 0], [-b, b + c, -c, 0], [0, -c, c + d, -d], [0, 0, -d, d]])
    K = K + stiffer * np.eye(4)
    M = np.diag([m + heavier * (i in SENSORS) for i, m in enumerate(MASSES, 1)])
    lam, phi = eigh(K, M)
    C = M @ phi @ np.diag(2 * ZETA * np.sqrt(lam)) @ phi.T @ M
    s = 2j * np.pi * LINES[:, None, None]
    H: NDArray[np.complex128] = s**2 * np.linalg.inv(s**2 * M + s * C + K)
    text = f"model = {toml(CHAIN)}\n"
    for use, reference in (("fit", 4), ("hold-out", 1)):
        seen = H[:, [n - 1 for n in SENSORS]][:, :, [reference - 1]]
        std = NOISE * np.sqrt(np.mean(np.abs(seen) ** 2, axis=0, keepdims=True))
        std = std * np.ones(seen.shape)
        rng = np.random.default_rng(reference)
        wave = rng.normal(size=seen.shape) + 1j * rng.normal(size=seen.shape)
        np.savez(
            folder / f"{use}.npz",
            frequency=LINES,
            H=seen + std * wave / np.sqrt(2),
            variance=std**2,
            response_node=SENSORS,
            response_dof=[1] * len(SENSORS),
            reference_node=[reference],
            reference_dof=[1],
        )
        text += f'[[recordings]]\nkind = "frf"\nuse = "{use}"\nfile = "{use}.npz"\n'
        text += 'response = "acceleration"\n'
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


def diagnosed(path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """diagnosis.json of the command."""
    out = path.parent / "out"
    monkeypatch.setattr(sys, "argv", ["cvxupdate", "diagnose", str(path), "--out", str(out)])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 0
    found: dict[str, Any] = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    return found


def test_an_effect_from_outside_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = laboratory(tmp_path, stiffer=4.1e3, heavier=0.0)
    monkeypatch.setattr(cvxupdate.physics, "EFFECTS", (*cvxupdate.physics.EFFECTS, Foundation()))
    found = diagnosed(path, monkeypatch)
    (finding,) = found["findings"]
    assert finding["physics"] == "elastic_foundation"
    assert finding["parameters"]["k"] == pytest.approx(4.1e3, rel=0.02)
    assert found["says"].startswith("Every node stands on a spring of 4.")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "A soft foundation in the whole structure" in page
    again = build_model(load_problem(tmp_path / "out" / "updated" / "problem.toml"))
    grounded = again.matrices().K.sum(axis=0)[1:]  # what a row of K does not hand on to others
    np.testing.assert_allclose(grounded, finding["parameters"]["k"], rtol=1e-9)


def test_the_mass_of_the_accelerometers_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = diagnosed(laboratory(tmp_path, stiffer=0.0, heavier=0.12), monkeypatch)
    (finding,) = found["findings"]
    assert finding["physics"] == "sensor_mass" and finding["location"]["nodes"] == []
    assert finding["parameters"]["m"] == pytest.approx(0.12, rel=0.05)
    again = load_problem(tmp_path / "out" / "updated" / "problem.toml")
    rows = [row for block in again.model.elements for row in block.rows]
    lumps = [row for row in rows if (row.group or "").startswith("accelerometer")]
    assert [row.nodes for row in lumps] == [(n,) for n in SENSORS]

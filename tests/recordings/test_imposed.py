"""Imposed motions as forces on their bases, whatever quantity was recorded."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.fe.build import on_its_bases
from cvxupdate.recordings.load import load_recordings
from cvxupdate.spec import read_text
from tests.cases.shaking_table import FLOORS, structure

RATE, F = 200.0, 7.0


def loaded(tmp_path: Path, text: str):
    spec = on_its_bases(read_text(structure() + text, tmp_path / "problem.toml"))
    return load_recordings(spec)[0], spec


def history(quantity: str) -> str:
    return f"""[[recordings]]
kind = "time"
rate = {RATE}
file = "run.csv"
channels = [
  {{ column = 0, quantity = "{quantity}", node = 1, dof = "x", imposed = true }},
  {{ column = 1, quantity = "acceleration", node = 1, dof = "x" }},
]
corrections = [{{ node = 1, dof = "x", quantity = "force", gain = 2.0 }}]
"""


@pytest.mark.parametrize(
    ("quantity", "order"), [("acceleration", 0), ("velocity", 1), ("displacement", 2)]
)
def test_a_record_becomes_a_force(tmp_path: Path, quantity: str, order: int) -> None:
    t = np.arange(800) / RATE
    x = (np.exp(2j * np.pi * F * t) / (2j * np.pi * F) ** order).real
    np.savetxt(tmp_path / "run.csv", np.column_stack([x, x]), delimiter=",")
    run, spec = loaded(tmp_path, history(quantity))
    assert [c.quantity for c in run.channels] == ["force", "acceleration"]
    force = run.data[:, 0] / spec.model.bases[0].mass
    assert force[10:-10] == pytest.approx(np.cos(2 * np.pi * F * t)[10:-10] / 2.0, abs=2e-4)
    assert run.data[:, 1] == pytest.approx(x)


def test_transmissibilities_become_receptances(tmp_path: Path) -> None:
    f = np.array([0.0, 2.0, 5.0])
    T = (1.0 + np.arange(9).reshape(3, 3)) * (1.0 + 0.5j)
    kinds = (("displacement", 2), ("velocity", 1), ("acceleration", 0))
    for quantity, order in kinds:
        np.savez(
            tmp_path / "run.npz",
            frequency=f,
            H=T[:, :, None],
            variance=np.ones((3, 3, 1)),
            response_node=np.array(FLOORS),
            response_dof=np.ones(3),
        )
        frf, spec = loaded(
            tmp_path,
            '[[recordings]]\nkind = "frf"\nfile = "run.npz"\nresponse = "acceleration"\n'
            f'references = [{{ node = 1, dof = "x", quantity = "{quantity}" }}]\n',
        )
        keep = slice(1 if order else 0, None)
        factor = (2j * np.pi * f[keep, None]) ** order * spec.model.bases[0].mass
        assert frf.references[0].quantity == "force" and np.all(frf.frequency == f[keep])
        assert frf.H[:, :, 0] * factor == pytest.approx(T[keep])
        assert frf.variance[:, :, 0] * np.abs(factor) ** 2 == pytest.approx(
            1.0 + 0.0 * T.real[keep]
        )


def test_a_base_without_a_mass_leaves_the_channel_and_a_short_record_is_refused(
    tmp_path: Path,
) -> None:
    np.savetxt(tmp_path / "run.csv", np.zeros((5, 2)), delimiter=",")
    _, spec = loaded(tmp_path, history("acceleration"))
    with pytest.raises(RecordingError, match="5 samples are too few"):
        loaded(tmp_path, history("displacement"))
    bare = spec.model.model_copy(update={"bases": ()})
    plain = dataclasses.replace(
        spec, model=bare, recordings=(spec.recordings[0].model_copy(update={"corrections": ()}),)
    )
    assert [c.quantity for c in load_recordings(plain)[0].channels] == ["acceleration"] * 2

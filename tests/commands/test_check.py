"""`check` says what is held, and what moves free of strain: by a look at it a support at the wrong
node, a missing one and a loose mass are seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import coo_array

from cvxupdate.commands.view import view
from cvxupdate.correlate.plausible.recorded import recorded
from cvxupdate.errors import ProblemFileError
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.report.checked import MOST, check_lines
from cvxupdate.spec.model import Base
from cvxupdate.study import check
from tests.commands.test_plan import BEAM

OWN = """
[model]
dofs = ["x"]
[[model.elements]]
type = "matrix"
rows = [{ id = 1, labels = ["n1.x", "n2.x", "n3.x", "n4.x"], stiffness = "K.mtx", mass = "M.mtx" }]
"""
NAMED = "n3.x, n4.x have mass but no stiffness: nothing holds what is there"


def lines(text: str, folder: Path) -> list[str]:
    path = folder / "p.toml"
    path.write_text(text, encoding="utf-8")
    return check_lines("p", check(path))


@pytest.mark.parametrize(
    ("supports", "says"),
    [
        ('[{ nodes = [1], dofs = ["y", "rz"] }]', ["Held: node 1 (y, rz)."]),
        (
            '[{ nodes = [5, 1], dofs = ["y"] }, { nodes = [1], dofs = ["x", "rz"] }]',
            ["Held: node 5 (y); node 1 (y, rz)."],  # x is not active
        ),
        ('[{ nodes = [2, 1], dofs = ["y", "z"] }]', ["Held: nodes 1, 2 (y)."]),
    ],
)
def test_what_is_held_is_said(tmp_path: Path, supports: str, says: list[str]) -> None:
    text = BEAM.replace('[{ nodes = [1], dofs = ["y", "rz"] }]', supports)
    assert (supports in text) and lines(text, tmp_path)[2:] == says


def test_long_lists_are_cut_short() -> None:
    said = check_lines(
        "p",
        {
            **dict.fromkeys(("nodes", "elements", "free DOFs", "recordings", "parameters"), 1),
            "warnings": [],
            "mass": 1.0,
            "extent": [],
            "frequencies": [],
            "free": [],
            "moved": [],
            "states": {},
            "recorded": [],
            "inertia": {},
            "held": [
                {"nodes": list(range(1, MOST + 4)), "dofs": ["x"]},
                {"nodes": "all", "dofs": ["z"]},
            ],
        },
    )[2]
    assert said.endswith(f", {MOST} and 3 more (x); all nodes (z).")


def test_states_and_what_moves_are_said() -> None:
    summary = {
        **dict.fromkeys(("nodes", "elements", "free DOFs", "recordings", "parameters"), 3),
        "warnings": [],
        "mass": 0.0,
        "inertia": {"rx": 2.45},
        "extent": [],
        "frequencies": [],
        "free": [],
        "held": [],
        "moved": [{"nodes": [1, 2], "dofs": ["x"]}],
        "states": {"reference": 2, "": 1},
        "recorded": [],
    }
    said = check_lines("p", summary)
    assert said[1:] == [
        "Total inertia 2.45 kg·m² (rx).",
        "Moved as recorded: nodes 1, 2 (x).",
        "States of the structure: reference (2 recordings), none named (1 recording).",
    ]
    other = check_lines("p", {**summary, "states": {"healthy": 1, "after": 2}})
    assert other[-1].endswith('none is "reference", which the model describes.')


def test_a_table_moves_a_model_that_it_holds(tmp_path: Path) -> None:
    """It is no free structure; and a force where it is held moves nothing, nor does what has no
    input at all."""
    (tmp_path / "a.csv").write_text("\n".join(f"{np.sin(k)},{np.cos(k)}" for k in range(400)))
    table = """
[[recordings]]
kind = "time"
file = "a.csv"
rate = 100.0
begins = "at-rest"
channels = [
  { column = 0, quantity = "FIRST", node = 1, dof = "y" REST },
  { column = 1, quantity = "acceleration", node = 2, dof = "y" },
]
"""
    moved = table.replace("FIRST", "acceleration").replace("REST", ", imposed = true")
    said = lines(BEAM + moved, tmp_path)
    assert "Moved as recorded: node 1 (y)." in said
    assert "a.csv: 4 s at 100 Hz: imposed motion at n1.y; acceleration at n2.y." in said
    leveled = lines(BEAM + moved.replace("rate", "level = 2.5\nrate"), tmp_path)
    assert any(line.startswith("a.csv: 4 s at 100 Hz, level 2.5: ") for line in leveled)
    assert not any("rigid body" in line for line in said)
    pushed = lines(BEAM + table.replace("FIRST", "force").replace("REST", ""), tmp_path)
    assert sum("where a support holds the model" in line for line in pushed) == 1
    quiet = lines(BEAM + table.replace("FIRST", "acceleration").replace("REST", ""), tmp_path)
    assert sum("neither a force nor an imposed motion" in line for line in quiet) == 1


@pytest.mark.parametrize("state", ["Reference", " reference", "REFERENCE"])
def test_a_state_that_is_nearly_the_reference_is_a_fault(tmp_path: Path, state: str) -> None:
    table = f'''
[[recordings]]
kind = "modes"
state = "{state}"
rows = [{{ frequency = 10.0 }}]
'''
    with pytest.raises(ProblemFileError, match='Write state = "reference"'):
        lines(BEAM + table, tmp_path)


def test_a_free_structure_is_in_order_and_said_to_be_free(tmp_path: Path) -> None:
    free = BEAM.replace('supports = [{ nodes = [1], dofs = ["y", "rz"] }]\n', "")
    assert free != BEAM
    said = lines(free, tmp_path)
    assert "in order" in said[0] and len(said) == 3
    assert said[2].startswith(
        "The model moves as a rigid body in 2 ways: right for a structure that"
    )
    assert not any("rigid body" in line for line in lines(BEAM, tmp_path))


@pytest.mark.parametrize(
    ("pair", "says"),
    [
        (
            [[9e4, -9e4], [-9e4, 9e4]],
            [NAMED, "The model moves without strain in 1 way: right for a structure that hangs"],
        ),
        ([[0.0, 0.0], [0.0, 0.0]], [f"n1.x, n2.x, {NAMED}"]),
        ([[9.5e4, -9e4], [-9e4, 9e4]], [NAMED]),
    ],
)
def test_masses_without_stiffness_are_named(
    tmp_path: Path, pair: list[list[float]], says: list[str]
) -> None:
    """In `check` and in `view`."""
    K = np.zeros((4, 4))
    K[:2, :2] = pair
    mmwrite(tmp_path / "K.mtx", coo_array(K))
    mmwrite(tmp_path / "M.mtx", coo_array(np.diag([2.0, 3.0, 4.0, 5.0])))
    said = lines(OWN, tmp_path)[2:]
    assert [a.startswith(b) for a, b in zip(said, says, strict=True)] == [True] * len(says)
    notes = view(tmp_path / "p.toml").notes
    assert [f"{n}." for n in notes] == said


def test_each_recording_is_said_with_its_channels() -> None:
    summary = {
        "recorded": [
            {"name": "a.csv", "use": "fit", "holds": "3 modes", "channels": {}},
            {
                "name": "b.npz",
                "use": "hold-out",
                "holds": "9 lines from 1 to 9 Hz",
                "channels": {"acceleration": ["n1.x", "n2.x"], "per force": ["n1.x"]},
            },
            *[{"name": "c", "use": "fit", "holds": "1 s at 9 Hz", "channels": {}}] * 6,
        ]
    }
    whole = {k: 0 for k in ("nodes", "elements", "free DOFs", "recordings", "parameters")}
    other = {"warnings": [], "mass": None, "extent": (), "frequencies": (), "inertia": {}}
    rest = {"held": [], "moved": [], "states": {}, "free": []}
    lines = check_lines("p", {**whole, **other, **rest, **summary})
    assert "a.csv: 3 modes." in lines
    both = "acceleration at n1.x, n2.x per force at n1.x"
    assert f"b.npz, held out: 9 lines from 1 to 9 Hz: {both}." in lines
    assert lines[-1] == "And 2 more recordings."


def test_a_transmissibility_is_per_the_motion_that_is_imposed() -> None:
    """It was read as a response to the force that the base takes; its author knows of none."""
    f = np.linspace(1.0, 9.0, 9)
    H = np.ones((9, 1, 1), dtype=complex)
    heard, force = Channel(2, "x", "acceleration"), Channel(1, "x", "force")
    frf = FrequencyResponse(Origin("t.npz", "t.npz"), f, H, "acceleration", (heard,), (force,))
    base = Base(nodes=(1,), dof="x", mass=1e3)
    (said,) = recorded([frf], [base])
    assert said["channels"] == {"acceleration": ["n2.x"], "per imposed motion": ["n1.x"]}
    (said,) = recorded([frf])
    assert said["channels"] == {"acceleration": ["n2.x"], "per force": ["n1.x"]}

"""Motion as input, as text: bases from imposed motions, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import ProblemFileError
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.build import build_model
from cvxupdate.spec import read_text
from cvxupdate.spec.bases import on_bases
from cvxupdate.spec.write import tables_of, to_toml
from tests.cases.shaking_table import structure

TIME = """[[recordings]]
kind = "time"
rate = 100.0
file = "run.csv"
channels = [
  { column = 0, quantity = "acceleration", node = 5, dof = "x", imposed = true },
  { column = 1, quantity = "acceleration", node = 3, dof = "x" },
]
"""
FRF = """[[recordings]]
kind = "frf"
file = "run.csv"
frequency_column = 0
references = [{ node = 1, dof = "x", quantity = "displacement" }]
channels = [{ column = 1, quantity = "displacement", node = 3, dof = "x" }]
"""


def read(tmp_path: Path, text: str):
    np.savetxt(tmp_path / "run.csv", np.zeros((4, 2)), delimiter=",")
    return read_text(text, tmp_path / "problem.toml")


@pytest.mark.parametrize(("recording", "first"), [(TIME, 5), (FRF, 1)])
def test_all_feet_move_with_an_imposed_one(tmp_path: Path, recording: str, first: int) -> None:
    spec = on_bases(read(tmp_path, structure() + recording))
    (base,) = spec.model.bases
    assert base.nodes[0] == first and set(base.nodes) == {1, 5} and base.dof == "x"
    assert {(s.nodes, s.dofs) for s in spec.model.supports} == {((n,), ("y", "rz")) for n in (1, 5)}
    assert on_bases(spec) == spec, "nothing more to do"
    again = read_text(to_toml(tables_of(spec)), tmp_path / "again.toml")
    assert again.model.bases == spec.model.bases


def test_a_node_that_nothing_holds_moves_alone_and_a_base_says_otherwise(tmp_path: Path) -> None:
    free = on_bases(read(tmp_path, structure() + TIME.replace("node = 5", "node = 6")))
    assert [b.nodes for b in free.model.bases] == [(6,)]
    assert free.model.supports == read(tmp_path, structure()).model.supports
    own = '[[model.bases]]\nnodes = [5]\ndof = "x"\nmass = 1e9\n'
    given = on_bases(read(tmp_path, structure() + own + TIME))
    assert [(b.nodes, b.mass) for b in given.model.bases] == [((5,), 1e9)]
    assert (1,) in [s.nodes for s in given.model.supports if "x" in s.dofs]
    assert on_bases(read(tmp_path, structure())) == read(tmp_path, structure())


BASE = '[[model.bases]]\nnodes = [1, 5]\ndof = "x"\n'
WRONG = [
    (TIME.replace('"acceleration", node = 5', '"force", node = 5'), "is said of a force"),
    (TIME.replace('dof = "x", imposed', 'dof = "rz", imposed'), "imposes a rotation (rz)"),
    (TIME.replace("node = 3, dof", "node = 1, imposed = true, dof"), "which has one motion"),
    (
        FRF.replace('node = 3, dof = "x"', 'node = 3, dof = "x", imposed = true'),
        "is said of a channel of kind frf",
    ),
    (BASE.replace("5", "77"), "node 77 stands on a base, but does not exist"),
    (BASE.replace('"x"', '"z"'), "is 'z', but the active DOFs are x, y, rz"),
    (BASE + BASE, "node 1 stands on two bases along x"),
]


@pytest.mark.parametrize(("more", "words"), WRONG)
def test_what_cannot_be_is_refused(tmp_path: Path, more: str, words: str) -> None:
    with pytest.raises(ProblemFileError) as caught:
        read(tmp_path, structure() + more)
    assert words in str(caught.value)


def test_what_moves_it_is_no_part_of_finer_elements(tmp_path: Path) -> None:
    """Transmissibilities of a frame ended in an error where its elements were divided."""
    spec = read(tmp_path, structure() + FRF)
    model = build_model(spec)
    whole = analysis_of(spec, model, 4)
    assert whole is not None and whole.on(model).size > model.size

"""A model from another program: K, M (and C, D) read back from .npz, .mat and Matrix Market give
the same structure."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.matrix import read_matrix, split
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes, natural_modes
from cvxupdate.fe.parameters import Parameter
from tests.cases.elements import FLAT_Y, build, chain, grid, held, lines, with_values

DOFS = ["x", "y", "rz"]


def source() -> Model:
    return with_values(
        build(held(lines("beam2d", FLAT_Y, [*chain(3), (1, 3)], DOFS, "tube"), ([1], DOFS))),
        eta=0.02,
        alpha=3.0,
        beta=1e-5,
    )


def export(model: Model, folder: Path, form: str) -> dict[str, Any]:
    """The rows of a matrix block that read the model's matrices back."""
    m = model.matrices()
    named = {"stiffness": m.K, "mass": m.M, "damping": m.C, "structural": m.D}
    if form == "mtx":
        for name, A in named.items():
            scipy.io.mmwrite(folder / f"{name}.mtx", sp.coo_array(A), precision=17)
        return {name: f"{name}.mtx" for name in named} | {"labels": list(model.labels)}
    if form == "sparse npz":
        for name, A in named.items():
            sp.save_npz(folder / f"{name}.npz", sp.csc_matrix(A))
        return {name: f"{name}.npz" for name in named} | {"labels": list(model.labels)}
    if form == "npz":
        np.savez(
            folder / "all.npz",
            labels=np.array(model.labels),
            **{name: A.toarray() for name, A in named.items()},
        )
        return {name: name for name in named} | {"labels": "labels", "file": "all.npz"}
    scipy.io.savemat(folder / "all.mat", {name: sp.csc_matrix(A) for name, A in named.items()})
    return {name: name for name in named} | {"labels": list(model.labels), "file": "all.mat"}


def text(*rows: dict[str, Any], dofs: list[str] = DOFS) -> dict[str, Any]:
    return {
        "dofs": dofs,
        "elements": [
            {"type": "matrix", "rows": [{"id": i + 1, **row} for i, row in enumerate(rows)]}
        ],
    }


@pytest.mark.parametrize("form", ["mtx", "sparse npz", "npz", "mat"])
def test_rebuilt_from_its_own_matrices(form: str, tmp_path: Path) -> None:
    first = source()
    second = build(text(export(first, tmp_path, form)), tmp_path)
    assert second.labels == first.labels
    for name in "KMCD":
        a, b = (getattr(m.matrices(), name) for m in (first, second))
        assert abs(a - b).max() <= 1e-14 * abs(a).max()
    assert np.allclose(
        model_modes(second, 6).frequencies, model_modes(first, 6).frequencies, rtol=1e-9
    )
    free = build(lines("beam2d", FLAT_Y, [*chain(3), (1, 3)], DOFS, "tube"))
    folder = tmp_path / "free"
    folder.mkdir()
    assert build(text(export(free, folder, form)), folder).total_mass() == pytest.approx(
        free.total_mass(), rel=1e-12
    )


def test_stiffness_as_a_sum(tmp_path: Path) -> None:
    """K = K₀ + Σ (1 + pᵢ) Kᵢ, likewise M; the derivative with respect to pᵢ is Kᵢ."""
    rng = np.random.default_rng(5)
    parts = {}
    for name in ("K0", "K1", "K2", "M0", "M1"):
        B = (
            rng.standard_normal((6, 6))
            if name[1] == "0"
            else np.vstack([np.zeros((3, 3)), rng.standard_normal((3, 3))])
            @ np.eye(3, 6, int(name[1]))
        )
        parts[name] = B @ B.T + np.eye(6) * (name[1] == "0")
    np.savez(tmp_path / "parts.npz", **parts)
    rows = [
        {"file": "parts.npz", "stiffness": "K0", "mass": "M0", "group": "base"},
        {"file": "parts.npz", "stiffness": "K1", "mass": "M1"},
        {"file": "parts.npz", "stiffness": "K2"},
    ]
    model = build(
        text(*rows, dofs=["x"]),
        tmp_path,
        update={
            "method": "frequencies",
            "parameters": [
                {"elements": [2, 3], "of": "stiffness", "each": "element"},
                {"elements": [2], "of": "mass"},
            ],
        },
        recordings=[{"kind": "modes", "use": "fit", "rows": [{"frequency": 1.0}]}],
    )
    assert [q.name for q in model.parameters] == ["e2.stiffness", "e3.stiffness", "e2.mass"]
    p = np.array([0.3, -0.2, 0.5])
    m = model.matrices(p)
    assert np.allclose(
        m.K.toarray(), parts["K0"] + 1.3 * parts["K1"] + 0.8 * parts["K2"], atol=1e-12
    )
    assert np.allclose(m.M.toarray(), parts["M0"] + 1.5 * parts["M1"], atol=1e-12)
    for j, (name, part) in enumerate((("K", "K1"), ("K", "K2"), ("M", "M1"))):
        total = np.zeros((6, 6))
        for b in model.derivative(j, p):
            np.add.at(total, (b.dofs[:, :, None], b.dofs[:, None, :]), getattr(b, name))
        assert np.allclose(total, parts[part], atol=1e-12)
    assert isinstance(model.parameters[0], Parameter)
    assert model.labels == tuple(f"n{i}.x" for i in range(1, 7))


def test_rigid_body_modes_without_geometry(tmp_path: Path) -> None:
    """A free structure of which only matrices are known: its three rigid motions are found, dense
    and sparse alike."""
    for n in (3, 24):
        first = build(grid(np.linspace(0, 0.5, n + 1) ** 1.1, np.linspace(0, 0.3, n), "sheet"))
        folder = tmp_path / str(n)
        folder.mkdir()
        second = build(text(export(first, folder, "sparse npz"), dofs=["z", "rx", "ry"]), folder)
        ours, theirs = model_modes(first, 8), model_modes(second, 8)
        assert theirs.rigid == ours.rigid == 3
        assert np.allclose(theirs.flexible().frequencies, ours.flexible().frequencies, rtol=1e-8)
        R = theirs.shapes[:, :3]
        assert np.allclose(R.T @ (first.matrices().M @ R), np.eye(3), atol=1e-9)


def test_joined_to_drawn_elements(tmp_path: Path) -> None:
    """Given matrices and drawn springs in one model; a support on a given DOF takes its row out."""
    np.savez(tmp_path / "a.npz", k=np.array([[3.0, -1.0], [-1.0, 2.0]]), m=np.diag([2.0, 1.0]))
    model = build(
        {
            "dofs": ["x"],
            "nodes": [{"id": 1, "x": 0.0}, {"id": 2, "x": 1.0}, {"id": 3, "x": 2.0}],
            "elements": [
                {
                    "type": "matrix",
                    "rows": [
                        {
                            "id": 1,
                            "file": "a.npz",
                            "stiffness": "k",
                            "mass": "m",
                            "labels": ["n1.x", "n2.x"],
                        }
                    ],
                },
                {"type": "spring", "dof": "x", "rows": [{"id": 2, "nodes": [2, 3], "k": 5.0}]},
            ],
            "supports": [{"nodes": [1, 3], "dofs": ["x"]}],
        },
        tmp_path,
    )
    assert model.labels == ("n2.x",)
    assert model.matrices().K.toarray() == pytest.approx(np.array([[7.0]]))
    assert model.total_mass() == pytest.approx(3.0)
    assert natural_modes(model.matrices().K, model.matrices().M, 1).eigenvalues == pytest.approx(
        [7.0]
    )


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("skew", np.array([[1.0, 2.0], [0.0, 1.0]]), "not symmetric"),
        ("oblong", np.ones((2, 3)), "not square"),
        ("nan", np.array([[np.nan, 0.0], [0.0, 1.0]]), "not finite"),
    ],
)
def test_unsound_matrices_are_refused(name: str, content: np.ndarray, words: str) -> None:
    with pytest.raises(ModelError, match=f"row 4.*{words}"):
        split(content, "row 4")


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mtx").write_text("no matrix")
    np.savez(tmp_path / "b.npz", k=np.eye(2), m=np.eye(2))
    np.savez(tmp_path / "o.npz", k=np.array([{"a": 1}], dtype=object))
    (tmp_path / "c.txt").write_text("1 2")
    for file, variable, words in (
        ("a.mtx", None, "cannot be read"),
        ("b.npz", "stiff", "holds k, m"),
        ("c.txt", None, "ending .txt"),
        ("o.npz", "k", "cannot be read"),
        ("none.npz", "k", "cannot be read"),
    ):
        with pytest.raises(ModelError, match=words):
            read_matrix(tmp_path / file, variable)


def test_labels_are_checked(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", k=np.eye(2), m=np.eye(2))
    row = {"file": "a.npz", "stiffness": "k", "mass": "m"}
    with pytest.raises(ModelError, match="3 labels for a matrix of 2 rows"):
        build(text({**row, "labels": ["n1.x", "n2.x", "n3.x"]}, dofs=["x"]), tmp_path)

"""MATLAB 5 files as scipy writes them: matrices of models, texts, and damage that is said and never
ends the process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from cvxupdate.errors import ModelError, RecordingError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.elements.matrix import read_matrix
from cvxupdate.matfile import read_variables
from cvxupdate.spec import load_problem


@pytest.mark.parametrize("compressed", [False, True])
def test_dense_sparse_and_texts(tmp_path: Path, compressed: bool) -> None:
    rng = np.random.default_rng(6)
    K = sp.random_array((40, 40), density=0.1, rng=rng).tocsc()
    cell = np.empty(3, dtype=object)
    cell[:] = ["n1.x", "n2.x", "n30.x"]
    path = tmp_path / "a.mat"
    savemat(
        path,
        {
            "K": K,
            "M": np.diag(rng.uniform(1.0, 2.0, 5)),
            "whole": np.arange(6).reshape(2, 3),
            "labels": np.array(["n1.x", "n2.xy"]),
            "cell": cell,
            "empty": sp.csc_array((3, 3)),
            "word": "drive µ",
        },
        do_compression=compressed,
    )
    found = read_variables(path)
    assert found.texts == {
        "labels": ("n1.x", "n2.xy"),
        "cell": ("n1.x", "n2.x", "n30.x"),
        "word": ("drive µ",),
    }
    np.testing.assert_array_equal(read_matrix(path, "K").toarray(), K.toarray())
    np.testing.assert_array_equal(
        read_matrix(path, "whole").toarray(), np.arange(6.0).reshape(2, 3)
    )
    assert read_matrix(path, "empty").nnz == 0 and read_matrix(path, "empty").shape == (3, 3)
    with pytest.raises(ModelError, match="there is no variable 'C'. It holds K, M, empty, whole"):
        read_matrix(path, "C")
    assert set(read_variables(path, frozenset({"M"})).arrays) == {"M"}


def test_a_sparse_matrix_too_large_to_be_dense_serves_a_model(tmp_path: Path) -> None:
    size = 20_000
    savemat(tmp_path / "a.mat", {"K": sp.eye_array(size, format="csc") * 3.0})
    K = read_matrix(tmp_path / "a.mat", None)
    assert K.shape == (size, size) and K.nnz == size and K.sum() == 3.0 * size


def test_labels_from_the_file(tmp_path: Path) -> None:
    labels = np.empty(2, dtype=object)
    labels[:] = ["n7.x", "n3.x"]
    savemat(
        tmp_path / "a.mat",
        {"K": np.array([[3.0, -1.0], [-1.0, 2.0]]), "M": np.eye(2), "dofs": labels},
    )
    (tmp_path / "problem.toml").write_text(
        '[model]\ndofs = ["x"]\n[[model.elements]]\ntype = "matrix"\nfile = "a.mat"\nlabels '
        '= "dofs"\nrows = [{ id = 1, stiffness = "K", mass = "M" }]\n'
    )
    model = build_model(load_problem(tmp_path / "problem.toml"))
    K = model.matrices().K.toarray()
    at = [list(model.labels).index(name) for name in ("n7.x", "n3.x")]
    np.testing.assert_allclose(K[np.ix_(at, at)], [[3.0, -1.0], [-1.0, 2.0]])


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    flips=st.lists(st.tuples(st.integers(0, 1500), st.integers(0, 7)), max_size=4),
    share=st.floats(0.1, 1.0),
)
def test_a_damaged_matrix_file_is_an_error_that_names_it(
    tmp_path: Path, flips: list[tuple[int, int]], share: float
) -> None:
    path = tmp_path / "a.mat"
    savemat(
        path,
        {
            "K": sp.eye_array(30, format="csc") * 2.0,
            "M": np.eye(8),
            "dofs": np.array(["n1.x", "n2.x"]),
        },
    )
    raw = bytearray(path.read_bytes())
    for at, bit in flips:
        raw[at % len(raw)] ^= 1 << bit
    path.write_bytes(raw[: int(share * len(raw))])
    try:
        read_variables(path)
        matrix = read_matrix(path, "K")
    except (ModelError, RecordingError) as error:  # and nothing else
        assert "a.mat" in str(error)
        return
    assert matrix.shape == (30, 30)

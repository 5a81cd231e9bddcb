"""MKL Pardiso behind `factored`: the same answers as SuperLU, and SuperLU where it cannot."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe import factor as factors
from cvxupdate.fe import modes as fe_modes
from cvxupdate.fe.factor import Factor, factored, factorise
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.pardiso import PardisoFactor, library
from tests.cases.elements import build, grid
from tests.fe.test_factor import VALUES, K, M

installed = pytest.mark.skipif(
    importlib.util.find_spec("pypardiso") is None or library() is None,
    reason="needs the extra `fast` (pypardiso, MKL)",
)


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No system is too small for Pardiso."""
    monkeypatch.setattr(factors, "LARGE", 0)
    yield


@installed
@pytest.mark.usefixtures("always")
@pytest.mark.parametrize("columns", [(), (1,), (5,)])
@pytest.mark.parametrize("kind", [float, complex])
def test_solutions_are_those_of_superlu(columns: tuple[int, ...], kind: type) -> None:
    rng = np.random.default_rng(2)
    b = rng.standard_normal((K.shape[0], *columns)).astype(kind)
    if kind is complex:
        b = b + 1j * rng.standard_normal(b.shape)
    A = sp.csc_array(K - 0.5 * (VALUES[9] + VALUES[10]) * M)
    quick, slow = factored(A), factorise(A)
    assert isinstance(quick, PardisoFactor)
    x, y = quick.solve(b), slow.solve(b.real) + (1j * slow.solve(b.imag) if kind is complex else 0)
    assert x.shape == b.shape
    assert np.abs(x - y).max() <= 1e-9 * np.abs(y).max()


@installed
@pytest.mark.usefixtures("always")
@pytest.mark.parametrize("i", [3, 4, 11, 30, 60])
def test_inertia_counts_eigenvalues_as_superlu_does(i: int) -> None:
    below = VALUES[i - 1] if i > 3 else 0.0  # three rigid-body modes
    A = K - 0.5 * (below + VALUES[i]) * M
    quick = factored(A)
    assert isinstance(quick, PardisoFactor)
    assert quick.negatives() == factorise(A).negatives() == i


@installed
@pytest.mark.usefixtures("always")
def test_singular_matrices_and_saddle_points() -> None:
    with pytest.raises(ModelError, match="the stiffness is singular.*mechanism"):
        factored(sp.csc_array(np.array([[1.0, -1.0], [-1.0, 1.0]])), "the stiffness")
    saddle = sp.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))  # no diagonal entry is stored
    assert np.allclose(factored(saddle, pivot=True).solve(np.array([2.0, 3.0])), [3.0, 2.0])


@installed
@pytest.mark.usefixtures("always")
def test_what_is_not_real_and_symmetric_goes_to_superlu() -> None:
    assert isinstance(factored(K * (1.0 + 0.02j) + M), Factor)
    lopsided = sp.lil_array(K + M)
    lopsided[0, 5] += 1.0
    assert isinstance(factored(sp.csc_array(lopsided)), Factor)


@installed
@pytest.mark.slow
def test_modes_of_a_large_plate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Above the limit as it is: frequencies to 1e-9, shapes to 1e-6, and nothing missed."""
    model = build(grid(np.linspace(0, 0.7, 71), np.linspace(0, 0.5, 51)))
    assert model.size > factors.LARGE
    quick = model_modes(model, 12)
    monkeypatch.setattr(factors, "library", lambda: None)
    slow = model_modes(model, 12)
    assert quick.rigid == slow.rigid == 3
    assert np.allclose(quick.eigenvalues, slow.eigenvalues, rtol=2e-9)
    along = slow.shapes.T @ (model.matrices().M @ quick.shapes)
    assert np.allclose(np.abs(np.diag(along))[3:], 1.0, atol=1e-12)
    assert model.size > fe_modes.DENSE


def test_small_systems_do_not_depend_on_what_is_installed() -> None:
    assert isinstance(factored(K + M), Factor)


def test_a_wrong_path_of_mkl_leaves_superlu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYPARDISO_MKL_RT", "/nowhere/libmkl_rt.so")
    assert library.__wrapped__() is None

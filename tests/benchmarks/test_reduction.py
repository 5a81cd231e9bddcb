"""Guyan, IRS and SEREP at 1e3, 1e4 and 1e5 DOFs with 50 masters: time, and peak memory of a fresh
process.

Run: .venv/bin/python -m pytest tests/benchmarks/test_reduction.py --benchmark-columns=median -s The
model is a simply supported plate by finite differences (13-point stencil), with stiffness and mass
that vary. "textbook" is the dense formula as the books print it; it is left out, by name, where it
cannot run on this machine.
"""

import multiprocessing
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh, inv
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from cvxupdate.reduction import guyan, irs, partition, serep

SIZES = {1_000: (25, 40), 10_000: (100, 100), 100_000: (250, 400)}
MASTERS, MODES = 50, 20
# What the dense formulas need: N² numbers a few times over; the full eigenproblem takes 10 N³
# operations besides.
DENSE_LIMIT = {"Guyan": 10_000, "IRS": 10_000, "SEREP": 1_000}


@lru_cache(maxsize=1)
def plate(size: int) -> tuple[sparse.csc_matrix, sparse.csc_matrix, np.ndarray]:
    """K = L D L (discrete biharmonic with a stiffness field D), lumped M, and 50 scattered
    masters."""
    rows, columns = SIZES[size]
    h = 1.0 / columns
    second = [
        sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)) / h**2 for n in (rows, columns)
    ]
    L = sparse.kron(second[0], sparse.eye(columns)) + sparse.kron(sparse.eye(rows), second[1])
    rng = np.random.default_rng(0)
    D, m = 40.0 * rng.uniform(0.8, 1.2, size), 19.6 * rng.uniform(0.8, 1.2, size)
    K = sparse.csc_matrix(L @ sparse.diags(D * h * h) @ L)
    masters = np.sort(rng.choice(size, MASTERS, replace=False))
    return sparse.csc_matrix((K + K.T) / 2), sparse.csc_matrix(sparse.diags(m * h * h)), masters


def modes(K: sparse.csc_matrix, M: sparse.csc_matrix) -> np.ndarray:
    lu = splu(K, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    inverse = LinearOperator(K.shape, matvec=lu.solve, dtype=float)
    return eigsh(K, MODES, M, sigma=0.0, OPinv=inverse, v0=np.ones(K.shape[0]))[1]


def sparse_way(name: str, size: int) -> np.ndarray:
    K, M, masters = plate(size)
    if name == "SEREP":
        return serep(modes(K, M), masters).matrix
    return {"Guyan": guyan, "IRS": irs}[name](partition(K, M, masters)).matrix


def textbook(name: str, size: int) -> np.ndarray:
    Ks, Ms, n = plate(size)
    K, M = Ks.toarray(), Ms.toarray()
    s = np.setdiff1d(np.arange(size), n)
    T = np.zeros((size, n.size))
    if name == "SEREP":
        phi = eigh(K, M)[1][:, :MODES]
        return phi @ np.linalg.pinv(phi[n])
    T[n] = np.eye(n.size)
    inverse = inv(K[np.ix_(s, s)])
    T[s] = -inverse @ K[np.ix_(s, n)]
    if name == "IRS":
        MR, KR = T.T @ M @ T, T.T @ K @ T
        T[s] = T[s] + inverse @ (M @ T)[s] @ np.linalg.solve(MR, KR)
    return T


def pyfbs_way(name: str, size: int) -> np.ndarray:
    pyfbs = pytest.importorskip("pyfbs.expansion", reason="pyfbs is not installed")
    pandas = pytest.importorskip("pandas", reason="pandas, which pyfbs needs, is not installed")
    K, M, masters = plate(size)
    columns = SIZES[size][1]
    at = np.arange(size)
    table = pandas.DataFrame(
        {
            "Name": [f"S{i}" for i in at],
            "Position_1": at % columns,
            "Position_2": at // columns,
            "Position_3": 0 * at,
            "Direction_1": 0 * at,
            "Direction_2": 0 * at,
            "Direction_3": 0 * at + 1,
            "Quantity": "Displacement",
            "Grouping": 1,
        }
    )
    phi = modes(K, M)
    return pyfbs.serep(
        phi, np.eye(masters.size), table, table.iloc[masters].reset_index(drop=True)
    ).real


def _child(work: Callable[[str, int], np.ndarray], name: str, size: int, pipe: object) -> None:
    plate(size)
    before = _high_water()
    work(name, size)
    pipe.send((_high_water() - before) / 1024)


def _high_water() -> int:
    """Peak resident set in kB. Not getrusage: a child inherits its parent's peak there."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1])


def peak_megabytes(work: Callable[[str, int], np.ndarray], name: str, size: int) -> float:
    """Growth of the peak resident set of a process that does nothing else; SuperLU's own memory is
    counted too."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_child, args=(work, name, size, there))
    process.start()
    process.join()
    return float(here.recv())


@pytest.mark.parametrize("name", ["Guyan", "IRS", "SEREP"])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("way", ["cvxupdate", "textbook", "pyfbs"])
def test_reduction(benchmark, way: str, size: int, name: str) -> None:
    if way == "textbook" and size > DENSE_LIMIT[name]:
        need = (
            f"{10 * size**3:.0e} operations"
            if name == "SEREP"
            else f"{3 * 8 * size**2 / 1e9:.0f} GB"
        )
        pytest.skip(f"the dense formula of {name} at {size} DOFs needs {need}")
    if way == "pyfbs" and name != "SEREP":
        pytest.skip(f"pyfbs has no {name}")
    work = {"cvxupdate": sparse_way, "textbook": textbook, "pyfbs": pyfbs_way}[way]
    plate(size)
    T = benchmark.pedantic(
        work, (name, size), rounds=1 if size == 100_000 or way == "textbook" else 3
    )
    benchmark.extra_info["peak_MB"] = round(peak_megabytes(work, name, size))
    print(
        f"\n{way:10s} {name:6s} {size:7d} DOFs: {benchmark.stats['median']:9.3f} s  "
        f"{benchmark.extra_info['peak_MB']:6d} MB"
    )
    assert T.shape == (size, MASTERS)
    if size == 1_000 or way == "pyfbs":
        exact = textbook(name, size) if size == 1_000 else sparse_way(name, size)
        assert np.allclose(T, exact, atol=1e-6 * np.abs(exact).max())

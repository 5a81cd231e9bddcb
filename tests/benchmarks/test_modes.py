"""Assembly and 20 natural modes at 1e3, 1e4, 1e5 and 3e5 DOFs: time of the processor and peak
memory, with and without the extra ``fast``, against SciPy on the same matrices in the same run.

`python tests/benchmarks/test_modes.py METHOD N` is one measurement in a process of its own (its
peak memory is then its own); the tests run them all and print the tables. Methods: ``cvxupdate``
(with MKL Pardiso above 10 000 DOFs where it is installed); ``superlu``, the same without it;
``eigsh`` (scipy.sparse.linalg.eigsh, sigma = 0, otherwise its defaults, on the assembled matrices);
``eigh`` (scipy.linalg.eigh on full ones). The plate is clamped along one edge, so that K is
regular: on a free one eigsh at sigma = 0 has no answer (last table).
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.fe import factor as factors  # noqa: E402
from cvxupdate.fe import modes as fe_modes  # noqa: E402
from cvxupdate.fe.model import Model  # noqa: E402
from cvxupdate.fe.modes import model_modes  # noqa: E402
from cvxupdate.fe.pardiso import library  # noqa: E402
from tests.cases.elements import build, grid  # noqa: E402

COUNT = 20
SIZES = (1_000, 10_000, 100_000, 300_000)


def plate(size: int, clamped: bool) -> Model:
    """A steel plate 0.75 × 0.5 × 0.003 m of about ``size`` DOFs, from a two-element model widened
    to a grid."""
    ny = max(round((size / 3 / 1.5) ** 0.5) - 1, 2)
    nx = max(round(size / 3 / (ny + 1)) - 1, 2)
    a, b = 0.75 / nx, 0.5 / ny
    block = build(grid([0.0, a, 2 * a], [0.0, b], {"shape": "plate", "thickness": 0.003})).blocks[0]
    ids = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    quads = np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(
        -1, 4
    )
    free = ids[:, 1:].ravel() if clamped else ids.ravel()
    place = np.full((ids.size, 3), -1)
    place[free] = np.arange(3 * len(free)).reshape(-1, 3)
    block = replace(
        block,
        ids=np.arange(1, len(quads) + 1),
        groups=("",) * len(quads),
        dofs=place[quads].reshape(-1, 12),
        terms=tuple(replace(t, values=t.values[:1]) for t in block.terms),
        geometry=np.zeros(len(quads), dtype=np.int64),
        properties={k: np.full(len(quads), v[0]) for k, v in block.properties.items()},
    )
    y, x = np.divmod(np.arange(ids.size), nx + 1)
    labels = tuple(f"n{i + 1}.{d}" for i in free for d in ("z", "rx", "ry"))
    return Model(
        labels,
        np.arange(1, ids.size + 1),
        np.stack([x * a, y * b, 0.0 * x], axis=1),
        np.repeat(free, 3),
        np.tile([2, 3, 4], len(free)),
        (block,),
    )


def measure(method: str, size: int, clamped: bool = True) -> dict[str, Any]:
    """Seconds of the processor of assembly and of the modes (for cvxupdate with the assembly again:
    the call that a user makes), of these also by the clock, for threads may share them; peak memory
    in MB beyond what was in use before, the frequencies in Hz."""
    import scipy.linalg as la
    from scipy.sparse.linalg import eigsh

    if method == "superlu":
        factors.library = lambda: None  # type: ignore[assignment]
    elif method == "cvxupdate":
        factors.library()  # loading MKL is no part of a factorisation
    model = plate(size, clamped)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    m = model.matrices()
    assembled, begun = time.process_time(), time.perf_counter()
    if method in ("cvxupdate", "superlu"):
        frequencies = model_modes(
            model, COUNT
        ).frequencies  # with its own assembly: the call a user makes
    elif method == "eigsh":
        frequencies = np.sqrt(np.maximum(eigsh(m.K, COUNT, m.M, sigma=0.0)[0], 0.0)) / 2 / np.pi
    else:
        frequencies = (
            np.sqrt(
                np.maximum(
                    la.eigh(m.K.toarray(), m.M.toarray(), subset_by_index=[0, COUNT - 1])[0], 0.0
                )
            )
            / 2
            / np.pi
        )
    end, clock = time.process_time(), time.perf_counter() - begun
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "dofs": model.size,
        "assembly": assembled - start,
        "modes": end - assembled,
        "clock": clock,
        "peak": (peak - before) / 1024,
        "frequencies": list(frequencies),
        "rounding": float(np.finfo(float).eps * np.max(m.K.diagonal() / m.M.diagonal())),
    }


def apart(
    method: str, size: int, form: str = "clamped", limit: float = 3600.0
) -> dict[str, Any] | str:
    """`measure` in a process of its own, or the last line of what went wrong."""
    done = subprocess.run(
        [sys.executable, __file__, method, str(size), form],
        capture_output=True,
        text=True,
        timeout=limit,
        cwd=ROOT,
        env={"OPENBLAS_NUM_THREADS": "1", **os.environ},  # as the command sets it; MKL has its own
    )
    if done.returncode:
        return done.stderr.strip().splitlines()[-1]
    return dict(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.slow
def test_time_and_memory() -> None:
    print(f"\nAssembly and {COUNT} modes of a plate clamped along one edge")
    print(
        f"{'DOFs':>8} {'method':>10} {'assembly s':>11} {'modes s':>9} "
        f"{'clock s':>9} {'peak MB':>8} {'f20 Hz':>11}"
    )
    for size in SIZES:
        found = {}
        for method in ("cvxupdate", "superlu", "eigsh", "eigh"):
            if method == "superlu" and (size <= factors.LARGE or library() is None):
                continue  # the same as cvxupdate
            if method == "eigh" and size > 2_000:
                print(
                    f"{size:>8} {method:>10}  not run: {size**2 * 8e-9:.1f} GB for each full "
                    "matrix, and hours"
                )
                continue
            r = apart(method, size)
            assert isinstance(r, dict), r
            found[method] = r
            print(
                f"{r['dofs']:>8} {method:>10} {r['assembly']:>11.3f} {r['modes']:>9.3f} "
                f"{r['clock']:>9.3f} "
                f"{r['peak']:>8.0f} {r['frequencies'][-1]:>11.5f}"
                f"{r['modes'] / found['cvxupdate']['modes']:>8.1f} times"
            )
        mine = np.array(found["cvxupdate"]["frequencies"])
        # the digits of K that stiff elements take from the lowest modes: 3e-6 of the first at 3e5
        own = found["cvxupdate"]["rounding"] / (2.0 * (2.0 * np.pi * mine) ** 2)
        for r in found.values():
            assert np.all(np.abs(np.array(r["frequencies"]) / mine - 1.0) < 1e-6 + own)


@pytest.mark.slow
def test_free_plate() -> None:
    """A free structure is the usual one in a laboratory, and K is then singular."""
    print(
        f"\n{COUNT} modes of the same plate, free\n{'DOFs':>8} {'method':>10} {'modes s':>9}  "
        "first four frequencies, Hz"
    )
    for method in ("cvxupdate", "eigsh"):
        r = apart(method, 10_000, "free")
        if isinstance(r, str):
            print(f"{10_000:>8} {method:>10} {'-':>9}  {r}")
            assert method != "cvxupdate"
            continue
        print(
            f"{r['dofs']:>8} {method:>10} {r['modes']:>9.3f}  "
            f"{', '.join(f'{f:.6g}' for f in r['frequencies'][:4])}"
        )


@pytest.mark.slow
def test_where_dense_and_sparse_cross(monkeypatch: pytest.MonkeyPatch) -> None:
    """The table behind `modes.DENSE`: best of five of either path (count 20), free plates and
    clamped ones."""
    print(f"\n{'DOFs':>8} {'dense ms':>9} {'sparse ms':>10}   DENSE = {fe_modes.DENSE}")
    ratio = {}
    for size in (100, 200, 300, 400, 600, 900):
        model = plate(size, False)
        m = model.matrices()
        best = {}
        for path, limit in (("dense", 10**9), ("sparse", 0)):
            monkeypatch.setattr(fe_modes, "DENSE", limit)
            times = []
            for _ in range(5):
                start = time.perf_counter()
                model_modes(model, COUNT, model.zero(), m)
                times.append(time.perf_counter() - start)
            best[path] = min(times)
        ratio[model.size] = best["dense"] / best["sparse"]
        print(f"{model.size:>8} {1e3 * best['dense']:>9.1f} {1e3 * best['sparse']:>10.1f}")
    assert ratio[max(ratio)] > 1.0  # dense loses clearly above the threshold


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]), sys.argv[3] == "clamped")))

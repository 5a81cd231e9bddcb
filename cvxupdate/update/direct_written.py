"""What a direct method made, as a problem file of its own: one matrix block with its files."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.result import DirectUpdate
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec
from cvxupdate.spec.write import Written, tables_of

Real = NDArray[np.float64]
LARGEST = 700
"""DOFs up to which dense matrices are written as text, 6 MB each."""
ASYMMETRY = 1e-9
"""Of the largest entry; what is less symmetric is no structure, and no matrix block takes it."""


def written_matrices(
    spec: Spec, model: Model, made: DirectUpdate
) -> tuple[Written, dict[str, str]] | str:
    """The problem with the method's matrices in place of its elements, and the matrix files by
    name; or why there is none, in words."""
    if model.size > LARGEST:
        return f"the matrices are not written: {model.size} DOFs are more than {LARGEST}"
    parts = {"stiffness": made.K, "mass": made.M, "damping": made.C, "structural": made.D}
    kept = {k: A for k, A in parts.items() if A is not None and np.any(A)}
    if any(np.abs(A - A.T).max() > ASYMMETRY * np.abs(A).max() for A in kept.values()):
        return "the matrices are not written: they are not symmetric, which no model is"
    files = {f"{k}.mtx": "\n".join(_market(A)) + "\n" for k, A in kept.items()}
    tables = tables_of(spec)
    given = tables["model"]
    row = {"id": 1, **{k: f"{k}.mtx" for k in kept}, "labels": list(model.labels)}
    tables["model"] = {
        **{k: given[k] for k in ("dofs", "nodes") if k in given},
        "elements": [{"type": "matrix", "rows": [row]}],
    }
    if "damping" in given and not {"damping", "structural"} & kept.keys():
        tables["model"]["damping"] = given["damping"]
    for key in ("update", "constraints", "regularisation", "solver", "diagnose"):
        tables.pop(key, None)
    head = (f"The matrices of {made.method}: cvxupdate run, method = direct.",)
    return Written(tables, head), files


def _market(A: Real) -> Iterator[str]:
    """Matrix Market, the lower triangle of a symmetric matrix, every figure."""
    yield "%%MatrixMarket matrix coordinate real symmetric"
    rows, columns = np.nonzero(np.tril(A))
    yield f"{len(A)} {len(A)} {len(rows)}"
    for i, j in zip(rows.tolist(), columns.tolist(), strict=True):
        yield f"{i + 1} {j + 1} {float(0.5 * (A[i, j] + A[j, i]))!r}"

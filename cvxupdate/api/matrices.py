"""Matrices in memory as elements of a problem: each in a file of its own, by group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cvxupdate.api.held import Held
from cvxupdate.api.places import places_of
from cvxupdate.errors import InputError

KEYS = {"K": "stiffness", "M": "mass", "C": "damping", "D": "structural"}
LEFT = 1e-12
"""Of the largest entry: what groups may leave of the whole before it is rounding."""


@dataclass(frozen=True)
class Given:
    """The matrices of a group, by name, and their labels."""

    name: str | None
    matrices: Mapping[str, sp.csc_array]
    labels: tuple[str, ...]


def labels_of(labels: Any, size: int) -> tuple[str, ...]:
    """Labels of the rows of matrices; "auto" (or None): row i is n<i>.x.

    Raises
    ------
    InputError
        When there are not as many, one is there twice, or one has a direction against its axis.
    """
    if labels is None or (isinstance(labels, str) and labels == "auto"):
        return tuple(f"n{i + 1}.x" for i in range(size))
    places = places_of(labels, None, "labels")
    if len(places) != size:
        raise InputError(
            f"labels: {len(places)} for matrices of {size} rows. Give one for each row."
        )
    turned = [p.label for p in places if p.sign < 0]
    if turned:
        raise InputError(f"labels: {turned[0]} points against its axis. Turn the matrices first.")
    names = [p.label for p in places]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise InputError(f"labels: {twice} names two rows.")
    return tuple(names)


def square(given: Any, what: str) -> sp.csc_array | sp.csc_matrix:
    """A square matrix of finite numbers, sparse, complex where it is.

    Raises
    ------
    InputError
        When it is not.
    """
    try:
        raw = given if sp.issparse(given) else np.asarray(given)
        made = sp.csc_array(raw)
        made = made.astype(complex if made.dtype.kind == "c" else float)
    except (TypeError, ValueError):
        raise InputError(f"{what}: is no matrix of numbers.") from None
    if made.ndim != 2 or made.shape[0] != made.shape[1] or not made.shape[0]:
        raise InputError(f"{what}: has shape {made.shape}. Give a square matrix.")
    if not np.all(np.isfinite(made.data)):
        raise InputError(f"{what}: has entries that are not finite.")
    return made


def groups_of(
    whole: Mapping[str, Any], labels: Any, groups: Mapping[str, Any] | None
) -> list[Given]:
    """The groups, and what they leave of the ``whole`` (K, M, C, D, None where absent) as one more
    without a name; a complex K brings D.

    Raises
    ------
    InputError
        When sizes do not agree, or there is no matrix at all.
    """
    own = _matrices(whole, "")
    parts: list[Given] = []
    size = next((m.shape[0] for m in own.values()), None)
    if groups is not None and not isinstance(groups, Mapping):
        raise InputError('groups: give {"name": {"K": …, "M": …}}.')
    for name, value in (groups or {}).items():
        given = _matrices(_by_name(value, str(name)), f"groups.{name}.")
        mine = value.get("labels") if isinstance(value, Mapping) else None
        count = next(iter(given.values())).shape[0]
        size = count if size is None and mine is None else size
        parts.append(Given(str(name), given, labels_of(labels if mine is None else mine, count)))
    if size is None:
        raise InputError("give K and M, or groups that have them.")
    if not own:
        return parts
    names = labels_of(labels, size)
    left = {k: _left(k, m, names, parts) for k, m in own.items()}
    rest = {k: m for k, m in left.items() if m is not None}
    return [*parts, Given(None, rest, names)] if rest else parts


def _by_name(value: Any, name: str) -> Mapping[str, Any]:
    if isinstance(value, Mapping):
        unknown = sorted(set(map(str, value)) - {*KEYS, "labels"})
        if unknown:
            raise InputError(f"groups.{name}: has {', '.join(unknown)}; give K, M, C, D or labels.")
        return {k: v for k, v in value.items() if k in KEYS}
    if isinstance(value, tuple) and len(value) in (2, 3, 4):
        return dict(zip(KEYS, value, strict=False))
    return {"K": value}


def _matrices(given: Mapping[str, Any], where: str) -> dict[str, sp.csc_array]:
    made = {k: square(v, f"{where}{k}") for k, v in given.items() if v is not None}
    if where and not made:
        raise InputError(f"{where.rstrip('.')}: has no matrix. Give K, M, C or D.")
    if "K" in made and made["K"].dtype.kind == "c":
        if "D" in made:
            raise InputError(f"{where}K: is complex, and D is given. Give the loss once.")
        made["D"], made["K"] = made["K"].imag, made["K"].real
    sizes = {m.shape[0] for m in made.values()}
    if len(sizes) > 1:
        told = ", ".join(f"{k} {m.shape[0]}" for k, m in made.items())
        raise InputError(f"{where or 'the '}matrices: have different sizes ({told}).")
    wrong = [k for k, m in made.items() if m.dtype.kind == "c"]
    if wrong:
        raise InputError(f"{where}{wrong[0]}: is complex; only K may be (its loss).")
    return made


def _left(
    key: str, whole: sp.csc_array, names: tuple[str, ...], parts: list[Given]
) -> sp.csc_array | None:
    """What the groups leave of a matrix, None where it is rounding."""
    at = {label: i for i, label in enumerate(names)}
    left, size = whole.copy(), whole.shape[0]
    for part in parts:
        if key not in part.matrices:
            continue
        unknown = [label for label in part.labels if label not in at]
        if unknown:
            raise InputError(f"groups.{part.name}: {unknown[0]} is no row of the whole matrix.")
        m = part.matrices[key].tocoo()
        rows = np.array([at[label] for label in part.labels])
        left = left - sp.csc_array((m.data, (rows[m.row], rows[m.col])), shape=(size, size))
    most = abs(whole).max() if whole.nnz else 0.0
    left.data[np.abs(left.data) <= LEFT * most] = 0.0
    left.eliminate_zeros()
    return left if left.nnz else None


def matrix_block(parts: list[Given]) -> tuple[dict[str, Any], tuple[Held, ...]]:
    """The block of elements of these matrices, and the files that it needs."""
    rows, held = [], []
    for number, part in enumerate(parts, 1):
        row: dict[str, Any] = {"id": number, "labels": list(part.labels)}
        for key, matrix in part.matrices.items():
            file = Held(f"{key}-", _as_saved(matrix))
            held.append(file)
            row[KEYS[key]] = str(file.path)
        if part.name is not None:
            row["group"] = part.name
        rows.append(row)
    return {"type": "matrix", "rows": rows}, tuple(held)


def _as_saved(m: sp.csc_array) -> dict[str, Any]:
    """The arrays that scipy.sparse.save_npz writes."""
    m.sort_indices()
    return {
        "indices": m.indices,
        "indptr": m.indptr,
        "format": b"csc",
        "shape": np.array(m.shape),
        "data": m.data,
        "_is_array": True,
    }

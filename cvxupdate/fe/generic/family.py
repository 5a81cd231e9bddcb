"""A family of element matrices (7.4–7.6): V X Vᵀ with the same rigid-body modes and symmetry.

With Φ_R the motions that K₀ does not resist, K₀ = U Θ Uᵀ and M₀ = V Σ Vᵀ in coordinates whose
rotations are lengths. The thesis varies θ, σ and the angles of R and T in K = U R Θ Rᵀ Uᵀ and
M = V T Σ Tᵀ Vᵀ. X = R Θ Rᵀ runs through every positive semidefinite matrix that has the blocks of
R, so the family is that convex set, and K and M are linear in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.generic.shape import ElementShape, own_classes, symmetry_classes

ZERO = 1e-12  # of the largest eigenvalue: what is below it is rounding
Classes = Literal["symmetry", "own", "diagonal", "none"] | tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class Family:
    """Element matrices ``vectors`` X ``vectors``ᵀ.

    ``matrix`` "K" or "M"; ``vectors`` (d, r), a motion of the DOFs for each of r element modes,
    nominal X = diag(``values``), ascending; ``classes`` the modes that may mix, each class sorted;
    modes in no class stay as they are. ``rigid`` is the number of motions that no member resists;
    ``kinds`` the symmetry of each mode.
    """

    matrix: str
    vectors: Real
    values: Real
    classes: tuple[tuple[int, ...], ...]
    rigid: int
    kinds: tuple[int, ...]

    @cached_property
    def sizes(self) -> Real:
        """√ of the nominal values (r,), by which X is measured; a value of zero (a lump without
        rotary inertia) is measured by the least that is not."""
        positive = self.values > ZERO * self.values.max()
        return np.sqrt(np.where(positive, self.values, self.values[positive].min()))

    @cached_property
    def nominal(self) -> Real:
        """N (r, r) of X = D (N + P) D, D = diag(sizes): ones where something is there today."""
        return np.diag(np.where(self.values > ZERO * self.values.max(), 1.0, 0.0))

    @cached_property
    def entries(self) -> tuple[tuple[int, int], ...]:
        """The free entries (i ≤ j) of X, class after class."""
        return tuple((i, j) for c in self.classes for n, i in enumerate(c) for j in c[n:])

    def unit(self, i: int, j: int) -> Real:
        """The derivative of the element matrix by the parameter of entry (i, j), (d, d).

        Entries beside the diagonal are divided by √2, so that Σ p² = ‖P‖² (Frobenius).
        """
        u, v = (self.vectors[:, k] * self.sizes[k] for k in (i, j))
        return np.outer(u, u) if i == j else (np.outer(u, v) + np.outer(v, u)) / np.sqrt(2.0)

    def relative(self, p: Real) -> Real:
        """N + P (r, r) of parameters (entries,)."""
        P = self.nominal.copy()
        for (i, j), value in zip(self.entries, p, strict=True):
            P[i, j] = P[j, i] = P[i, j] + (value if i == j else value / np.sqrt(2.0))
        return P

    def member(self, X: Real) -> Real:
        """The element matrix (d, d) of X (r, r)."""
        return self.vectors @ X @ self.vectors.T

    def coordinates(self, A: Real) -> Real:
        """X (r, r) of an element matrix (d, d); what is not of the family is projected away."""
        inverse = np.linalg.pinv(self.vectors)
        return inverse @ A @ inverse.T

    def parameters(self, A: Real) -> Real:
        """Parameters (entries,) of an element matrix (d, d)."""
        P = self.coordinates(A) / np.outer(self.sizes, self.sizes) - self.nominal
        return np.array([P[i, j] * (1.0 if i == j else np.sqrt(2.0)) for i, j in self.entries])

    def aligned(self, local: Real, reference: Family, reference_local: Real) -> Family:
        """The same, its modes in the order and with the signs of ``reference`` and the same ones
        free, so that one P serves both: ``local`` (d, 6 k) takes the DOFs of each to axes of the
        element itself.

        Raises
        ------
        ModelError
            When the elements have no modes in common.
        """
        from scipy.optimize import linear_sum_assignment

        unlike = ModelError(
            "elements of different kinds cannot share one family of element matrices. Name "
            'them in rows of their own, or use each = "element".'
        )
        if local.shape != reference_local.shape or self.vectors.shape != reference.vectors.shape:
            raise unlike
        mine, theirs = (
            _unit_rows(f.vectors.T @ turn)
            for f, turn in ((self, local), (reference, reference_local))
        )
        overlap = theirs @ mine.T
        order = linear_sum_assignment(-np.abs(overlap))[1]
        pairs = set(zip(reference.kinds, (self.kinds[i] for i in order), strict=True))
        if len(pairs) != len(set(self.kinds)) or len(pairs) != len(set(reference.kinds)):
            raise unlike
        sign = np.where(overlap[np.arange(len(order)), order] < 0.0, -1.0, 1.0)
        return Family(
            self.matrix,
            self.vectors[:, order] * sign,
            self.values[order],
            reference.classes,
            self.rigid,
            reference.kinds,
        )


def _unit_rows(rows: Real) -> Real:
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def family_of(
    matrix: str,
    K: Real,
    M: Real,
    shape: ElementShape | None,
    classes: Classes = "symmetry",
    free: int | None = None,
) -> Family:
    """The family of an element with matrices ``K`` and ``M`` (d, d).

    Parameters
    ----------
    matrix : "K" or "M", which of them.
    shape : where its DOFs are; None where nothing is known (rotations are then as they came, and
    "symmetry" means "own").
    classes : "symmetry", by the element's half-turns and mirrors; "own", by what neither matrix
    mixes; "diagonal", R = T = I; "none", every mode with every other; or classes of mode numbers
    (1 the lowest), of which the others stay as they are.
    free : so many of the lowest stiffness modes, or highest mass modes, are free (Ross 1971); the
    others stay as they are.

    Raises
    ------
    ModelError
        When the matrix is zero or not positive semidefinite, or a class names a mode that is not
        there or stands in another.
    """
    scale = np.ones(len(K)) if shape is None else shape.scale
    Ks, Ms = (A / np.outer(scale, scale) for A in (K, M))
    A = Ks if matrix == "K" else Ms
    values = np.linalg.eigvalsh((A + A.T) / 2.0)
    word = "stiffness" if matrix == "K" else "mass"
    if values[-1] <= 0.0 or values[0] < -ZERO * values[-1]:
        raise ModelError(
            f"its {word} matrix is "
            + ("zero." if values[-1] <= 0.0 else "not positive semidefinite.")
            + " A family of element matrices starts from one that is a structure: leave the "
            "element out, or correct it."
        )
    if shape is None or classes == "own":
        bases = own_classes(Ks, Ms)
    else:
        bases = symmetry_classes(shape.symmetries((K, M)), len(K))
    rigid = int(np.sum(values <= ZERO * values[-1])) if matrix == "K" else 0
    known = np.zeros((len(A), 0)) if shape is None or not rigid else _rigid(shape, A)
    vectors, values, group = _by_class(A, bases, known, rigid - known.shape[1])
    vectors = vectors * _signs(vectors if shape is None else shape.own_axes(K).T @ vectors)
    return Family(
        matrix,
        scale[:, None] * vectors,
        values,
        _chosen(classes, group, free, matrix),
        rigid,
        tuple(group.tolist()),
    )


def _rigid(shape: ElementShape, A: Real) -> Real:
    """Orthonormal rigid motions (d, n) that A does not resist.

    They are known better from places than from A: the modes of a thin shell that are softest in
    bending lie among the rounding of its membrane.
    """
    U, s, _ = np.linalg.svd(shape.scale[:, None] * shape.rigid, full_matrices=False)
    R = U[:, s > ZERO * s[0]]
    energies, turn = np.linalg.eigh(R.T @ A @ R)
    return np.asarray(R @ turn[:, energies <= ZERO * np.abs(A).max() * len(A)])


def _by_class(
    A: Real, bases: tuple[Real, ...], rigid: Real, more: int
) -> tuple[Real, Real, np.ndarray]:
    """Modes of A (d, d) in each class beside the ``rigid`` motions (d, n), ascending, the ``more``
    lowest left out: (vectors, values, class of each)."""
    found = []
    for number, B in enumerate(bases):
        inside = np.linalg.svd(B.T @ rigid, full_matrices=True)
        held = int(np.sum(inside[1] > 0.5))  # 1 in its class, 0 in the others
        C = B @ inside[0][:, held:]
        values, vectors = np.linalg.eigh(C.T @ A @ C)
        found += [(v, number, C @ w) for v, w in zip(values.tolist(), vectors.T, strict=True)]
    top = max(v for v, _, _ in found)
    # Repeated values in the order of their classes: rounding shall not number the modes.
    found.sort(key=lambda m: (round(m[0] / top, 7), m[1], m[0]))
    lowest = sorted(range(len(found)), key=lambda i: found[i][0])[:more]
    kept = [m for i, m in enumerate(found) if i not in lowest]
    vectors = np.array([w for _, _, w in kept]).T
    return vectors, np.array([max(v, 0.0) for v, _, _ in kept]), np.array([c for _, c, _ in kept])


def _signs(local: Real) -> Real:
    """Of columns, that make the first large component positive in axes of the element: wherever it
    stands, the entries beside the diagonal mean the same."""
    size = np.abs(local)
    first = np.argmax(size > 0.5 * size.max(axis=0), axis=0)
    return np.where(local[first, np.arange(local.shape[1])] < 0.0, -1.0, 1.0)


def _chosen(
    classes: Classes, group: np.ndarray, free: int | None, matrix: str
) -> tuple[tuple[int, ...], ...]:
    """Classes as numbers of modes from 0, those that stay left out."""
    r = len(group)
    if isinstance(classes, tuple):
        named = [n for c in classes for n in c]
        if sorted(set(named)) != sorted(named) or not all(1 <= n <= r for n in named):
            raise ModelError(
                f"the classes {[list(c) for c in classes]} are no classes of its {r} modes. Name "
                f"each mode from 1 to {r} at most once."
            )
        made = [tuple(sorted(n - 1 for n in c)) for c in classes]
    elif classes == "diagonal":
        made = [(i,) for i in range(r)]
    elif classes == "none":
        made = [tuple(range(r))]
    else:
        made = [tuple(np.flatnonzero(group == g).tolist()) for g in dict.fromkeys(group.tolist())]
    if free is not None:
        some = range(min(free, r)) if matrix == "K" else range(max(r - free, 0), r)
        made = [tuple(i for i in c if i in some) for c in made]
    return tuple(c for c in made if c)

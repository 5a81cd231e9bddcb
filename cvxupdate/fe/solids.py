"""Stiffness and mass of solid elements, split by Lamé's constants.

Energy density ½ λ (tr ε)² + μ ε : ε, so K = λ K_λ + μ K_μ, with factors that geometry alone gives.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import roots_jacobi

from cvxupdate.errors import ModelError
from cvxupdate.fe.terms import Real, Term, Values
from cvxupdate.spec.solids import Solid

Rule = tuple[Real, Real]


def brick_rule(count: int) -> Rule:
    """Gauss's points (count³, 3) and weights on the unit cube."""
    x, w = np.polynomial.legendre.leggauss(count)
    grid = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    return (grid + 1.0) / 2.0, np.einsum("i,j,k->ijk", w, w, w).ravel() / 8.0


def tetrahedron_rule(count: int) -> Rule:
    """count³ points on the unit tetrahedron, exact to degree 2 count − 1 (Stroud's conical
    product)."""
    rules = [roots_jacobi(count, power, 0) for power in (2, 1, 0)]
    (a, wa), (b, wb), (c, wc) = (
        ((x + 1.0) / 2.0, w / 2.0 ** (p + 1)) for (x, w), p in zip(rules, (2, 1, 0), strict=True)
    )
    points, weights = [], []
    for i in range(count):
        for j in range(count):
            for k in range(count):
                x, y = a[i], b[j] * (1.0 - a[i])
                points.append((x, y, c[k] * (1.0 - x - y)))
                weights.append(wa[i] * wb[j] * wc[k])
    return np.array(points), np.array(weights)


def solid_terms(
    solid: Solid, xyz: Real, stiff: Rule, heavy: Rule, lumped: bool, incompatible: float | None
) -> tuple[Term, ...]:
    """``lambda``, ``mu`` and ``rho`` factors of elements on nodes ``xyz`` (e, n, 3), (e, 3 n, 3 n).

    ``incompatible``: Poisson's ratio at which the incompatible modes are condensed
    (`enriched`); None: there are none.

    Raises
    ------
    ModelError
        For an element without volume somewhere.
    """
    fields = (
        _gradients(solid, xyz, stiff)
        if incompatible is None
        else enriched(solid, xyz, stiff, incompatible)
    )
    e, n, _ = xyz.shape
    K = {name: np.zeros((e, 3 * n, 3 * n)) for name in ("lambda", "mu")}
    for D, dV in fields:
        for name, part in _lame(D, D, dV).items():
            K[name] += part
    terms = [Term("K", name, values) for name, values in K.items()]
    return (*terms, Term("M", "rho", _mass(solid, xyz, heavy, lumped)))


def lame(E: Values, nu: Values) -> dict[str, Values]:
    """λ and μ, Pa."""
    return {"lambda": E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), "mu": E / (2.0 * (1.0 + nu))}


def _jacobians(solid: Solid, xyz: Real, point: Real) -> tuple[Real, Real]:
    """Derivatives of the shape functions along the natural axes (3, n), and J (e, 3, 3)."""
    d = np.stack([solid.shape(point[None], k)[0] for k in range(3)])
    return d, np.einsum("an,enb->eab", d, xyz)


def _gradients(solid: Solid, xyz: Real, rule: Rule) -> Iterator[tuple[Real, Real]]:
    """Displacement gradients ∂uᵢ/∂xⱼ (e, 3, 3, 3 n) and volume (e,) at each point."""
    for point, weight in zip(*rule, strict=True):
        d, J = _jacobians(solid, xyz, point)
        volume = np.linalg.det(J)
        if np.any(volume <= 0.0):
            raise ModelError(
                "a solid element has no volume somewhere, or is turned inside out. Order its "
                "nodes, or move those amid its edges towards the middle."
            )
        gradient = np.linalg.solve(J, np.broadcast_to(d, (len(xyz), *d.shape)))
        yield _of_vectors(np.asarray(gradient, dtype=float)), weight * volume


def _of_vectors(gradient: Real) -> Real:
    """Gradients (e, 3, m) of scalar functions as those of vector fields, (e, 3, 3, 3 m)."""
    e, _, m = gradient.shape
    out = np.zeros((e, 3, 3, m, 3))
    for i in range(3):
        out[:, i, :, :, i] = gradient
    return out.reshape(e, 3, 3, 3 * m)


def _lame(D: Real, other: Real, dV: Real) -> dict[str, Real]:
    """Products of two sets of displacement gradients, (e, d, d')."""

    def symmetric(values: Real) -> Real:
        strain = (values + values.transpose(0, 2, 1, 3)) / np.sqrt(2.0)
        return strain.reshape(len(strain), 9, -1)

    one, two = (np.einsum("eiid->ed", values)[:, None] for values in (D, other))
    weight = dV[:, None, None]
    return {
        "lambda": (one * weight).transpose(0, 2, 1) @ two,
        "mu": (symmetric(D) * weight).transpose(0, 2, 1) @ symmetric(other),
    }


def enriched(solid: Solid, xyz: Real, rule: Rule, nu: float) -> list[tuple[Real, Real]]:
    """Displacement gradients of a brick with Wilson's incompatible modes (1 − ξ², 1 − η², 1 − ζ²
    in each direction), mapped by the Jacobian of the centre so that constant strain passes
    (Taylor, Beresford and Wilson 1976).

    The modes take the amplitudes of least energy at Poisson's ratio ``nu``. At it the element is
    the condensed one exactly, and so is its derivative with respect to ν (the energy is least); at
    others it errs by the square of the difference. So it stays terms × coefficients.
    """
    _, J0 = _jacobians(solid, xyz, np.full(3, 0.5))
    inverse, volume = np.linalg.inv(J0), np.linalg.det(J0)
    weights = lame(np.ones(1), np.full(1, nu))
    fields = list(_gradients(solid, xyz, rule))
    extra = []
    for (_, dV), point, w in zip(fields, *rule, strict=True):
        slopes = np.diag(1.0 - 2.0 * point)  # of 4 ξ (1 − ξ), up to a factor
        gradient = inverse @ slopes * (volume * w / dV)[:, None, None]
        extra.append(_of_vectors(gradient))
    aa, au = (
        sum(
            weights[name] * part
            for (D, dV), G in zip(fields, extra, strict=True)
            for name, part in _lame(G, G if own else D, dV).items()
        )
        for own in (True, False)
    )
    amplitude = -np.linalg.solve(aa, au)
    return [
        (D + np.einsum("eijm,emd->eijd", G, amplitude, optimize=True), dV)
        for (D, dV), G in zip(fields, extra, strict=True)
    ]


def _mass(solid: Solid, xyz: Real, rule: Rule, lumped: bool) -> Real:
    """Consistent, or the diagonal scaled to the mass of the element (Hinton, Rock and Zienkiewicz
    1976), which stays positive amid edges and at corners."""
    e, n, _ = xyz.shape
    N = solid.shape(rule[0])
    dV = np.stack(
        [w * np.linalg.det(_jacobians(solid, xyz, p)[1]) for p, w in zip(*rule, strict=True)]
    )
    if lumped:
        own = dV.T @ N**2
        diagonal = own / own.sum(axis=1, keepdims=True) * dV.sum(axis=0)[:, None]
        return np.asarray(np.einsum("en,nm->enm", np.repeat(diagonal, 3, axis=1), np.eye(3 * n)))
    shared = np.einsum("qe,qa,qb->eab", dV, N, N, optimize=True)
    return np.einsum("eab,ij->eaibj", shared, np.eye(3)).reshape(e, 3 * n, 3 * n)

"""Bending of plates with and without deformation in shear, split by coefficient.

The rotations β of the normal are bilinear (linear) and one bubble along each side, whose size
follows from the beam that the side is: with γ̄ the mean of ∂w/∂s + β along it, the shear strain is
γ = (1 − a) γ̄ and the bubble −3/2 a γ̄, a = 1 / (1 + Φ), Φ = 12 D / (κ G h L²). a = 1 is the discrete
Kirchhoff element (DKQ, Batoz and Tahar 1982; DKT, Batoz, Bathe and Ho 1980), a = 0 that with
assumed shear strains alone (MITC4, Bathe and Dvorkin 1985; MITC3, Lee and Bathe 2004), between
them the one of Katili (DKMQ and DKMT, 1993). Katili takes L of each side; here it is one length for
all elements of about a size (`frames.shear_lengths`), so that the stiffness is a polynomial in a
and stays terms × coefficients, and constant curvature passes on distorted meshes. The energy is
least for the right Φ, so another one costs second order only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.shells.frames import side_vectors
from cvxupdate.fe.shells.outlines import Sampled, sampled, sides_of
from cvxupdate.fe.terms import Real

RIGIDITIES = ("x", "y", "1", "xy")
"""Of an orthotropic sheet, as in Dx, Dy, D1, Dxy."""


@dataclass(frozen=True)
class Mapped:
    """A reference outline on real elements: area elements ``dA`` (q, e), gradients ``dN`` (q, e, 2,
    n) and ``dP`` (q, e, 2, s) in local axes, the inverse Jacobian ``inverse`` (q, e, 2, 2)."""

    at: Sampled
    dA: Real
    dN: Real
    dP: Real
    inverse: Real


def mapped(plane: Real, degree: int) -> Mapped:
    """Gradients on elements with corners ``plane`` (e, n, 2)."""
    at = sampled(plane.shape[1], degree)
    J = np.einsum("qan,enb->qeab", at.dN, plane)
    inverse = np.linalg.inv(J)
    return Mapped(
        at,
        np.linalg.det(J) * at.weights[:, None],
        np.einsum("qeba,qan->qebn", inverse, at.dN),
        np.einsum("qeba,qas->qebs", inverse, at.dP),
        inverse,
    )


def mean_shear(plane: Real) -> Real:
    """(e, s, 3 n): ∫ (∂w/∂s + β) ds along each side for the DOFs (w, θx, θy) of every corner; β =
    (θy, −θx)."""
    e, n, _ = plane.shape
    out = np.zeros((e, n, n, 3))
    vectors = side_vectors(plane)
    for k, (i, j) in enumerate(sides_of(n)):
        out[:, k, i, 0], out[:, k, j, 0] = -1.0, 1.0
        for node in (i, j):
            out[:, k, node, 1] = -vectors[:, k, 1] / 2
            out[:, k, node, 2] = vectors[:, k, 0] / 2
    return out.reshape(e, n, 3 * n)


def curvatures(m: Mapped, plane: Real) -> tuple[Real, Real]:
    """Curvatures (q, e, 3, 3 n) of the corners' rotations, and of the bubbles at a = 1."""
    q, e, _, n = m.dN.shape
    first = np.zeros((q, e, 3, n, 3))
    dx, dy = m.dN[:, :, 0], m.dN[:, :, 1]
    first[:, :, 0, :, 2] = dx
    first[:, :, 1, :, 1] = -dy
    first[:, :, 2, :, 2], first[:, :, 2, :, 1] = dy, -dx
    vectors = side_vectors(plane)
    along = vectors / np.einsum("esi,esi->es", vectors, vectors)[:, :, None]
    bubble = np.stack(
        [
            m.dP[:, :, 0] * along[..., 0],
            m.dP[:, :, 1] * along[..., 1],
            m.dP[:, :, 1] * along[..., 0] + m.dP[:, :, 0] * along[..., 1],
        ],
        axis=2,
    )
    return first.reshape(q, e, 3, 3 * n), -1.5 * np.matmul(bubble, mean_shear(plane))


def quadratic(B: Real, C: Real, dA: Real) -> dict[str, Real]:
    """∫ of products of strains (q, e, 3, d): the symmetric factors of `RIGIDITIES`, (e, d, d).

    With ``C`` other than ``B`` both orders, B C + C B.
    """

    def product(i: int, j: int) -> Real:
        left = (B[:, :, i] * dA[..., None]).transpose(1, 2, 0)
        return np.asarray(left @ C[:, :, j].transpose(1, 0, 2))

    def both(values: Real) -> Real:
        return values + values.transpose(0, 2, 1)

    if B is C:
        return {
            "x": product(0, 0),
            "y": product(1, 1),
            "1": both(product(0, 1)),
            "xy": product(2, 2),
        }
    return {
        "x": both(product(0, 0)),
        "y": both(product(1, 1)),
        "1": both(product(0, 1) + product(1, 0)),
        "xy": both(product(2, 2)),
    }


def bending_terms(plane: Real) -> dict[str, Real]:
    """Factors (e, 3 n, 3 n) on the DOFs (w, θx, θy) of every corner: ``Dx.0`` … ``Dxy.2`` of the
    powers of a, and ``shear``: ∫ γ̄² dA."""
    m = mapped(plane, 3 if plane.shape[1] == 4 else 2)
    first, bubbles = curvatures(m, plane)
    out: dict[str, Real] = {}
    pairs = ((first, first), (first, bubbles), (bubbles, bubbles))
    for power, (a, b) in enumerate(pairs):
        out |= {f"D{key}.{power}": v for key, v in quadratic(a, b, m.dA).items()}
    edge = np.einsum("qeba,qas->qebs", m.inverse, m.at.E)
    gamma = np.matmul(edge, mean_shear(plane))
    out["shear"] = np.einsum("qe,qeai,qeaj->eij", m.dA, gamma, gamma, optimize=True)
    return out

"""Frequency responses against the model: force balance, exactly reduced (3.13–3.26), weighted by
the dynamic flexibility (3.34–3.37), or output error (3.30).

With x the measured column of receptances, T = [I; −Z_ss⁻¹ Z_sn] and f the unit force carried to the
measured DOFs,

    force-balance   ε = f − Z_red x                     ∂ε = −Tᵀ ∂Z (T x) flexibility     H_w (f −
    Z_red x)                   H_w = Z_red⁻¹ at the parameters ``at``, held fixed receptance      H
    f − x                             ∂  = −(T H)ᵀ ∂Z (T H f)

The noise δ of x enters ε as −Z_red(p) δ, in A as much as in b. So the rows of the first have the
deviation of that product, which depends on p, and those of the second, whose H_w takes Z_red out
again, the deviation of x itself: that is the first with the whole covariance Z Σ Zᴴ of its rows,
and at ``at`` it equals the output error. `update.rfm_loop` takes ``at`` anew until it belongs to
the solution: with the weights of the start, p is badly biased. What bias is left, because A
itself is noisy, the output error does not have, and it ends the work: with errors in the variables
x̂ = H(p) f is the likeliest x that balances, so the output error is the maximum likelihood of the
force balance (`validation/studies/rfm_noise_in_a.py` measures all of them).

"instrumental" is the other way out of the bias (Fritzen 1986): the balance of "flexibility" is
asked for on average only, against instruments that the noise of x cannot be correlated with, the
derivatives of the model's own responses at ``at``: Gᵀ W² (A p − b) = 0. As many equations as
parameters, linear in p like the balance; `update.rfm_loop` takes the instruments anew at each
solution, which makes it the batch form of Mottershead's instrumental-variable filter (1988);
`update.rfm_filter` is the recursive one.

Two other ways with DOFs that were not measured: "filled" (`residual.frf_filled`, Lin and Ewins)
and "modal-balance" (`residual.frf_modal`, Friswell and Penny); both with `update.rfm_loop`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.responses import Condensed, condenser, damped, matrices_with_damping
from cvxupdate.residual.contraction import Derivatives, constant, derivatives
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.residual.frf_filled import filled_rows
from cvxupdate.residual.frf_modal import (
    modal_deviations,
    modal_labels,
    modal_rows,
    shapes_below,
)
from cvxupdate.residual.frf_output import model_rows
from cvxupdate.system import LinearSystem

Field = NDArray[Any]
KINDS = (
    "force-balance",
    "flexibility",
    "receptance",
    "instrumental",
    "filled",
    "modal-balance",
)
WHOLE_LINES = ("receptance", "filled", "modal-balance")  # rows of many lines are formed together
INDEPENDENT = 1e-10  # of the largest singular value of the instruments: what is less is rounding


@dataclass(frozen=True)
class FrfResidual:
    """What is compared: a model, recordings at their lines, one of `KINDS`, and the parameters
    ``at`` which its weights are taken (None: 0)."""

    model: Model
    data: tuple[FrfData, ...]
    kind: str
    at: Real | None = None

    def evaluate(self, p: Real, before: FrfPoint | None = None) -> FrfPoint:
        """Rows and their derivatives at ``p`` (n,), one factorisation for each line or one basis.

        Raises
        ------
        ModelError
            Where a line meets a natural frequency (of the structure held at the measured DOFs).
        """
        d = self._same if self._same is not None else derivatives(self.model, p)
        m = None if self.kind == "receptance" else matrices_with_damping(self.model, p)
        values, rows = [], []
        for data, weights in zip(self.data, self._weights, strict=True):
            if m is None or self.kind in WHOLE_LINES:
                for differences, change in self._together(m, p, d, data):
                    used = data.used
                    if self.kind == "modal-balance":  # of modes, not of sensors
                        used = np.ones(differences.shape[1:], dtype=bool)
                    values.append(differences[:, used].reshape(-1))
                    rows.append(change[:, used].reshape(-1, d.count))
                continue
            cut = condenser(m, data.responses, data.references)
            d.foresee(2.0 * np.pi * data.frequency)
            for k, f in enumerate(data.frequency.tolist()):
                c = cut.at(f)
                v, A = self._line(c, d, 2.0 * np.pi * f, data.X[k], weights[k])
                values.append(v[data.used])
                rows.append(A[data.used])
        v, A = parts(np.concatenate(values), self.real), parts(np.concatenate(rows), self.real)
        if self.kind == "instrumental":
            Q, w = self._instruments, self._row_weights
            v, A = Q.T @ (w * v), Q.T @ (w[:, None] * A)
        return FrfPoint(self, np.asarray(p, dtype=float), v, A)

    def _together(
        self, m: Matrices | None, p: Real, d: Derivatives, data: FrfData
    ) -> Iterator[tuple[Field, Field]]:
        """Rows of many lines at a time, (f, n, r), and their derivatives."""
        if m is None:
            return model_rows(self.model, p, d, data)
        if self.kind == "filled":
            return filled_rows(m, self._model_at, d, data)
        return modal_rows(m, self._model_at, d, data, self._shapes)

    @cached_property
    def _model_at(self) -> Matrices:
        """The matrices at ``at``."""
        return matrices_with_damping(self.model, self.model.zero() if self.at is None else self.at)

    @cached_property
    def _shapes(self) -> Real:
        """The shapes (N, m) that carry a modal balance."""
        return shapes_below(self.model, self.data, self.at)

    @cached_property
    def _instruments(self) -> Real:
        """An orthonormal basis (rows, r) of the weighted derivatives of the model's own responses
        at ``at``."""
        at = self.model.zero() if self.at is None else self.at
        J = FrfResidual(self.model, self.data, "receptance").evaluate(at).jacobian
        size = np.linalg.norm(J, axis=0)
        U, s, _ = la.svd(
            self._row_weights[:, None] * J / np.where(size > 0.0, size, 1.0), full_matrices=False
        )
        return np.asarray(U[:, s > INDEPENDENT * s.max(initial=0.0)])

    def _line(
        self, c: Condensed, d: Derivatives, omega: float, x: Field, flexibility: Field | None
    ) -> tuple[Field, Field]:
        epsilon = c.force - c.Z @ x
        left = (
            np.eye(len(x)) if flexibility is None or self.kind == "force-balance" else flexibility
        )
        return left @ epsilon, -d.between(omega, c.carried(left.T), c.field(x))

    @cached_property
    def _same(self) -> Derivatives | None:
        """∂Z/∂p where it does not depend on p."""
        return derivatives(self.model, self.model.zero()) if constant(self.model) else None

    @cached_property
    def real(self) -> bool:
        """Whether every row is real: undamped model and data."""
        return (
            not any(self.model.modal_damping)
            and not damped(self.model.matrices())
            and all(data.real for data in self.data)
            and not derivatives(self.model, self.model.zero()).damped
        )

    @cached_property
    def _weights(self) -> tuple[list[Field | None], ...]:
        """H_w of every line (the reduced Z itself for force-balance), None where the kind needs
        none."""
        if self.kind in WHOLE_LINES:
            return tuple([None] * len(data.frequency) for data in self.data)
        m = self._model_at
        out: list[list[Field | None]] = []
        for data in self.data:
            cut = condenser(m, data.responses, data.references)
            reduced = [cut.at(f).Z for f in data.frequency.tolist()]
            out.append([Z if self.kind == "force-balance" else np.linalg.inv(Z) for Z in reduced])
        return tuple(out)

    @property
    def weights(self) -> Real:
        """One over the deviation of every row."""
        if self.kind == "instrumental":
            return np.ones(self._instruments.shape[1])
        return self._row_weights

    @cached_property
    def _row_weights(self) -> Real:
        """One over the deviation of every real row of the balance."""
        found = []
        for data, weights in zip(self.data, self._weights, strict=True):
            if self.kind == "modal-balance":
                found.append(modal_deviations(data, self._shapes))
                continue
            for std, Z in zip(data.std, weights, strict=True):
                spread = (
                    np.sqrt(np.abs(Z) ** 2 @ std**2)
                    if self.kind == "force-balance" and Z is not None
                    else std
                )
                found.append(spread[data.used])
        std = np.concatenate(found)
        return 1.0 / std if self.real else np.sqrt(2.0) / np.concatenate([std, std])

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """What each real row is."""
        if self.kind == "instrumental":
            return tuple(f"instrument {i + 1}" for i in range(self._instruments.shape[1]))
        names = self.model.labels
        if self.kind == "modal-balance":
            found = [label for d in self.data for label in modal_labels(d, self._shapes, names)]
            return _both(tuple(found), self.real)
        some = [
            f"{data.name}: {names[i]}/{names[j]} at {f:.6g} Hz"
            for data in self.data
            for f in data.frequency.tolist()
            for k, i in enumerate(data.responses.tolist())
            for m, j in enumerate(data.references.tolist())
            if data.used[k, m]
        ]
        return _both(tuple(some), self.real)


class Compared(Protocol):
    """What a point has to know of its comparison."""

    @property
    def model(self) -> Model:
        """The model."""

    @property
    def weights(self) -> Real:
        """One over the deviation of every row."""

    @property
    def labels(self) -> tuple[str, ...]:
        """What each row is."""

    def evaluate(self, p: Real, before: FrfPoint | None = None) -> FrfPoint:
        """The comparison at ``p``."""


@dataclass(frozen=True)
class FrfPoint:
    """The comparison at one parameter vector: ``values`` (rows,) model − measured, ``jacobian``
    (rows, parameters)."""

    residual: Compared
    p: Real
    values: Real
    jacobian: Real

    @property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows."""
        return self.values, self.residual.weights, self.residual.labels

    def system(self) -> LinearSystem:
        """Linearised at this point; exact everywhere where every DOF is measured, the weights are
        fixed and the model is linear in p (3.9)."""
        columns = tuple(q.name for q in self.residual.model.parameters)
        return LinearSystem(
            self.jacobian,
            self.jacobian @ self.p - self.values,
            self.residual.weights,
            columns,
            self.residual.labels,
        )


def _both(names: tuple[str, ...], real: bool) -> tuple[str, ...]:
    """The names of real rows, or of real and imaginary ones."""
    if real:
        return names
    return (*(f"{s} (real)" for s in names), *(f"{s} (imaginary)" for s in names))


def parts(values: Field, real: bool) -> Real:
    """Real rows, then imaginary ones where there are any."""
    return np.asarray(values.real) if real else np.concatenate([values.real, values.imag])

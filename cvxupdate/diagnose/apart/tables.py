"""What further figures of modes would tell explanations of tables apart: shapes at another place,
modes above those that were measured, frequencies with a known mass put on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.apart.known_mass import with_lump
from cvxupdate.diagnose.apart.measurement import (
    Measurement,
    pairs_of,
    root_of_covariance,
    separation,
)
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.settings import (
    FREQUENCY_DISCREPANCY,
    KNOWN_MASS,
    SHAPE_DISCREPANCY,
    UNSTATED_SHAPE,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.physics.added_mass import translations
from cvxupdate.physics.place import numbered
from cvxupdate.residual.eigen import derivatives_of, eigenvalue_derivatives, shape_derivatives
from cvxupdate.residual.follow import follow
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_rows import channel_rows

FURTHER = 3  # modes above those that were measured
PLACES = 200  # DOFs at which shapes are compared
MASSES = 40  # nodes that a known mass is tried on

Rows = tuple[Real, Real, Real]  # figures, their derivatives to every unknown, their deviations


@dataclass(frozen=True)
class Figures:
    """Fitted ``hypotheses`` on tables of modes."""

    evidence: ModesEvidence
    hypotheses: tuple[Hypothesis, ...]

    @cached_property
    def _roots(self) -> list[Real]:
        return [
            root_of_covariance(h.fit.point.system().weighted()[0], h.fit.setting.scales)
            for h in self.hypotheses
        ]

    @cached_property
    def _precision(self) -> float:
        """Relative deviation of a frequency to come: as those there are, and what a sound model
        may miss."""
        own = [t.frequency_std / t.frequency for t in self.evidence.tables.measured]
        return float(np.hypot(np.median(np.concatenate(own)), FREQUENCY_DISCREPANCY))

    def _told(self, rows: Sequence[Rows]) -> tuple[float, ...]:
        out = []
        for i, j in pairs_of(len(rows)):
            (y, J, std), (z, I, _) = rows[i], rows[j]
            count = min(len(y), len(z))
            weight = 1.0 / std[:count]
            spread = np.hstack([J[:count] @ self._roots[i], I[:count] @ self._roots[j]])
            out.append(separation(weight * (y[:count] - z[:count]), weight[:, None] * spread))
        return tuple(out)

    def found(self) -> list[Measurement]:
        """All that was tried."""
        return [*self._shapes(), *self._further(), *self._masses()]

    def moved(self, h: Hypothesis, p: Real) -> float:
        """Deviations between the frequencies that were measured and the same ones with other
        unknowns ``p`` of an explanation."""
        point: ModalPoint = h.fit.point
        model, own = point.residual.model, _places(point)
        y, J, std = _frequencies(model, point.p, point.modes, np.asarray(own), self._precision)
        m = model.matrices(p)
        modes = model_modes(model, len(point.modes.eigenvalues), p, m)
        at = follow(point.modes.shapes[:, own], m.M, modes, np.zeros(0, dtype=np.int64))
        z, _, _ = _frequencies(model, p, modes, np.asarray(at), self._precision)
        root = self._roots[self.hypotheses.index(h)]
        return separation((z - y) / std, (J @ root) / std[:, None])

    def _further(self) -> list[Measurement]:
        points = [h.fit.point for h in self.hypotheses]
        first = 1 + max(max(int(q.max(initial=0)) for q in p.places) for p in points)
        count = first + FURTHER
        rows = []
        for p in points:
            modes = model_modes(p.residual.model, count, p.p, p.matrices)
            at = np.arange(first, min(count, len(modes.eigenvalues)))
            rows.append(_frequencies(p.residual.model, p.p, modes, at, self._precision))
        shared = min(len(y) for y, _, _ in rows)
        if not shared:
            return []
        start = first - points[0].modes.rigid + 1
        which = numbered(range(start, start + shared))
        says = f"the frequency of mode{'s' if shared > 1 else ''} {which} too"
        return [Measurement("modes", says, self._told(rows))]

    def _shapes(self) -> list[Measurement]:
        model = self.evidence.model
        sensors = self._sensors()
        places = [int(i) for i in np.flatnonzero(model.dof_kind < 3) if int(i) not in sensors]
        places = places[:: max(1, len(places) // PLACES)]
        if not places:
            return []
        seen = [self._seen(h.fit.point, sensors, places) for h in self.hypotheses]
        out = []
        for k, row in enumerate(places):
            label = model.labels[row]
            told = self._told([(y[:, k], J[:, k], std[:, k]) for y, J, std in seen])
            out.append(Measurement("shape", f"the shapes at {label} too", told, label))
        return out

    def _sensors(self) -> list[int]:
        """DOFs where shapes were measured; where none were, the one that moves most in all modes,
        to which motion elsewhere is compared."""
        rows = [
            channel_rows(t, self.evidence.model)
            for t in self.evidence.tables.fit
            if t.shapes is not None
        ]
        known = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *rows]))
        known = known[known >= 0]
        if len(known):
            return [int(i) for i in known]
        point = self.hypotheses[0].fit.point
        own = np.abs(point.modes.shapes[:, _places(point)])
        own[self.evidence.model.dof_kind >= 3] = 0.0
        return [int(np.argmax(np.min(own / own.max(axis=0), axis=1)))]

    def _seen(
        self, point: ModalPoint, sensors: Sequence[int], places: Sequence[int]
    ) -> tuple[Real, Real, Real]:
        """(modes, places) entries in units of the shape's length at the sensors, their derivatives
        (modes, places, unknowns) and deviations."""
        derivatives = derivatives_of(point.residual.model, point.p)
        rows = np.array([*sensors, *places])
        first = self.hypotheses[0].fit.point.modes.shapes[:, _places(self.hypotheses[0].fit.point)]
        Y, D, S = [], [], []
        for k, at in enumerate(_places(point)):
            phi, lam = point.modes.shapes[:, at], float(point.modes.eigenvalues[at])
            try:
                d = shape_derivatives(point.matrices, lam, phi, rows, derivatives)
            except CvxupdateError:  # a repeated eigenvalue: its shapes are not told one by one
                continue
            own, there = phi[rows[: len(sensors)]], phi[rows[len(sensors) :]]
            length = float(np.linalg.norm(own))
            if length <= 0.0:
                continue
            turn = 1.0 if float(own @ first[rows[: len(sensors)], k]) >= 0.0 else -1.0
            along = own @ d[: len(sensors)] / length**2
            Y.append(turn * there / length)
            D.append(turn * (d[len(sensors) :] - np.outer(there, along)) / length)
            largest = float(np.abs(phi[rows]).max()) / length
            S.append(np.full(len(places), largest * np.hypot(UNSTATED_SHAPE, SHAPE_DISCREPANCY)))
        none = np.zeros((0, len(places)))
        if not Y:
            return none, np.zeros((0, len(places), len(point.p))), none
        return np.array(Y), np.array(D), np.array(S)

    def _masses(self) -> list[Measurement]:
        model = self.evidence.model
        mass = KNOWN_MASS * model.total_mass()
        nodes = list(translations(model))
        out = []
        for node in nodes[:: max(1, len(nodes) // MASSES)] if mass > 0.0 else []:
            try:
                rows = [self._loaded(h, node, mass) for h in self.hypotheses]
            except CvxupdateError:
                continue
            says = f"the same frequencies with a known mass of {mass:.3g} kg at node {node}"
            out.append(Measurement("mass", says, self._told(rows), node=node, mass=mass))
        return out

    def _loaded(self, h: Hypothesis, node: int, mass: float) -> Rows:
        point: ModalPoint = h.fit.point
        grown = with_lump(self.evidence, point.residual.model, node)
        p = np.append(point.p, mass / grown.parameters[-1].unit_size)
        m = grown.matrices(p)
        modes = model_modes(grown, len(point.modes.eigenvalues), p, m)
        at = follow(point.modes.shapes[:, _places(point)], m.M, modes, np.zeros(0, dtype=np.int64))
        y, J, std = _frequencies(grown, p, modes, np.asarray(at), self._precision)
        return y, J[:, :-1], std


def _places(point: ModalPoint) -> list[int]:
    """The modes that were measured, table by table, each once."""
    own = [int(i) for k in range(len(point.residual.fit)) for i in point.places[k] if i >= 0]
    return list(dict.fromkeys(own))


def _frequencies(model: Model, p: Real, modes: Modes, at: np.ndarray, precision: float) -> Rows:
    """Logarithms of frequencies with their derivatives."""
    lam = modes.eigenvalues[at]
    J = eigenvalue_derivatives(lam, modes.shapes[:, at], derivatives_of(model, p))
    return 0.5 * np.log(lam), J / (2.0 * lam[:, None]), np.full(len(lam), precision)

"""A table of shapes checked against the FRFs that were measured at the same sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.correlate.reciprocal import reciprocal_vectors
from cvxupdate.correlate.result import FrfComparison, ModePair, ReciprocalCheck, ShapeComparison
from cvxupdate.errors import InputError

UNSTATED = 1e-3
"""Relative noise of FRFs without variances: singular values below it are noise."""


def with_reciprocal(
    shapes: ShapeComparison, frfs: Sequence[FrfComparison], pairs: Sequence[ModePair]
) -> ShapeComparison:
    """With the check of He and Imregun (1995; with losses Imregun and Ewins 1996) on the first FRFs
    that have all its sensors and all its modes in their band; as it is where there are none."""
    found = shapes.correlation
    keep = np.array(found.complete, dtype=np.int64)
    if not len(keep):
        return shapes
    f, x = found.frequency_measured[keep], found.shapes_measured[:, keep]
    zeta = {p.number: p.damping for p in pairs if p.recording == shapes.recording}
    loss = np.array([2.0 * (zeta.get(int(shapes.measured_number[k])) or 0.0) for k in keep])
    for frf in frfs:
        inside = frf.frequency[0] <= f.min() and f.max() <= frf.frequency[-1]
        if not inside or not set(shapes.labels) <= set(frf.responses):
            continue
        rows = [frf.responses.index(label) for label in shapes.labels]
        try:
            got = reciprocal_vectors(
                frf.frequency, frf.measured[:, rows], x, f, loss, frf.quantity, _noise(frf)
            )
        except InputError:
            continue  # another recording may have more lines
        check = ReciprocalCheck(frf.recording, got.orthogonality, got.fit)
        return replace(shapes, reciprocal=check)
    return shapes


def _noise(frf: FrfComparison) -> float:
    """Relative, of the responses as a whole."""
    if frf.variance is None:
        return UNSTATED
    power = float(np.nanmean(np.abs(frf.measured) ** 2))
    noise = float(np.nanmean(frf.variance)) / max(power, np.finfo(float).tiny)
    return float(np.clip(np.sqrt(noise), 1e-6, 0.1)) if np.isfinite(noise) else UNSTATED

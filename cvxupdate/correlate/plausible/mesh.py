"""Meshes of plates that are too coarse for what was recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.fe.block import Block
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import Spec

PER_HALF_WAVE = 3.0
"""Elements that half a wave of bending should span: the rectangle of four nodes then shifts a
frequency by about two per cent, which is what a modulus is known to."""
SHIFT = 1.0 / 60.0
"""Relative shift of a natural frequency over (q h)², q the wave number and h the element's side
(simply supported sheets of 4 to 16 elements a side; tests compare it)."""


def mesh_doubts(spec: Spec, model: Model, recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """Plates whose elements are too long for the highest frequency that is to be fitted, where no
    `refine` divides them."""
    asked = spec.update is not None and spec.update.refine is not None
    tops = [_top(r) for r in recordings if r.origin.use == "fit"]
    if asked or spec.model.refine is not None or not tops:
        return ()
    top = max(tops)
    spans = [_span(model, b, top) for b in model.blocks if b.kind.name == "plate"]
    least = min(spans, default=np.inf)
    if not 0.0 < least < PER_HALF_WAVE:
        return ()
    shift = SHIFT * (np.pi / least) ** 2
    at = max(np.floor(10.0 * least) / 10.0, 0.1)  # 2.97 is not "3, where it should be 3"
    says = (
        f"At {top:.4g} Hz half a wave of bending spans {at:.2g} plate elements, where it should "
        f"span {PER_HALF_WAVE:.0f}: the mesh alone shifts frequencies there by about "
        f"{100 * shift:.1g} %, which an update takes for its parameters. With `refine = 8` in "
        "[model] the same elements are taken on finer parts"
    )
    return (Doubt("mesh", f"{says}.", value=float(shift)),)


def _top(recording: Recording) -> float:
    """The highest frequency of a recording, Hz."""
    if isinstance(recording, TimeHistory):
        return recording.band[1] if recording.band is not None else 0.0
    known = isinstance(recording, FrequencyResponse | ModeTable) and len(recording.frequency)
    return float(np.max(recording.frequency)) if known else 0.0


def _span(model: Model, block: Block, top: float) -> float:
    """Elements, along their longest sides, in half a wave of bending at ``top`` Hz."""
    if block.nodes is None or not len(block.nodes) or top <= 0.0:
        return float("inf")
    p = {k: np.real(v) for k, v in block.properties.items()}
    corners = model.xyz[block.nodes]
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    stiff = p["E"] * p["thickness"] ** 3 / (12.0 * (1.0 - p["nu"] ** 2))
    stiff = stiff * np.minimum(p["Dx"], p["Dy"])
    heavy = p["rho"] * p["thickness"] * (2.0 * np.pi * top) ** 2
    q = (heavy / stiff) ** 0.25
    return float((np.pi / np.maximum(q * side, 1e-300)).min())

"""What is diagnosed: the recordings at every level of smoothing, the model with its ordinary
parameters, whether the response depends on the level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.fit import CREDIBLE, LEVELS, MASS_STD, STIFFNESS_STD
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.mesh import NONE, MeshError
from cvxupdate.diagnose.signals import Signal, lines_of, smooth
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property, select_parameters
from cvxupdate.physics.base import Wanted
from cvxupdate.recordings.measured import band_of
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory
from cvxupdate.spec import Spec

WIDE = 0.3  # of a group's p-value: how far a parameter error is followed


@dataclass(frozen=True)
class Data:
    """Recordings at every level, and sharp ones for scoring."""

    fit: tuple[FrequencyResponse | TimeHistory, ...]
    hold_out: tuple[FrequencyResponse | TimeHistory, ...]
    levels: tuple[tuple[Signal, ...], ...]
    sharp: tuple[Signal, ...]
    sharp_hold_out: tuple[Signal, ...]
    top: float
    bottom: float
    mesh: MeshError = NONE
    sheared: MeshError = NONE

    def mesh_of(self, model: Model) -> MeshError:
        """The mesh error of a hypothesis: where it lets beams deform in shear, that of beams which
        do."""
        return (
            self.sheared
            if self.sheared is not NONE and any(q.of == "shear" for q in model.parameters)
            else self.mesh
        )


def prepare(recordings: Sequence[FrequencyResponse | TimeHistory]) -> Data:
    """Transform every recording once."""
    fit_ = tuple(r for r in recordings if r.origin.use == "fit")
    hold = tuple(r for r in recordings if r.origin.use != "fit")
    bands = [band_of(r) for r in fit_]
    lines, held = lines_of(fit_), lines_of(hold)
    return Data(
        fit_,
        hold,
        tuple(tuple(smooth(x, e) for x in lines) for e in LEVELS),
        tuple(smooth(x, 0.0) for x in lines),
        tuple(smooth(x, 0.0) for x in held),
        max(b[1] for b in bands),
        min(b[0] for b in bands),
    )


def ordinary(model: Model, wide: bool = False, scatter: float = 1.0) -> Model:
    """A stiffness and a mass p-value for every group: what drawing and laboratory always differ by,
    within credible bounds (``wide``: far beyond).

    ``scatter``: part of the usual scatter, of a model that was calibrated on this very structure.
    """
    wanted: list[Wanted] = []
    for of, std in (("stiffness", STIFFNESS_STD), ("mass", MASS_STD)):
        limit = WIDE if wide else CREDIBLE * std * scatter
        groups: dict[str, list[int]] = {}
        for block in model.blocks:
            if has_property(block, of):
                for element, group in zip(block.ids.tolist(), block.groups, strict=True):
                    groups.setdefault(group or block.kind.name, []).append(element)
        wanted += [
            Wanted(f"{g}.{of}", of, tuple(dict.fromkeys(ids)), g, -limit, limit)
            for g, ids in groups.items()
        ]
    return model.with_parameters(select_parameters(wanted, model))


def level_dependence(data: Data) -> tuple[float, float] | None:
    """How much the transfer function changes between drive levels: (relative change, the same in
    noise alone); None where no two levels compare.

    A record that starts from rest gives H(s) = Y(s) / U(s) at every s without averaging, so two
    runs of one linear structure agree to noise.
    """
    best: tuple[float, float] | None = None
    single = [
        s for s in data.sharp if s.U.shape[1] == 1 and s.U.shape[2] == 1 and s.level is not None
    ]
    for i, a in enumerate(single):
        for b in single[i + 1 :]:
            if a.level == b.level or a.inputs != b.inputs or a.sensors != b.sensors:
                continue
            n = min(len(a.s), len(b.s))
            x, y = _transfer(a, n), _transfer(b, n)
            if x is None or y is None:
                continue
            size = np.sqrt(np.mean(np.abs(x[0]) ** 2))
            change = (
                float(np.sqrt(np.mean(np.abs(x[0] - y[0]) ** 2)) / size),
                float(np.sqrt(np.mean(x[1] ** 2 + y[1] ** 2)) / size),
            )
            if best is None or change[0] > best[0]:
                best = change
    return best


def _transfer(signal: Signal, n: int) -> tuple[np.ndarray, np.ndarray] | None:
    """H1 under a kernel of a twentieth of the frequency, and its noise: (points, sensors) each."""
    f = signal.s.imag[:n] / (2 * np.pi)
    centres = np.geomspace(f[0] * 1.1, f[-1] / 1.1, 60)
    kernel = (0.05 * centres[:, None]) / (
        (centres[:, None] - f) ** 2 + (0.05 * centres[:, None]) ** 2
    )
    drive = signal.U[:n, 0, 0]
    mix = kernel * np.conj(drive) / (kernel @ np.abs(drive) ** 2)[:, None]
    return mix @ signal.Y[:n, :, 0], np.sqrt(np.abs(mix) ** 2 @ signal.std[:n, :, 0] ** 2)


def held_dofs(
    model: Model,
    supports: Sequence[tuple[Sequence[int] | str, Sequence[str]]],
    active: Sequence[str],
) -> list[tuple[int, str]]:
    """(node, kind) of every held DOF of an active kind."""
    out = []
    for nodes, dofs in supports:
        for node in model.node_ids.tolist() if nodes == "all" else nodes:
            out += [(int(node), d) for d in dofs if d in active]
    return out


def release_from(spec: Spec) -> Callable[[int, str], Model]:
    """Builds the ordinary undamped model without one support DOF."""

    def release(node: int, kind: str) -> Model:
        supports = []
        for s in spec.model.supports:
            nodes = [n.id for n in spec.model.nodes] if s.nodes == "all" else list(s.nodes)
            for n in nodes:
                kept = tuple(k for k in s.dofs if (n, k) != (node, kind))
                if kept:
                    supports.append(s.model_copy(update={"nodes": (n,), "dofs": kept}))
        freed = replace(
            spec, model=spec.model.model_copy(update={"supports": tuple(supports)}), update=None
        )
        return ordinary(undamped(build_model(freed)), scatter=spec.diagnose.scatter)

    return release

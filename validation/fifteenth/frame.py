"""Frames of beams as they really are: fine meshes, own places, joints that give."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.fifteenth import beam
from validation.fifteenth.shapes import DOFS, Effect, Member, Structure
from validation.fifteenth.system import Array, Rows, System

STIFF = 3e11  # N/m and N m/rad: rigid for all that matters


class Frame(System):
    """Timoshenko beams; places are (member, s) with s from 0 to 1, or a point's name."""

    def __init__(
        self, structure: Structure, effects: list[Effect], scatter: dict[str, tuple[float, float]]
    ) -> None:
        super().__init__()
        self.structure, self.effects, self.scatter = structure, effects, scatter
        self.point_dofs = {p: self.new(6) for p in structure.points}
        self.mesh: dict[str, tuple[list[Any], float, Array, tuple[float, float]]] = {}
        for m in structure.members:
            self._member(m)
        self._supports()
        for p, mass in structure.lumps.items():
            self.lump(p, mass, size=(mass / 7850) ** (1 / 3))

    def _end(self, m: Member, which: str, t: Array) -> Any:
        """The DOFs of a member's end: those of the point, or its own across a joint."""
        point = self.point_dofs[m.a if which == "a" else m.b]
        joints = [e for e in self.effects if e.kind == "joint" and e.at == (m.name, which)]
        if not joints:
            return point
        own = self.new(6)
        local = np.full(6, STIFF)
        soft = 0.0  # compliances of several joints add up
        for e in joints:
            soft += 1 / e.numbers["kr"]
        local[4:] = 1 / soft
        if any(e.numbers.get("twist") for e in joints):
            local[3] = 1 / soft
        r = np.kron(np.eye(2), t)
        k = r.T @ np.diag(local) @ r
        self.add("K", np.concatenate([point, own]), np.block([[k, -k], [-k, k]]))
        return own

    def _factors(self, m: Member, s: float) -> tuple[float, float, float]:
        """Factors on stiffness, mass and height at s of a member."""
        out = [1.0, 1.0, 1.0]
        for e in self.effects:
            lo, hi = e.numbers.get("part", (0.0, 1.0))
            if e.kind == "member" and e.at == m.name and lo <= s <= hi:
                for i, key in enumerate(("stiffness", "mass", "height")):
                    out[i] *= e.numbers.get(key, 1.0)
        return out[0], out[1], out[2]

    def _member(self, m: Member) -> None:
        a, b = (np.array(self.structure.points[p], float) for p in (m.a, m.b))
        t, total = beam.axes(a, b), float(np.linalg.norm(b - a))
        n = max(11, 4 * m.n + 3)
        length, r = total / n, np.kron(np.eye(4), t)
        nodes = (
            [self._end(m, "a", t)] + [self.new(6) for _ in range(n - 1)] + [self._end(m, "b", t)]
        )
        fe, fr = self.scatter[m.group]
        E, rho, phis = m.material.E * fe, m.material.rho * fr, (0.0, 0.0)
        G = E / (2 * (1 + m.material.nu))
        for i in range(n):
            ks, ms, hs = self._factors(m, (i + 0.5) / n)
            A, iy, iz, j, kap = m.section.values(hs)
            stiff = (E * A * ks, G * j * ks, E * iz * ks, E * iy * ks, kap * G * A * ks)
            mass = (rho * A * ms, rho * (iy + iz) * ms, rho * iy * ms, rho * iz * ms)
            k, mm, phis = beam.matrices(length, stiff, mass)
            idx = np.concatenate([nodes[i], nodes[i + 1]])
            self.add("K", idx, r.T @ k @ r)
            self.add("M", idx, r.T @ mm @ r)
        self.mesh[m.name] = (nodes, length, t, phis)

    def _supports(self) -> None:
        feet = {e.at: e for e in self.effects if e.kind == "foot"}
        for p, dofs in self.structure.held.items():
            e = feet.get(p)
            for d in dofs:
                i = self.point_dofs[p][DOFS.index(d)]
                k = e.numbers.get(d) if e else None
                if k is None:
                    self.fixed.add(int(i))
                else:
                    self.add("K", np.array([i]), np.array([[k]]))
            if e and e.numbers.get("m"):
                self.lump(p, e.numbers["m"], size=e.numbers.get("size", 0.1))
        left = [i for i, d in enumerate(DOFS) if d not in self.structure.dofs]
        if left:
            self.plane(left)

    def plane(self, left: list[int]) -> None:
        """Holds what a plane model has not."""
        known = list(self.point_dofs.values())
        for nodes, *_ in self.mesh.values():
            known += nodes
        for dofs in known:
            self.fixed.update(int(dofs[i]) for i in left)

    def rows(self, at: Any) -> Rows:
        """Motions of a point or of a place on a member."""
        if isinstance(at, str):
            return self.point_dofs[at], np.eye(6)
        nodes, length, t, phis = self.mesh[at[0]]
        x = min(max(at[1], 0.0), 1.0) * (len(nodes) - 1)
        i = min(int(x), len(nodes) - 2)
        n = beam.interpolation(x - i, length, phis)
        b = np.kron(np.eye(2), t.T) @ n @ np.kron(np.eye(4), t)
        return np.concatenate([nodes[i], nodes[i + 1]]), b

"""Bodies in their modes, as CalculiX answers (``ccx``; Dhondt, The Finite Element Method for
Three-Dimensional Thermomechanical Applications, 2004), kept as small compressed files so that the
laboratory runs where CalculiX is not. SI units."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from validation.generated.cases import Case
from validation.generated.laboratory import Complex, Effect, Real

MODES = 60  # of a frame, in its plane and out of it: those of bars grow with the square
REACH, FIRST = 3.0, 40  # modes of a plate: up to so many times the band; how many at first
LONGEST = 300.0  # seconds of CalculiX
ZONE = "LOSSY"  # name of the set of elements that lose energy
AXES = "xyz"
ASIDE = 1e-2  # of a motion: below, a mode of a frame is out of its plane

Point = tuple[int, str]  # node of the drawing, direction


@dataclass(frozen=True)
class Body:
    """The body in its lowest modes: ``omega`` (m,) rad/s, ``shapes`` (points, m) at ``points``,
    normalised in mass, ``rest`` (points, points) the flexibility of all other modes, ``lossy`` (m,
    m) the stiffness of the elements that lose energy, ``zeta`` (m,), ``eta`` their loss factor."""

    points: tuple[Point, ...]
    omega: Real
    shapes: Real
    rest: Real
    lossy: Real
    zeta: Real
    eta: float = 0.0

    def rows(self, places: Sequence[Point]) -> list[int]:
        """Rows of (node, direction)."""
        return [self.points.index((int(n), str(d))) for n, d in places]

    def damped(self) -> tuple[Real, Real]:
        """Natural frequencies (Hz) and damping ratios, losses taken one mode at a time."""
        own = self.eta * np.diag(self.lossy) / (2.0 * self.omega**2)
        return self.omega / (2.0 * np.pi), self.zeta + own

    def accelerance(self, s: Complex, sensors: Sequence[int], drives: Sequence[int]) -> Complex:
        """(m/s²)/N at points ``s``, (points, sensors, drives)."""
        poles = s[:, None] ** 2 + 2.0 * self.zeta * self.omega * s[:, None] + self.omega**2
        Z = np.broadcast_to(1j * self.eta * self.lossy, (len(s), *self.lossy.shape)).copy()
        index = np.arange(len(self.omega))
        Z[:, index, index] += poles
        moved = np.linalg.solve(Z, self.shapes[list(drives)].T.astype(complex)[None])
        still = self.rest[np.ix_(list(sensors), list(drives))]
        return np.asarray(s[:, None, None] ** 2 * (self.shapes[list(sensors)] @ moved + still))

    def with_losses(self, zeta: Real, effects: Sequence[Effect]) -> Body:
        """With the bench's ratios, mode by mode, and what the effects lose."""
        ratios, eta = np.resize(zeta, len(self.omega)).astype(float), 0.0
        for e in effects:
            if e["physics"] == "mass_proportional_damping":
                ratios = ratios + e["alpha"] / (2.0 * self.omega)
            elif e["physics"] == "structural_damping":
                eta = float(e["eta"])
        return replace(self, zeta=ratios, eta=eta)

    def at(self, points: Sequence[Point]) -> Body:
        """Of these points only."""
        wanted = tuple(dict.fromkeys((int(n), str(d)) for n, d in points))
        rows = self.rows(wanted)
        rest = self.rest[np.ix_(rows, rows)]
        return replace(self, points=wanted, shapes=self.shapes[rows], rest=rest)


def save(path: Path, body: Body) -> None:
    """A body as a file, damping left out."""
    path.parent.mkdir(parents=True, exist_ok=True)
    single = {
        k: np.asarray(getattr(body, k), dtype=np.float32) for k in ("shapes", "rest", "lossy")
    }
    nodes = np.array([n for n, _ in body.points], dtype=np.int32)
    axes = np.array([AXES.index(d) for _, d in body.points], dtype=np.int8)
    np.savez_compressed(path, node=nodes, axis=axes, omega=body.omega, **single)


def load(path: Path) -> Body:
    """That of a file."""
    with np.load(path, allow_pickle=False) as f:
        at = zip(f["node"].tolist(), f["axis"].tolist(), strict=True)
        shapes, rest, lossy = (f[k].astype(float) for k in ("shapes", "rest", "lossy"))
        points = tuple((n, AXES[k]) for n, k in at)
        return Body(points, f["omega"], shapes, rest, lossy, np.zeros(len(f["omega"])))


def run(text: Sequence[str], folder: Path) -> None:
    """CalculiX on a deck ``body``.

    Raises
    ------
    subprocess.SubprocessError, OSError
        Where CalculiX fails, or is not there.
    """
    (folder / "body.inp").write_text("\n".join(text) + "\n", encoding="ascii")
    subprocess.run(
        ["ccx", "-i", "body"], cwd=folder, check=True, capture_output=True, timeout=LONGEST
    )


def matrices(text: Sequence[str], folder: Path) -> tuple[sp.csc_array, sp.csc_array, list[str]]:
    """K, M and the DOFs "node.direction" of a deck."""
    step = ["*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "10", "*END STEP"]
    run([*text, *step], folder)
    dofs = (folder / "body.dof").read_text(encoding="ascii").split()
    out = []
    for name in ("sti", "mas"):
        i, j, value = _columns(folder / f"body.{name}")
        upper = sp.coo_array((value, (i - 1, j - 1)), shape=(len(dofs),) * 2).tocsc()
        whole = upper + upper.T - sp.diags_array(upper.diagonal())
        out.append(sp.csc_array(whole))
    return out[0], out[1], dofs


def _columns(path: Path) -> tuple[np.ndarray, np.ndarray, Real]:
    """Row, column, value of a stored matrix."""
    numbers = np.fromfile(path, sep=" ").reshape(-1, 3)
    return numbers[:, 0].astype(int), numbers[:, 1].astype(int), numbers[:, 2]


def factors(A: sp.csc_array) -> spl.SuperLU:
    """Of a symmetric matrix, in an order that keeps it sparse."""
    symmetric = {"SymmetricMode": True}
    return spl.splu(sp.csc_matrix(A), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)


def reduced(
    K: sp.csc_array,
    M: sp.csc_array,
    rows: Sequence[int],
    points: Sequence[Point],
    top: float,
    lossy: sp.csc_array | None = None,
) -> Body:
    """The body in its modes up to `REACH` times ``top`` (Hz) and the flexibility of all others at
    a frequency that lies between two natural frequencies of the band."""
    count, inverse = FIRST, factors(K + M)
    while True:
        values, vectors = spl.eigsh(
            K,
            count,
            M,
            sigma=-1.0,
            v0=np.ones(K.shape[0]),
            OPinv=spl.LinearOperator(K.shape, matvec=inverse.solve, dtype=float),
        )
        if values.max() > (2.0 * np.pi * REACH * top) ** 2:
            break
        count *= 2
    order = np.argsort(values)
    omega, vectors = np.sqrt(np.maximum(values[order], 1e-12)), vectors[:, order]
    k = max(1, int(np.sum(omega < 2.0 * np.pi * top))) - 1
    square = 0.5 * (omega[k - 1] ** 2 + omega[k] ** 2)
    load = np.zeros((K.shape[0], len(rows)))
    load[list(rows), range(len(rows))] = 1.0
    whole = factors(K - square * M).solve(load)[list(rows)]
    shapes = vectors[list(rows)]
    rest = whole - shapes @ (shapes.T / (omega**2 - square)[:, None])
    held = np.zeros((len(omega),) * 2) if lossy is None else vectors.T @ (lossy @ vectors)
    return Body(tuple(points), omega, shapes, (rest + rest.T) / 2.0, held, np.zeros(len(omega)))


def asked(at: Mapping[int, int], lossy: bool, drives: Sequence[Point]) -> list[str]:
    """The steps: frequencies, the motion of the drawing's nodes, energies where some are lost; then
    the deflection by a newton at each of the ``drives``."""
    out = ["*NSET,NSET=SENSE", *(f"{k}," for k in at.values())]
    out += ["*STEP", "*FREQUENCY", str(MODES), "*NODE PRINT,NSET=SENSE", "U"]
    out += [f"*EL PRINT,ELSET={ZONE},TOTALS=ONLY", "ELSE"] if lossy else []
    out += ["*END STEP"]
    for n, d in drives:
        out += ["*STEP", "*STATIC", "*CLOAD,OP=NEW", f"{at[n]},{AXES.index(d) + 1},1."]
        out += ["*NODE PRINT,NSET=SENSE", "U", "*END STEP"]
    return out


def read(path: Path, at: Mapping[int, int], axes: str, drives: Sequence[Point]) -> Body:
    """The modes of an answer that move in ``axes``, and what all other modes do at rest to the
    columns of the ``drives``: frames are hundreds of times as stiff along their members as across,
    and few modes stretch them."""
    row = {k: r for r, k in enumerate(at.values())}
    f, blocks, energy = _numbers(path.read_text(encoding="ascii").splitlines(), row)
    moved = np.moveaxis(np.array(blocks[: len(f)]), 0, -1)  # (nodes, 3, modes)
    plane = [AXES.index(d) for d in axes]
    whole, inside = (np.sum(x**2, axis=(0, 1)) for x in (moved, moved[:, plane]))
    kept = inside > ASIDE * whole
    omega = 2.0 * np.pi * np.array(f)[: moved.shape[2]][kept]
    points = tuple((n, d) for n in at for d in axes)
    shapes = moved[:, plane].reshape(len(points), -1)[:, kept]
    lossy = (
        np.diag(2.0 * np.array(energy[: len(f)])[kept]) if energy else np.zeros((len(omega),) * 2)
    )
    rest = np.zeros((len(points),) * 2)
    for point, block in zip(drives, blocks[len(f) :], strict=True):
        column = points.index(point)
        whole = block[:, plane].reshape(-1)
        rest[:, column] = whole - shapes @ (shapes[column] / omega**2)
    return Body(points, omega, shapes, rest, lossy, np.zeros(len(omega)))


def _numbers(
    text: Sequence[str], row: Mapping[int, int]
) -> tuple[list[float], list[Real], list[float]]:
    """Frequencies (Hz), displacements (nodes, 3) and energies of every mode."""
    f: list[float] = []
    blocks: list[Real] = []
    energy: list[float] = []
    table = ""
    for line in text:
        words = line.split()
        if "E I G E N V A L U E   O" in line:
            table = "values"
        elif "P A R T I C I P A T I O N" in line:
            table = ""
        elif line.strip().startswith("displacements"):
            blocks.append(np.zeros((len(row), 3)))
            table = "shape"
        elif line.strip().startswith("total internal energy"):
            table = "energy"
        elif table == "values" and len(words) == 5 and words[0].isdigit():
            f.append(float(words[3]))
        elif table == "shape" and len(words) == 4 and words[0].isdigit():
            blocks[-1][row[int(words[0])]] = [float(w) for w in words[1:]]
        elif table == "energy" and len(words) == 1:
            energy.append(float(words[0]))
            table = ""
    return f, blocks, energy


def points_of(case: Case) -> list[Point]:
    """Where a case is heard and driven."""
    return [*case.sensors, *case.drives]

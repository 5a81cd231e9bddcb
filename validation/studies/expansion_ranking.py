"""Which expansion is best? Section 2.10 of the thesis quotes a ranking: SEREP, SEREPa, TAM,
dynamic, IRS, Guyan.

Two structures with unequal spans are measured at ten translations; the model that expands the
shapes has wrong element stiffnesses (15 % r.m.s.), the shapes have noise. Three sets of places:
good (effective independence), spread evenly, and poor (crowded into one corner). Five modes are
measured. The error of a shape is its mass-weighted distance from the true complete shape, after the
best scaling. Every case is drawn many times; methods are ranked by the median error. A method that
cannot be formed at all (SEREPa inverts the shapes of ten modes at the ten sensors) counts 100 %.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from cvxupdate.errors import ModelError
from cvxupdate.reduction import (
    dynamic,
    effective_independence,
    expand_each,
    guyan,
    gysin,
    hybrid_tam,
    irs,
    partition,
    serep,
    serepa,
    tam,
)
from validation.studies.wish import Wish

QUOTED = ("SEREP", "SEREPa", "TAM", "dynamic", "IRS", "Guyan")
METHODS = (*QUOTED, "hybrid TAM", "Gysin")
MEASURED, SENSORS = 5, 10
NOISE = (0.0, 0.02, 0.1)


@dataclass(frozen=True)
class Skeleton:
    """Nodes (n, 2) in m, elements (e, 2), the fixed DOFs; three DOFs x, y, rz per node."""

    name: str
    nodes: np.ndarray
    elements: np.ndarray
    fixed: tuple[int, ...]

    def matrices(self, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """K and M of aluminium beams 20 x 10 mm, element e with ``factor[e]`` times its
        stiffness."""
        N = 3 * len(self.nodes)
        K, M = np.zeros((N, N)), np.zeros((N, N))
        E, A, I, m = 70e9, 2e-4, 1.67e-9, 2700.0 * 2e-4
        for e, (a, b) in enumerate(self.elements):
            d = self.nodes[b] - self.nodes[a]
            L = float(np.hypot(*d))
            R = np.kron(
                np.eye(2), np.array([[d[0] / L, d[1] / L, 0], [-d[1] / L, d[0] / L, 0], [0, 0, 1]])
            )
            k, c = np.zeros((6, 6)), np.zeros((6, 6))
            k[np.ix_([0, 3], [0, 3])] = E * A / L * np.array([[1, -1], [-1, 1]])
            c[np.ix_([0, 3], [0, 3])] = m * L / 6 * np.array([[2, 1], [1, 2]])
            bend = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
            k[bend] = (
                E
                * I
                / L**3
                * np.array(
                    [
                        [12, 6 * L, -12, 6 * L],
                        [6 * L, 4 * L**2, -6 * L, 2 * L**2],
                        [-12, -6 * L, 12, -6 * L],
                        [6 * L, 2 * L**2, -6 * L, 4 * L**2],
                    ]
                )
            )
            c[bend] = (
                m
                * L
                / 420
                * np.array(
                    [
                        [156, 22 * L, 54, -13 * L],
                        [22 * L, 4 * L**2, 13 * L, -3 * L**2],
                        [54, 13 * L, 156, -22 * L],
                        [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
                    ]
                )
            )
            at = np.r_[3 * a : 3 * a + 3, 3 * b : 3 * b + 3]
            K[np.ix_(at, at)] += factor[e] * R.T @ k @ R
            M[np.ix_(at, at)] += R.T @ c @ R
        free = np.setdiff1d(np.arange(N), self.fixed)
        return K[np.ix_(free, free)], M[np.ix_(free, free)]

    def translations(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the free translations, and the place of each, (t, 2)."""
        free = np.setdiff1d(np.arange(3 * len(self.nodes)), self.fixed)
        rows = np.flatnonzero(free % 3 != 2)
        return rows, self.nodes[free[rows] // 3]


def bays() -> Skeleton:
    """Two bays side by side, clamped at two feet: 20 elements."""
    corners = np.array(
        [[0.0, 0.0], [0.62, 0.0], [1.1, 0.05], [1.15, 0.44], [0.6, 0.4], [0.03, 0.43]]
    )
    nodes, elements = list(corners), []
    for a, b, parts in (
        (0, 1, 3),
        (1, 2, 3),
        (2, 3, 3),
        (3, 4, 3),
        (4, 5, 3),
        (5, 0, 3),
        (1, 4, 2),
    ):
        last = a
        for k in range(1, parts):
            nodes.append(corners[a] + (corners[b] - corners[a]) * k / parts)
            elements.append((last, len(nodes) - 1))
            last = len(nodes) - 1
        elements.append((last, b))
    return Skeleton("two bays", np.array(nodes), np.array(elements), (0, 1, 2, 6, 7, 8))


def mast() -> Skeleton:
    """A bent cantilever of 24 unequal elements."""
    rng = np.random.default_rng(3)
    along = np.concatenate([[0.0], np.cumsum(rng.uniform(0.03, 0.07, 24))])
    nodes = np.column_stack([along, 0.25 * along**2])
    return Skeleton(
        "bent mast", nodes, np.column_stack([np.arange(24), np.arange(1, 25)]), (0, 1, 2)
    )


def places(structure: Skeleton, phi: np.ndarray) -> dict[str, np.ndarray]:
    """Good, spread and poor sets of ten translations."""
    rows, where = structure.translations()
    # A corner that moves: the farthest from the supports, so that the crowd of sensors is not
    # simply blind.
    corner = where[np.argmax(np.linalg.norm(where - where[0], axis=1))]
    near = np.argsort(np.linalg.norm(where - corner, axis=1), kind="stable")[:SENSORS]
    return {
        "good": effective_independence(phi[:, :SENSORS], SENSORS, rows),
        "spread": rows[np.linspace(0, rows.size - 1, SENSORS).round().astype(int)],
        "poor": rows[near],
    }


def expansions(
    K: np.ndarray, M: np.ndarray, phi: np.ndarray, sensors: np.ndarray
) -> dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]:
    """Every method as a function of measured shapes (n, modes) and frequencies (modes,)."""
    split = partition(K, M, sensors)
    kept = phi[:, :MEASURED]
    fixed = {
        "SEREP": serep(kept, sensors),
        "TAM": tam(kept, sensors),
        "IRS": irs(split),
        "Guyan": guyan(split),
        "hybrid TAM": hybrid_tam(kept, M, guyan(split)),
    }
    with suppress(
        ModelError
    ):  # where the places cannot tell ten modes apart SEREPa does not exist: that is its result
        fixed["SEREPa"] = serepa(phi[:, :SENSORS], sensors)
    each = {"dynamic": dynamic, "Gysin": gysin}
    out: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {}
    for name, T in fixed.items():
        out[name] = lambda x, f, T=T: T.expand(x)
    for name, make in each.items():
        out[name] = lambda x, f, make=make: expand_each(lambda v: make(split, v), x, f)
    return out


def shape_error(found: np.ndarray, true: np.ndarray, M: np.ndarray) -> float:
    """Mean over modes of min_s ‖s φ − φ_true‖_M / ‖φ_true‖_M = sin of the angle between them."""
    cross = np.sum(found * (M @ true), axis=0) ** 2
    own = np.sum(found * (M @ found), axis=0) * np.sum(true * (M @ true), axis=0)
    return float(np.mean(np.sqrt(np.maximum(0.0, 1.0 - cross / own))))


def experiment(draws: int = 40) -> dict[tuple[str, str, float], dict[str, float]]:
    """Median error of every method, keyed by (structure, places, noise)."""
    out = {}
    for structure in (bays(), mast()):
        e = len(structure.elements)
        K, M = structure.matrices(np.ones(e))
        phi = eigh(K, M)[1]
        for name, sensors in places(structure, phi).items():
            methods = expansions(K, M, phi, sensors)
            for noise in NOISE:
                rng = np.random.default_rng(11)
                errors: dict[str, list[float]] = {m: [] for m in METHODS}
                for _ in range(draws):
                    Kx, _ = structure.matrices(np.clip(1 + 0.15 * rng.standard_normal(e), 0.4, 1.6))
                    value, true = eigh(Kx, M, subset_by_index=[0, MEASURED - 1])
                    seen = true[sensors]
                    seen = seen + noise * np.sqrt(np.mean(seen**2, axis=0)) * rng.standard_normal(
                        seen.shape
                    )
                    for m in methods:
                        errors[m].append(
                            shape_error(methods[m](seen, np.sqrt(value) / (2 * np.pi)), true, M)
                        )
                out[structure.name, name, noise] = {
                    m: float(np.median(v)) if v else 1.0 for m, v in errors.items()
                }
    return out


def mean_ranks(
    results: dict[tuple[str, str, float], dict[str, float]],
    methods: tuple[str, ...] = QUOTED,
    chosen: Callable[[tuple[str, str, float]], bool] = lambda key: True,
) -> dict[str, float]:
    """Mean rank (1 best) of the methods over the chosen cases; equal errors share a rank."""
    rows = [[results[k][m] for m in methods] for k in results if chosen(k)]
    ranks = [
        [
            1
            + sum(o < 0.999 * v for o in row)
            + 0.5 * (sum(abs(o - v) <= 1e-3 * v for o in row) - 1)
            for v in row
        ]
        for row in rows
    ]
    return dict(zip(methods, np.mean(ranks, axis=0).tolist(), strict=True))


def table(results: dict[tuple[str, str, float], dict[str, float]]) -> str:
    """The errors in per cent, and the mean ranks among the six methods that were ranked."""
    lines = [
        f"{'structure':10s} {'places':7s} {'noise':>6s} " + " ".join(f"{m:>10s}" for m in METHODS)
    ]
    for (structure, name, noise), row in results.items():
        lines.append(
            f"{structure:10s} {name:7s} {100 * noise:5.0f}% "
            + " ".join(f"{100 * row[m]:9.2f}%" for m in METHODS)
        )
    for title, chosen in (
        ("all cases", lambda k: True),
        ("good places", lambda k: k[1] == "good"),
        ("spread places", lambda k: k[1] == "spread"),
        ("poor places", lambda k: k[1] == "poor"),
        ("no noise", lambda k: k[2] == 0.0),
        ("10 % noise", lambda k: k[2] == 0.1),
    ):
        ranks = mean_ranks(results, chosen=chosen)
        order = sorted(ranks, key=lambda m: ranks[m])
        lines.append(f"{title:14s} " + ", ".join(f"{m} {ranks[m]:.1f}" for m in order))
    return "\n".join([*lines, "quoted         " + ", ".join(QUOTED)])


def figure(results: dict[tuple[str, str, float], dict[str, float]], path: Path) -> Path:
    """Error of each method against noise, one panel per structure and set of places."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(11, 6.5), layout="constrained")
    FigureCanvasAgg(fig)
    structures, sets = sorted({k[0] for k in results}), ("good", "spread", "poor")
    axes = fig.subplots(len(structures), len(sets), sharex=True, sharey=True)
    colours = (
        "#0072b2",
        "#56b4e9",
        "#009e73",
        "#e69f00",
        "#d55e00",
        "#000000",
        "#cc79a7",
        "#999999",
    )
    for i, structure in enumerate(structures):
        for j, name in enumerate(sets):
            ax = axes[i, j]
            for m, colour in zip(METHODS, colours, strict=True):
                ax.plot(
                    [100 * n for n in NOISE],
                    [100 * results[structure, name, n][m] for n in NOISE],
                    color=colour,
                    label=m,
                    marker="o",
                    markersize=4,
                    linestyle="-" if m in QUOTED else ":",
                )
            ax.set_yscale("log")
            ax.set_title(f"{structure}, {name} places", fontsize=10)
            ax.grid(True, which="both", alpha=0.25)
    for ax in axes[-1]:
        ax.set_xlabel("noise on the shapes (% of r.m.s.)")
    for ax in axes[:, 0]:
        ax.set_ylabel("error of expanded shape (%)")
    fig.legend(
        *axes[0, 0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(METHODS),
        fontsize=9,
    )
    fig.savefig(path, dpi=150)
    return path


def main(out: Path, wish: Wish) -> dict[tuple[str, str, float], dict[str, float]]:
    """Run the whole experiment, print the table and write table and figure; gives the errors."""
    results = experiment(wish.draws or (3 if wish.quick else 40))
    text = table(results)
    (out / "table.txt").write_text(text + "\n", encoding="utf-8")
    print(text)
    print(figure(results, out / "expansion_ranking.png"))
    return results

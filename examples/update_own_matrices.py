"""`update` and `solvers`: K and M came from another program; what must change in two of its groups?

The matrices are dense here (they may be sparse, or files of Nastran, Abaqus, CalculiX, Ansys), the
groups are those parts of K that belong to a storey. A constraint keeps every change within 30 %.

Run: python examples/update_own_matrices.py [folder]
"""

import sys
from pathlib import Path

import numpy as np

import cvxupdate

M = np.diag([120.0, 110.0, 90.0])
LABELS = ["n1.x", "n2.x", "n3.x"]


def storey(k, upper, lower=None):
    """The stiffness of a storey between two floors (or a floor and the ground)."""
    part = np.zeros((3, 3))
    part[upper, upper] = k
    if lower is not None:
        part[lower, lower] = k
        part[upper, lower] = part[lower, upper] = -k
    return part


def building(low=9.0e5, middle=7.0e5, top=6.0e5):
    """Three floors; the stiffness of each storey is a group by itself."""
    parts = {"low": storey(low, 0), "middle": storey(middle, 1, 0), "top": storey(top, 2, 1)}
    return cvxupdate.Model.from_matrices(sum(parts.values()), M, labels=LABELS, groups=parts)


def main(folder="out/examples/update_own_matrices"):
    """Update by three measured modes, print, compare the solvers, draw."""
    out = Path(folder)
    real = building(low=8.1e5, top=6.6e5).modes(3)
    rng = np.random.default_rng(3)
    noisy = real.frequencies + 0.005 * rng.standard_normal(3)
    test = cvxupdate.Modes(noisy, real.shapes, real.labels, frequency_std=0.005, shape_std=0.02)
    wanted = [f"{group}: stiffness" for group in ("low", "middle", "top")]
    updated = cvxupdate.update(
        building(), test, wanted, constraints={"bounds": {"lower": -0.3, "upper": 0.3}}
    )
    updated.save(out)
    for q in updated.parameters:
        print(f"{q.name}: {100 * q.p:+.2f} ± {100 * q.p_std:.2f} %")
    _, rows, spread = cvxupdate.solvers(out / "updated" / "problem.toml")
    optimal = [r.solver for r in rows if r.status == "optimal"]
    print(f"the first step by {len(optimal)} solvers: objectives within {spread:.1g}")
    updated.plot_parameters().savefig(out / "parameters.png", dpi=120)
    return updated


if __name__ == "__main__":
    main(*sys.argv[1:2])

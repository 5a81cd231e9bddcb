"""`diagnose`: somebody left something heavy on a cantilever. Where, and how heavy?

The bar is modelled from arrays; accelerances at four places were measured twice (here: made up,
with 0.2 % noise), so that one set can be held out.

Run: python examples/find_a_mass.py [folder]
"""

import sys
from pathlib import Path

import numpy as np

import cvxupdate

SENSORS = ["n3.y", "n5.y", "n7.y", "n9.y"]
LINES = np.arange(4.0, 420.0, 1.0)


def cantilever(*more):
    """A steel bar 0.8 m long, 30 x 10 mm, clamped at node 1; ``more`` elements beside the bar."""
    x = np.linspace(0.0, 0.8, 9)
    bar = {
        "type": "beam2d",
        "nodes": np.c_[np.arange(1, 9), np.arange(2, 10)],
        "material": "steel",
        "section": "bar",
        "group": "bar",
    }
    return cvxupdate.Model(
        np.c_[x, 0 * x],
        [bar, *more],
        materials={"steel": {"E": 207e9, "rho": 7850.0}},
        sections={"bar": {"shape": "rectangle", "width": 0.03, "height": 0.01}},
        supports={1: "all"},
        damping={"kind": "modal", "zeta": 0.01},
    )


def measured(force, use, seed):
    """Accelerances of the real bar, which carries 0.12 kg at node 6."""
    real = cantilever({"type": "mass", "nodes": [[6]], "m": 0.12})
    H = real.frf(LINES, SENSORS, [force], "acceleration").H
    noise = 0.002 * np.abs(H)
    rng = np.random.default_rng(seed)
    H = H + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    return cvxupdate.Frf(
        LINES, H, SENSORS, [force], quantity="acceleration", variance=2 * noise**2, use=use
    )


def main(folder="out/examples/find_a_mass"):
    """Diagnose, print what is said, write the page, draw one response before and after."""
    out = Path(folder)
    test = [measured("n9.y", "fit", 1), measured("n5.y", "hold-out", 2)]
    found = cvxupdate.diagnose(cantilever(), test)
    found.save(out)
    print(found.says)
    for f in found.findings:
        print(f"{f.title}: {f.parameters}, confidence {f.confidence:.0%}")
    found.plot_frf(response="n9.y").savefig(out / "response.png", dpi=120)
    return found


if __name__ == "__main__":
    main(*sys.argv[1:2])

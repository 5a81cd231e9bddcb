"""`plan`: where to put six accelerometers and the shaker before anybody goes to the laboratory.

A grid of beams is drawn; two of its groups are to be updated. The plan says which places see the
modes, which force drives them, which frequency lines tell most, and how well both stiffnesses will
be known.

Run: python examples/plan_a_test.py [folder]
"""

import sys
from pathlib import Path

import numpy as np

import cvxupdate


def grid():
    """A rectangle of beams 0.9 x 0.6 m with a rib across, clamped at two corners."""
    nodes = {1 + i + 4 * j: (0.3 * i, 0.3 * j, 0.0) for j in range(3) for i in range(4)}
    rim = [(1, 2), (2, 3), (3, 4), (4, 8), (8, 12), (12, 11), (11, 10), (10, 9), (9, 5), (5, 1)]
    ribs = [(2, 6), (6, 10), (3, 7), (7, 11)]
    pairs = [*rim, *ribs]
    beams = {
        "type": "beam3d",
        "nodes": pairs,
        "material": "steel",
        "section": "bar",
        "group": ["rim"] * len(rim) + ["rib"] * len(ribs),
    }
    return cvxupdate.Model(
        nodes,
        [beams],
        materials={"steel": {"E": 207e9, "nu": 0.3, "rho": 7850.0}},
        sections={"bar": {"shape": "rectangle", "width": 0.03, "height": 0.012}},
        supports={1: "all", 4: "all"},
    )


def main(folder="out/examples/plan_a_test"):
    """Plan, print the places and what they will tell, draw both."""
    out = Path(folder)
    found = cvxupdate.plan(
        grid(), ["rim: E", "rib: E"], sensors=6, modes=4, band=(5.0, 120.0), noise=0.02
    )
    found.save(out)
    print(f"sensors {', '.join(found.sensors[0].labels)}; force {', '.join(found.exciters.labels)}")
    best = found.lines[0]
    for name, deviation in zip(found.parameters, best.deviations, strict=True):
        print(f"{name}: known to {100 * deviation:.2f} % from {len(best.lines)} lines")
    print(f"bearable noise: {100 * np.array(best.bears):.3g} %")
    found.plot_places().savefig(out / "places.png", dpi=120)
    found.plot_indicator().savefig(out / "indicator.png", dpi=120)
    return found


if __name__ == "__main__":
    main(*sys.argv[1:2])

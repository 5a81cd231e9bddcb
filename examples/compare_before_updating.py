"""`correlate` and `check`: is the model worth updating, and are the recordings in order?

A portal with a soft foot, of which three modes were measured at five places. MAC, frequencies and
the modes that belong together are looked at before anything is changed.

Run: python examples/compare_before_updating.py [folder]
"""

import sys
from pathlib import Path

import cvxupdate


def portal(foot=1e7):
    """Two columns and a beam of steel; the left foot turns on a spring of ``foot`` N·m/rad."""
    nodes = {1: (0, 0), 2: (0, 0.3), 3: (0, 0.6), 4: (0.4, 0.6), 5: (0.9, 0.6), 6: (0.9, 0)}
    pairs = [(1, 2), (2, 3), (3, 4), (4, 5), (5, 6)]
    frame = {"type": "beam2d", "nodes": pairs, "material": "steel", "section": "tube"}
    hinge = {"type": "spring", "dof": "rz", "nodes": [[1]], "k": foot}
    return cvxupdate.Model(
        nodes,
        [frame, hinge],
        materials={"steel": {"E": 207e9, "rho": 7850.0}},
        sections={"tube": {"shape": "rectangle", "width": 0.03, "height": 0.02}},
        supports={1: ["x", "y"], 6: "all"},
    )


def main(folder="out/examples/compare_before_updating"):
    """Check, compare, print the pairs, draw MAC and frequencies."""
    out = Path(folder)
    seen = portal(4e4).modes(3).at(["n2.x", "n3.x", "n4.y", "n5.x", "n5.y"])
    test = cvxupdate.Modes(seen.frequencies, seen.shapes, seen.labels, frequency_std=0.05)
    facts = cvxupdate.check(portal(), test)
    print(f"{facts['free DOFs']} free DOFs; warnings: {facts['warnings'] or 'none'}")
    compared = cvxupdate.correlate(portal(), test)
    compared.save(out)
    for m in compared.modes:
        error = 100 * (m.model / m.measured - 1)
        print(f"measured {m.measured:7.2f} Hz, model {m.model:7.2f} Hz, {error:+.2f} %")
    print(f"least MAC {compared.fit['fit']['mac_min']['after']:.3f}")
    compared.plot_mac().savefig(out / "mac.png", dpi=120)
    compared.plot_frequencies().savefig(out / "frequencies.png", dpi=120)
    return compared


if __name__ == "__main__":
    main(*sys.argv[1:2])

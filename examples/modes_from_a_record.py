"""`inspect` and `identify`: an unknown file of recordings becomes a table of modes with deviations.

A logger wrote accelerations of three floors and the force of a shaker to a CSV file. `inspect` says
what is in it, `identify` estimates the frequency responses and fits modes.

Run: python examples/modes_from_a_record.py [folder]
"""

import sys
from pathlib import Path

import numpy as np
from scipy.linalg import eigh
from scipy.signal import cont2discrete, dlsim

import cvxupdate

RATE, SECONDS, DAMPING = 256.0, 60.0, 0.01
K = np.array([[9.0e4, -4.0e4, 0], [-4.0e4, 7.5e4, -3.5e4], [0, -3.5e4, 3.5e4]])
M = np.array([6.0, 5.0, 4.0])


def record(path):
    """A CSV file as the logger writes it: time, three accelerations in m/s², the force in N."""
    rng = np.random.default_rng(7)
    eigenvalue, phi = eigh(K, np.diag(M))
    w = np.sqrt(eigenvalue)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(w**2), -np.diag(2 * DAMPING * w)]])
    B = np.vstack([np.zeros((3, 1)), phi[2:3].T])
    C = np.hstack([-phi * w**2, -phi * 2 * DAMPING * w])
    system = cont2discrete((A, B, C, phi @ phi[2:3].T), 1 / RATE, "foh")
    force = 20 * rng.standard_normal(int(RATE * SECONDS))
    t, motion, _ = dlsim(system, force)
    motion += 0.01 * motion.std(axis=0) * rng.standard_normal(motion.shape)
    table = np.c_[t.ravel(), motion, force]
    head = "time [s],1:+X [m/s^2],2:+X [m/s^2],3:+X [m/s^2],3:+X [N]"
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.8g")
    return w / (2 * np.pi)


def main(folder="out/examples/modes_from_a_record"):
    """Write the file, look into it, identify, print, draw the stabilisation diagram."""
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    true = record(out / "logger.csv")
    print(cvxupdate.inspect(out / "logger.csv"))
    found = cvxupdate.identify(out / "logger.csv", band=(4.0, 40.0))
    found.save(out)
    for m, f in zip(found.sets[0].modes, true, strict=True):
        print(
            f"{m.frequency:.3f} ± {m.frequency_std:.3f} Hz (true {f:.3f}), "
            f"damping {100 * m.damping:.2f} ± {100 * m.damping_std:.2f} %"
        )
    found.plot_stabilisation().savefig(out / "stabilisation.png", dpi=120)
    return found, true


if __name__ == "__main__":
    main(*sys.argv[1:2])

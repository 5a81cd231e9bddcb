"""What mass do hammer and shaker see at the tip? The limit of 1/|accelerance| far above the
resonances, against the weighed masses.

A ratio of the two FRFs line by line mixes the scale of the force channel with resonances that
shifted between the tests. The limit of a modal fit (one mode for massa1, two for the others) does
not: every mode shifts, the mass at the tip stays.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.real.forces
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cvxupdate.recordings.lines import sine_fit
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory
from validation.real.table import first_line, load

BEAM = 0.445 * 33.0 / 140.0
TESTS = (
    ("problem_massa1.toml", 1.437, 22.0, [(11.5,)]),
    ("problem.toml", 0.270, 30.0, [(16.0, 22.0), (19.8, 26.5)]),
    ("problem_massa4.toml", 0.128, 30.0, [(16.0, 20.5), (22.5, 26.5)]),
)


def apparent_mass(
    f: NDArray[np.float64], H: NDArray[np.complex128], starts: list[tuple[float, ...]]
) -> tuple[float, NDArray[np.float64]]:
    """Mass (kg) that the fitted accelerance tends to, and the resonances (Hz); hysteretic modes,
    robust fit of the logarithm."""

    def model(p: NDArray[np.float64]) -> NDArray[np.complex128]:
        fr, eta, a = p.reshape(-1, 3).T
        return np.asarray(
            np.sum(
                np.exp(a) * -(f[:, None] ** 2) / (fr**2 * (1.0 + 1j * eta) - f[:, None] ** 2),
                axis=1,
            )
        )

    def misfit(p: NDArray[np.float64]) -> NDArray[np.float64]:
        r = np.log(model(p) / H)
        return np.concatenate([r.real, (r.imag + np.pi) % (2.0 * np.pi) - np.pi])

    level = float(np.log(np.median(np.abs(H))))
    fits = [
        least_squares(misfit, np.ravel([(fr, 0.04, level) for fr in start]), loss="soft_l1")
        for start in starts
    ]
    p = min(fits, key=lambda fit: fit.cost).x.reshape(-1, 3)
    return 1.0 / float(np.sum(np.exp(p[:, 2]))), np.sort(p[:, 0])


def main() -> None:
    """Print apparent over weighed mass for every test, sine points of 8 Hz and more taken
    together."""
    for file, tip, high, starts in TESTS:
        weighed = tip + 0.054 + BEAM
        points = []
        for record in load("unb-cantilever-tip-mass", file):
            if isinstance(record, FrequencyResponse):
                use = (record.frequency > 8.0) & (record.frequency < high)
                mass, resonances = apparent_mass(record.frequency[use], record.H[use, 0, 0], starts)
                print(
                    f"{file}: {record.origin.name}: {mass:.3g} kg, {mass / weighed:.2f} times "
                    f"the weighed {weighed:.3g} kg; {np.round(resonances, 1)} Hz"
                )
            elif isinstance(record, TimeHistory) and record.origin.name.startswith("shaker"):
                f, a, _ = sine_fit(
                    record.data, record.rate, first_line(record.data[:, 1], record.rate, 0.5, 100.0)
                )
                points.append((f, a[0] / a[1]))
        f, H = (
            np.array(column)
            for column in zip(
                *sorted((p for p in points if p[0] > 8.0), key=lambda p: p[0]), strict=True
            )
        )
        mass, resonances = apparent_mass(f, H, starts)
        print(
            f"{file}: shaker, {len(f)} sines: {mass:.3g} kg, {mass / weighed:.2f} times the "
            f"weighed {weighed:.3g} kg; {np.round(resonances, 1)} Hz"
        )


if __name__ == "__main__":
    main()

"""FRFs of random modal models with noise that nobody states: ``python -m validation.modal``.

Two to twelve modes in a band with others outside, undamped to 3 %, some of them close, one to
twelve responses and one or two forces; noise of 0.1 to 10 %, of the channels or in proportion to
the response. Synthesised here from poles and shapes, without the package. Seeds below 1000 are for
development, the others are only counted.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.errors import CvxupdateError
from cvxupdate.recordings.identify import IdentifiedModes, identify_modes
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from validation.calibrate import rate

LOW, HIGH = 20.0, 200.0  # Hz
HEARD = 30.0  # deviations of the noise, over all lines, from which a mode must not be missed
NEAR = 0.002  # relative: as near as a mode must be found, or three of its deviations
TWICE = 0.004  # relative: a second mode so near to a true one is that one twice


@dataclass(frozen=True)
class Case:
    """``frequency`` (modes,) Hz, ``heard`` (modes,) by how many deviations of the noise each shows,
    and the recording."""

    frequency: np.ndarray
    heard: np.ndarray
    frf: FrequencyResponse


@dataclass(frozen=True)
class Count:
    """Modes that were found, that were heard and missed, that are none, that came twice; of all."""

    right: int = 0
    missed: int = 0
    invented: int = 0
    doubled: int = 0
    whole: int = 0

    def __add__(self, other: Count) -> Count:
        return Count(*(a + b for a, b in zip(self.figures, other.figures, strict=True)))

    @property
    def figures(self) -> tuple[int, ...]:
        """In the order of the fields."""
        return (self.right, self.missed, self.invented, self.doubled, self.whole)


def draw(seed: int) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([77, seed])
    modes = int(rng.integers(2, 13))
    f = np.sort(rng.uniform(LOW * 1.15, HIGH * 0.93, modes))
    if rng.random() < 0.3 and modes > 2:
        k = int(rng.integers(modes - 1))
        f[k + 1] = f[k] * (1 + rng.uniform(0.004, 0.02))
        f.sort()
    kind = str(rng.choice(["light", "middle", "none"], p=[0.4, 0.35, 0.25]))
    ratios = {
        "light": rng.uniform(0.0005, 0.006, modes),
        "middle": rng.uniform(0.005, 0.03, modes),
        "none": np.zeros(modes),
    }[kind]
    outputs, inputs = int(rng.choice([1, 2, 3, 6, 12])), int(rng.choice([1, 1, 2]))
    inputs = min(inputs, outputs)
    shapes = rng.normal(size=(modes, outputs))
    forces = shapes[:, :inputs] if rng.random() < 0.7 else rng.normal(size=(modes, inputs))
    lines = np.arange(LOW, HIGH, rng.choice([0.1, 0.25, 0.5]))
    beyond = np.array([LOW * 0.4, HIGH * 1.5, HIGH * 2.2])
    others = (rng.normal(size=(3, outputs)), 2.0 * rng.normal(size=(3, inputs)))
    every, damping = np.r_[f, beyond], np.r_[ratios, np.full(3, 0.005)]
    w, w0 = 2 * np.pi * lines[:, None], 2 * np.pi * every
    terms = -(w**2) / (w0**2 - w**2 + 2j * damping * w0 * w)
    residues = np.einsum("mo,mi->moi", np.r_[shapes, others[0]], np.r_[forces, others[1]])
    H = np.einsum("fm,moi->foi", terms, residues)
    level, relative = float(10 ** rng.uniform(-3, -1)), rng.random() < 0.5
    std = level * (np.abs(H) if relative else 3.0 * np.sqrt(np.median(np.abs(H) ** 2, axis=0)))
    std = np.broadcast_to(std, H.shape)
    own = np.abs(terms[:, :modes, None, None] * residues[:modes]) ** 2
    heard = np.sqrt(np.sum(own / std[:, None] ** 2, axis=(0, 2, 3)))
    H = H + std * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    channels = tuple(Channel(n + 1, "z", "acceleration") for n in range(outputs))
    drives = tuple(Channel(n + 1, "z", "force") for n in range(inputs))
    origin = Origin(f"modal-{seed}", "generated", "fit")
    return Case(f, heard, FrequencyResponse(origin, lines, H, "acceleration", channels, drives))


def counted(case: Case, found: IdentifiedModes | None) -> Count:
    """What was found beside what is there; each found mode stands for one."""
    at: Any = np.zeros(0) if found is None else found.frequency
    std: Any = np.zeros(0) if found is None else np.nan_to_num(found.frequency_std)
    used: set[int] = set()
    right = missed = 0
    for f, heard in zip(case.frequency, case.heard, strict=True):
        near = np.flatnonzero(np.abs(at - f) <= np.maximum(3.0 * std, NEAR * f))
        free = [int(j) for j in near if int(j) not in used]
        if free:
            used.add(min(free, key=lambda j: abs(float(at[j]) - f)))
            right += 1
        else:
            missed += heard > HEARD
    more = [j for j in range(len(at)) if j not in used]
    twice = sum(bool(np.any(np.abs(at[j] - case.frequency) <= TWICE * at[j])) for j in more)
    return Count(right, missed, len(more) - twice, twice, len(case.frequency))


def tried(seed: int) -> Count:
    """One case identified."""
    case = draw(seed)
    try:
        return counted(case, identify_modes(case.frf))
    except CvxupdateError:
        return counted(case, None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try seeds, and print the totals."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=0, help="the first")
    parser.add_argument("--count", type=int, default=40)
    options = parser.parse_args(arguments)
    total = sum((tried(options.seed + k) for k in range(options.count)), Count())
    print(
        f"{options.count} cases: found {rate(total.right, total.whole)} modes; heard and missed "
        f"{total.missed}, invented {total.invented}, twice {total.doubled}"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

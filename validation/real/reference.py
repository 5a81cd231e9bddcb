"""Which mass went, beside the healthy state as reference: every layout of the beam with six masses,
five frequencies a state, all words, nothing calibrated by hand.

``CVXUPDATE_DATA=/path/to/data python -m validation.real.reference [--rigid] [--every 3]``. The
clamp is drawn as springs and a mass that nobody fitted, or ``--rigid``.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cvxupdate.study import diagnose
from validation.real import problem_files as make
from validation.real.table import PROBLEMS

STATES = ("reference", "later")


def problem(folder: Path, k: int, f: np.ndarray, where: np.ndarray, rigid: bool) -> Path:
    """Layout ``k`` with its own positions: ``f`` (2, 5) Hz before and after."""
    tables = [
        make.mode_rows([(i + 1, v, make.REPEAT * v) for i, v in enumerate(own)], "fit", s, s)
        for s, own in zip(STATES, f.tolist(), strict=True)
    ]
    path = folder / f"layout_{k + 1:02d}.toml"
    clamp = None if rigid else make.Clamp()
    path.write_text(make.beam(f"Layout {k + 1}", where, clamp, "".join(tables)), encoding="utf-8")
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each layout, and the totals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigid", action="store_true", help="the clamp drawn rigid")
    parser.add_argument("--every", type=int, default=1, help="only every so many layouts")
    o = parser.parse_args(arguments)
    known = tomllib.loads((PROBLEMS / "truth.toml").read_text(encoding="utf-8"))
    truth, (f, positions) = known["six_masses"], make.layouts()
    which = range(0, len(positions), o.every)
    placed, sized, sure, wrong = 0, 0, 0, 0
    with TemporaryDirectory() as folder:
        for k in which:
            found = diagnose(problem(Path(folder), k, f[:, k], positions[k], o.rigid))
            first = found.findings[0] if found.findings else None
            print(f"{k + 1:3d} {found.verdict}: {found.says}", flush=True)
            if first is None:
                continue
            node = make.beam_mesh(positions[k])[1][truth["mass"]]
            named = first.physics == "added_mass" and first.place.nodes == (node,)
            if not named or first.parameters["m"] > 0.0:
                wrong += first.confidence >= 0.5
                continue
            placed += 1
            sure += first.confidence >= 0.5
            off = abs(first.parameters["m"] + truth["m"])
            sized += off <= 2.0 * first.deviations["m"]
    print(
        f"{placed} of {len(which)} name a mass taken off at the node of L1 ({sure} with 0.5 or "
        f"more), {sized} within two deviations of the documented one; {wrong} name something else "
        "with 0.5"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

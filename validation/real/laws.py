"""Claims on real parts and circuits whose force is no linear one: the friction damper's ten runs
one by one, and the silverbox simulated freely beside what was not fitted.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.real.diagnoses silverbox (or the damper's
data set)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import resample

from cvxupdate.correlate.response_error import simulated_history
from cvxupdate.recordings.types import TimeHistory
from cvxupdate.study import open_problem
from validation.real import table
from validation.real.claim import Claim, folder_of, found_text, held_out, said_of, whole

KIP, INCH = 4448.2216, 0.0254
DAMPER, BOX = "friction-damper-backlash", "silverbox"
RATES = ("1Hz", "0.5Hz")
FINER = 8  # points of a simulation in a sample
RUN = """
[[recordings]]
kind = "time"
use = "{use}"
level = {tension}
dataset = "friction-damper-backlash"
file = "ds1_{rate}_{tension:g}lb.json"
time_column = 0
channels = [
  {{ column = 1, quantity = "displacement", node = 1, dof = "x", unit = "in" }},
  {{ column = 2, quantity = "force", node = 1, dof = "x", unit = "kip" }},
]
"""


def damper(truth: Mapping[str, Any], everything: bool = False) -> list[Claim]:
    """Each run fitted by itself, the run of the same tension at the other rate held out: friction
    and free play beside the README's plateaus (of 1 Hz) and travels."""
    rows = []
    for rate, other in (RATES, RATES[::-1]):
        for tension, plateau in zip(truth["tensions"], truth["plateaus"], strict=True):
            said = said_of(damper_run(tension, rate, other))
            found = {f["physics"]: f["parameters"] for f in said["findings"]}
            force = found.get("dry_friction", {}).get("force", np.nan) / KIP
            travel = found.get("clearance", {}).get("gap", np.nan) / INCH
            before, after = held_out(said)
            low, high = truth["travel"]
            off = force / plateau - 1.0
            halved = before is not None and after is not None and after <= 0.5 * before
            note = (
                f"plateau {100.0 * off:+.1f} %, travel {travel:.3f} in, held-out error "
                f"{'halved' if halved else 'not halved'}"
            )
            rows.append(
                Claim(
                    DAMPER,
                    f"{rate}, {tension:g} lb; {other} held out",
                    found_text(said),
                    f"{plateau:.2f} kip, {low:.2f} to {high:.2f} in",
                    bool(abs(off) <= truth["within"] and low <= travel <= high and halved),
                    before,
                    after,
                    said["time"],
                    note,
                )
            )
    both = sum("clearance" in r.claimed and "dry_friction" in r.claimed for r in rows)
    whole_row = (f"friction and free play in {both} of {len(rows)} runs", "both in each")
    rows.append(Claim(DAMPER, "all runs", *whole_row, both >= truth["runs"], None, None, None))
    return rows


def damper_run(tension: float, rate: str, other: str) -> Path:
    """A problem file with one run to fit, and the same tension at another rate held out."""
    source = table.PROBLEMS / DAMPER / "problem.toml"
    text = whole(source)
    model = text[: text.index("[[recordings]]")]
    runs = ((rate, "fit"), (other, "hold-out"))
    for name, use in runs:
        model += RUN.format(use=use, rate=name, tension=float(tension))
    path = folder_of(source).parent / DAMPER / f"run_{rate}_{tension:g}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(model, encoding="utf-8")
    return path


def silverbox(truth: Mapping[str, Any], everything: bool = False) -> list[Claim]:
    """The multisines fitted; the whole growing noise simulated freely by the model that the command
    wrote, r.m.s. beside the measured output without its mean."""
    problem = table.PROBLEMS / BOX / "problem_multisine.toml"
    said = said_of(problem)
    first = said["findings"][0]["physics"] if said["findings"] else "nothing"
    error = free_run(problem, folder_of(problem))
    right = first == "cubic_stiffness" and len(said["findings"]) == 1
    return [
        Claim(
            BOX,
            "ten multisines fitted, the growing noise held out",
            found_text(said),
            f"cubic_stiffness alone, {1e3 * truth['rms']:.2g} mV or less, {truth['seconds']:.0f} s",
            bool(right and error <= truth["rms"] and said["time"] <= truth["seconds"]),
            *held_out(said),
            said["time"],
            f"free run of the written model: {1e3 * error:.3f} mV r.m.s.",
        )
    ]


def free_run(problem: Path, out: Path) -> float:
    """Error (V r.m.s.) of the written model in free simulation of what was held out, means taken
    off; NaN where nothing was written."""
    written = out / "updated" / "problem.toml"
    if not written.is_file():
        return float("nan")
    (held,) = (
        r for r in open_problem(problem)[2] if r.origin.use != "fit" and isinstance(r, TimeHistory)
    )
    _, model, _ = open_problem(written)
    own = simulated_history(model, finer(held)).data[::FINER]
    return float(np.std(own[:, 1] - held.data[:, 1]))


def finer(r: TimeHistory) -> TimeHistory:
    """Without means, between the samples as a band-limited signal goes on: a simulation takes the
    force to be straight between them, which at nine samples a period is 4 % too little."""
    n = len(r.data)
    padded = np.vstack([r.data - r.data.mean(axis=0), np.zeros((n // 8, r.data.shape[1]))])
    data = resample(padded, FINER * len(padded))[: FINER * n]
    return replace(r, rate=FINER * r.rate, data=data)

"""One case made and diagnosed: what processes and workers do, which cannot import a `__main__`."""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from validation import calibrate
from validation.rigs import generate

KEPT = (
    "physics",
    "location",
    "parameters",
    "standard_deviation",
    "confidence",
    "explains",
    "says",
)


def attempt(
    seed: int,
    folder: Path,
    state: str,
    limit: float,
    problem: str = "problem.toml",
    make: Callable[[int, Path], object] = generate.make,
) -> dict[str, Any]:
    """Generate and diagnose one case and write its file: what was said, beside the truth. A case
    that fails or takes more than ``limit`` seconds of the processor has said nothing."""
    said: dict[str, Any] = {}
    why = ""
    with tempfile.TemporaryDirectory() as name:
        make(seed, Path(name))
        truth = tomllib.loads((Path(name) / "truth.toml").read_text(encoding="utf-8"))
        begin, cpu = time.perf_counter(), time.process_time()
        try:
            with calibrate.alarmed(limit, processor=True):
                said = calibrate.diagnose(Path(name) / problem)
        except calibrate.TooLong:
            why = f"more than {limit:.0f} s of the processor"
        except Exception as error:  # whatever goes wrong in one case is reported with it
            why = f"{type(error).__name__}: {error}".replace(name, "…")
    row = {
        "seed": seed,
        "state": state,
        "seconds": round(time.perf_counter() - begin, 2),
        "cpu": round(time.process_time() - cpu, 2),
        "why": why,
        "said": _short(said),
        "truth": truth,
    }
    text = json.dumps(row, ensure_ascii=False, indent=1, allow_nan=False)
    calibrate.save(folder / f"{seed}.json", text + "\n")
    return row


def attempt_reference(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """The same with the recordings of the reference state."""
    return attempt(seed, folder, state, limit, "reference.toml")


def _short(said: Mapping[str, Any]) -> dict[str, Any]:
    out = {k: said[k] for k in ("verdict", "says", "fit", "evidence") if k in said}
    out["findings"] = [
        {
            **{k: f[k] for k in KEPT if k in f},
            "equivalent": [
                {"physics": q["physics"], "location": q["location"]}
                for q in f.get("equivalent", ())
            ],
        }
        for f in said.get("findings", ())
    ]
    return out

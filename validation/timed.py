"""One case made, diagnosed and judged by the seconds of the processor that it takes."""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from validation import calibrate

Make = Callable[[int, Path], Mapping[str, Any]]


def timed(make: Make, seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """The row of a case, and its file in ``folder``. ``make`` writes the case of a seed and gives
    what its row has besides; a case that fails or takes longer than ``limit`` seconds is an outcome
    too."""
    begin = time.process_time()
    try:
        with calibrate.alarmed(limit, processor=True), tempfile.TemporaryDirectory() as name:
            besides = make(seed, Path(name))
            begin = time.process_time()
            truth = tomllib.loads((Path(name) / "truth.toml").read_text(encoding="utf-8"))
            row = calibrate.judged(calibrate.diagnose(Path(name) / "problem.toml"), truth)
            row |= besides
    except calibrate.TooLong:
        row = calibrate.failed(f"longer than {limit:.0f} s of the processor")
    except Exception as error:  # one case that fails is reported, and leaves the others alone
        row = calibrate.failed(f"{type(error).__name__}: {error}")
    row = {"seed": seed, "state": state, "seconds": round(time.process_time() - begin, 2), **row}
    text = json.dumps(row, ensure_ascii=False, indent=1, allow_nan=False)
    calibrate.save(folder / f"{seed}.json", text + "\n")
    return row

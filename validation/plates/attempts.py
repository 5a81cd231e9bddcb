"""One case made and diagnosed: what processes and workers do, which cannot import a `__main__`."""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

from validation import calibrate
from validation.plates.files import make


def tried(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """One case written, diagnosed and judged; its file."""
    begin = time.process_time()
    try:
        with calibrate.alarmed(limit, processor=True), tempfile.TemporaryDirectory() as name:
            case = make(seed, Path(name))
            begin = time.process_time()
            truth = tomllib.loads((Path(name) / "truth.toml").read_text(encoding="utf-8"))
            row = calibrate.judged(calibrate.diagnose(Path(name) / "problem.toml"), truth)
            row["family"] = case.design.family
    except calibrate.TooLong:
        row = calibrate.failed(f"longer than {limit:.0f} s of the processor")
    except Exception as error:  # one case that fails is reported, and leaves the others alone
        row = calibrate.failed(f"{type(error).__name__}: {error}")
    row = {"seed": seed, "state": state, "seconds": round(time.process_time() - begin, 2), **row}
    text = json.dumps(row, ensure_ascii=False, indent=1, allow_nan=False)
    calibrate.save(folder / f"{seed}.json", text + "\n")
    return row

"""Results as JSON: the keys of the contract, in one order, and no NaN or Infinity (they become
null)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.errors import CvxupdateError

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.correlate.result import Compared
    from cvxupdate.update.result import Updated

FIRST = (
    "problem",
    "status",
    "reason",
    "method",
    "solver",
    "iterations",
    "parameters",
    "fit",
    "certificate",
    "time",
)
"""The keys that everybody looks for stand first; the others follow in the order of `Updated`."""


def run_data(updated: Updated) -> dict[str, Any]:
    """`Updated` as plain data: what `result.json` of ``run`` holds."""
    raw = asdict(replace(updated, written=None, geometry=None, overlays=(), matrix_files={}))
    del raw["written"], raw["geometry"], raw["overlays"], raw["matrix_files"]
    if updated.status == "infeasible":
        raw["certificate"] = {
            **raw["certificate"],
            "conflict": updated.conflict,
            "relaxation": updated.relaxation,
        }
    keys = FIRST + tuple(key for key in raw if key not in FIRST)
    out: dict[str, Any] = plain({key: raw[key] for key in keys})
    return out


def correlate_data(compared: Compared) -> dict[str, Any]:
    """`Compared` as plain data: the keys that ``run`` has, and all measures under ``correlation``.

    The curves of frequency responses are left out (they are those of the recordings and of the
    model), and FDAC has four decimals (null with one response, where it is 1 everywhere).
    """
    shapes = [
        {
            **asdict(s),
            "correlation": {**asdict(s.correlation), "pairing": asdict(s.correlation.pairing)},
        }
        for s in compared.shapes
    ]
    frfs = [
        {
            **{
                k: v
                for k, v in asdict(f).items()
                if k not in ("frequency", "measured", "model", "variance")
            },
            "correlation": {
                **asdict(f.correlation),
                "fdac": np.round(f.correlation.fdac, 4) if len(f.responses) > 1 else None,
            },
        }
        for f in compared.frfs
    ]
    return dict(
        plain(
            {
                "problem": compared.problem,
                "status": compared.status,
                "reason": "the model was compared with the recordings; nothing was changed",
                "method": "correlate",
                "solver": None,
                "iterations": 0,
                "parameters": [],
                "fit": compared.fit,
                "certificate": {},
                "time": compared.time,
                "title": compared.title,
                "source": compared.source,
                "path": compared.path,
                "model": compared.model,
                "correlation": {
                    "modes": [asdict(m) for m in compared.modes],
                    "shapes": shapes,
                    "frfs": frfs,
                    "sensors": [asdict(s) for s in compared.sensors],
                },
                "notes": compared.notes,
                "recordings": [asdict(r) for r in compared.recordings],
                "warnings": [asdict(w) for w in compared.warnings],
            }
        )
    )


def solvers_data(name: str, title: str, rows: Sequence[SolverRow], spread: float) -> dict[str, Any]:
    """The comparison of ``solvers`` as plain data; its status is optimal when any solver reached
    the optimum."""
    table = [
        {
            "solver": row.solver,
            "status": row.status,
            "objective": row.objective,
            "iterations": row.iterations,
            "time": row.seconds,
            "certificate": {
                ("primal_residual" if k == "primal" else "dual_residual" if k == "dual" else k): v
                for k, v in row.certificate.as_dict().items()
            },
            "note": row.note,
        }
        for row in rows
    ]
    out: dict[str, Any] = plain(
        {
            "problem": name,
            "title": title,
            "status": overall(rows),
            "spread": spread,
            "solvers": table,
        }
    )
    return out


def overall(rows: Sequence[SolverRow]) -> str:
    """One status for all solvers: optimal if any is, else infeasible if any says so, else
    stopped."""
    found = {row.status for row in rows}
    return next((s for s in ("optimal", "infeasible") if s in found), "stopped")


def plain(value: object) -> Any:
    """Any result as dictionaries, lists, text, numbers and None; numbers that are not finite become
    None.

    Raises
    ------
    CvxupdateError
        For a value that JSON has no form for.
    """
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, complex):
        return {"re": plain(value.real), "im": plain(value.imag)}
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, Sequence | set | frozenset):
        return [plain(v) for v in value]
    raise CvxupdateError(
        f"a result holds a {type(value).__name__}, which JSON cannot hold. This is a fault of "
        "cvxupdate; please report it."
    )


def dumps(data: Mapping[str, Any]) -> str:
    """JSON text, indented, with the characters of names as they are; ends with a newline."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"

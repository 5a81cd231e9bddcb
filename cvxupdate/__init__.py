"""cvxupdate: update structural dynamics models by convex programs, and say what physics they leave
out.

>>> import cvxupdate
>>> updated = cvxupdate.run("problems/structure_a/problem.toml")
>>> updated.status
'converged'

Everything below loads on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cvxupdate.errors import (
        ConvergenceError,
        CvxupdateError,
        Fault,
        InfeasibleError,
        InputError,
        ModelError,
        ProblemFileError,
        RecordingError,
    )
    from cvxupdate.report import run_files, solvers_files
    from cvxupdate.spec import Spec, check_problem, load_problem, schema
    from cvxupdate.study import check, open_problem, run, solvers
    from cvxupdate.update.result import ModeResult, ParameterResult, Updated

__version__ = "0.1.0"

__all__ = [
    "ConvergenceError",
    "CvxupdateError",
    "Fault",
    "InfeasibleError",
    "InputError",
    "ModeResult",
    "ModelError",
    "ParameterResult",
    "ProblemFileError",
    "RecordingError",
    "Spec",
    "Updated",
    "__version__",
    "check",
    "check_problem",
    "load_problem",
    "open_problem",
    "run",
    "run_files",
    "schema",
    "solvers",
    "solvers_files",
]

_HOME = {
    "cvxupdate.errors": (
        "ConvergenceError",
        "CvxupdateError",
        "Fault",
        "InfeasibleError",
        "InputError",
        "ModelError",
        "ProblemFileError",
        "RecordingError",
    ),
    "cvxupdate.report": ("run_files", "solvers_files"),
    "cvxupdate.spec": ("Spec", "check_problem", "load_problem", "schema"),
    "cvxupdate.study": ("check", "open_problem", "run", "solvers"),
    "cvxupdate.update.result": ("ModeResult", "ParameterResult", "Updated"),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'cvxupdate' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

"""cvxupdate: update structural dynamics models by convex programs, and say what physics they leave
out.

>>> import cvxupdate
>>> model = cvxupdate.Model.from_matrices([[3.0e5, -1.0e5], [-1.0e5, 1.0e5]], [[2.0, 0], [0, 1.0]])
>>> model
Model(2 nodes, 2 free DOFs, 1 elements, 0 groups, 3 kg)

>>> updated = cvxupdate.run("problems/structure_a/problem.toml")
>>> updated.status
'converged'

Everything below loads on first use.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cvxupdate.api import (
        CorrelateResult,
        DiagnoseResult,
        Frf,
        IdentifyResult,
        Model,
        Modes,
        PlanResult,
        Problem,
        TimeHistory,
        UpdateResult,
        check,
        correlate,
        diagnose,
        identify,
        inspect,
        plan,
        run,
        run_files,
        solvers,
        update,
    )
    from cvxupdate.errors import (
        ConvergenceError,
        CvxupdateError,
        Fault,
        InfeasibleError,
        InputError,
        ModelError,
        ProblemFileError,
        ProblemWarning,
        RecordingError,
    )
    from cvxupdate.report import solvers_files
    from cvxupdate.spec import Spec, check_problem, load_problem, schema
    from cvxupdate.study import open_problem
    from cvxupdate.update.result import ModeResult, ParameterResult, Updated

__version__ = "0.1.0"

__all__ = [
    "ConvergenceError",
    "CorrelateResult",
    "CvxupdateError",
    "DiagnoseResult",
    "Fault",
    "Frf",
    "IdentifyResult",
    "InfeasibleError",
    "InputError",
    "ModeResult",
    "Model",
    "ModelError",
    "Modes",
    "ParameterResult",
    "PlanResult",
    "Problem",
    "ProblemFileError",
    "ProblemWarning",
    "RecordingError",
    "Spec",
    "TimeHistory",
    "UpdateResult",
    "Updated",
    "__version__",
    "check",
    "check_problem",
    "correlate",
    "diagnose",
    "identify",
    "inspect",
    "load_problem",
    "open_problem",
    "plan",
    "run",
    "run_files",
    "schema",
    "solvers",
    "solvers_files",
    "update",
]

_HOME = {
    "cvxupdate.api": (
        "CorrelateResult",
        "DiagnoseResult",
        "Frf",
        "IdentifyResult",
        "Model",
        "Modes",
        "PlanResult",
        "Problem",
        "TimeHistory",
        "UpdateResult",
        "check",
        "correlate",
        "diagnose",
        "identify",
        "inspect",
        "plan",
        "run",
        "run_files",
        "solvers",
        "update",
    ),
    "cvxupdate.errors": (
        "ConvergenceError",
        "CvxupdateError",
        "Fault",
        "InfeasibleError",
        "InputError",
        "ModelError",
        "ProblemFileError",
        "ProblemWarning",
        "RecordingError",
    ),
    "cvxupdate.report": ("solvers_files",),
    "cvxupdate.spec": (
        "Spec",
        "check_problem",
        "load_problem",
        "schema",
    ),
    "cvxupdate.study": ("open_problem",),
    "cvxupdate.update.result": (
        "ModeResult",
        "ParameterResult",
        "Updated",
    ),
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


class _Package(ModuleType):
    """The package as a module. Three functions are called as rooms of the package are (correlate,
    diagnose, update): the import system would bind the room to the name, whichever is loaded first.
    Here the name stays the function's; ``from cvxupdate.diagnose import …`` finds the room as
    ever."""

    def __setattr__(self, name: str, value: Any) -> None:
        if isinstance(value, ModuleType) and name in _MODULE_OF:
            return
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

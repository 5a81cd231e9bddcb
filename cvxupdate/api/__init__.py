"""The package for programs: models and recordings from arrays, the commands as functions, results
with tables and figures. `import cvxupdate` gives all of it."""

from cvxupdate.api.commands import (
    check,
    correlate,
    diagnose,
    inspect,
    run,
    run_files,
    solvers,
    update,
)
from cvxupdate.api.frf import Frf
from cvxupdate.api.measured import IdentifyResult, PlanResult
from cvxupdate.api.measuring import identify, plan
from cvxupdate.api.model import Model
from cvxupdate.api.modes import Modes
from cvxupdate.api.problem import Problem
from cvxupdate.api.results import CorrelateResult, DiagnoseResult, UpdateResult
from cvxupdate.api.time_history import TimeHistory

__all__ = [
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
]

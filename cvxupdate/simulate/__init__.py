"""Nonlinear structures: simulation in time, and periodic response by
harmonic balance, of a reduced model with laws of internal force."""

from cvxupdate.simulate.continuation import follow
from cvxupdate.simulate.energy import Balance, energy_balance
from cvxupdate.simulate.integrate import (
    Simulated,
    Start,
    modal_start,
    sensitivities,
    simulate,
)
from cvxupdate.simulate.periodic import Periodic, harmonic_balance
from cvxupdate.simulate.reduced import reduced_system
from cvxupdate.simulate.system import System, modal_system, system_of

__all__ = [
    "Balance",
    "Periodic",
    "Simulated",
    "Start",
    "System",
    "energy_balance",
    "follow",
    "harmonic_balance",
    "modal_start",
    "modal_system",
    "reduced_system",
    "sensitivities",
    "simulate",
    "system_of",
]

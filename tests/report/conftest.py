"""Results to report on: a small one that was updated, one that is infeasible, one that is hard on
the page."""

import dataclasses

import pytest

from cvxupdate.study import run

CHAIN = """
title = "Three masses"
source = "a drawing"

[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }]

[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 4.0e5 }, { id = 2, nodes = [1, 2], k = 3.0e5 },
        { id = 3, nodes = [2, 3], k = 2.0e5, group = "top" }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 6.5, group = "floor" },
        { id = 12, nodes = [2], m = 5.0, group = "floor" }, { id = 13, nodes = [3], m = 3.0 }]

[[recordings]]
kind = "modes"
name = "first test"
rows = [{ frequency = 20.587, frequency_std = 0.02, mode = 1 },
        { frequency = 47.702, frequency_std = 0.1, mode = 2 }]

[[recordings]]
kind = "modes"
use = "hold-out"
name = "second test"
rows = [{ frequency = 64.615, frequency_std = 0.2, mode = 3 }]

[update]
method = "frequencies"
parameters = [
  { elements = [1, 2], of = "k", each = "element", lower = -0.3, upper = 0.3 },
  { group = "floor", of = "m", lower = -0.02, upper = 0.02 },
]
"""
IMPOSSIBLE = CHAIN + "\n[constraints.total_mass]\nvalue = 20.0\n"


@pytest.fixture(scope="session")
def updated(tmp_path_factory):
    path = tmp_path_factory.mktemp("chain") / "problem.toml"
    path.write_text(CHAIN, encoding="utf-8")
    return dataclasses.replace(run(path), path=str(path))  # results state it relative


@pytest.fixture(scope="session")
def infeasible(tmp_path_factory):
    path = tmp_path_factory.mktemp("impossible") / "problem.toml"
    path.write_text(IMPOSSIBLE, encoding="utf-8")
    return dataclasses.replace(run(path), path=str(path))


@pytest.fixture
def hostile(updated):
    """Names that would break out of HTML, numbers that JSON cannot hold."""
    evil = '<script>alert("x")</script>&\'"'
    nan, inf = float("nan"), float("inf")
    parameter = dataclasses.replace(
        updated.parameters[0], name=evil, group=evil, standard_deviation=inf, lower=None, upper=nan
    )
    mode = dataclasses.replace(updated.modes[0], recording=evil, mac_before=nan)
    open_ = ({"coefficients": {evil: nan}, "standard_deviation": None, "says": evil},)
    return dataclasses.replace(
        updated,
        title=evil,
        source=evil,
        notes=(evil,),
        parameters=(parameter,),
        modes=(mode,),
        noise=inf,
        certificate={**updated.certificate, "gap": nan},
        undetermined=open_,
    )

"""Tables with the names of others: one message that says what is meant."""

from __future__ import annotations

import pytest

from cvxupdate.errors import InputError
from cvxupdate.spec import check_problem

MODEL = """
[model]
dofs = ["x"]
nodes = {nodes}
[[model.elements]]
type = "spring"
dof = "x"
rows = [{{ id = 1, nodes = [1, 3], k = 1.0 }}]
"""
INLINE = "[{ id = 1, x = 0.0 }, { id = 3, x = 1.0 }]"
MODES = '[[recordings]]\nkind = "modes"\nfile = "modes.csv"\n'


def said(folder, text, **tables):
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    for name, table in tables.items():
        (folder / f"{name}.csv").write_text(table, encoding="utf-8")
    return [str(fault) for fault in check_problem(path)]


def test_columns_by_other_names_are_one_message(tmp_path):
    text = MODEL.format(nodes='{ file = "nodes.csv" }')
    lines = said(tmp_path, text, nodes="node,X,Y\n1,0,0\n3,1,0\n")
    assert len(lines) == 1 and "nodes.csv: line 1" in lines[0]
    assert "Did you mean 'id' for 'node', 'x' for 'X', 'y' for 'Y'?" in lines[0]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("frequency,3:+X,103:+X\n1.0,1.0,0.5\n", ("'modes.csv'", "node 103", "node_map = { 103")),
        ("frequency,damping,3:+X\n1.0,0.01,n/a\n", ("line 2, column 3:+X", "'n/a'")),
        ("frequency,Damp in %,3:+X\n1.0,1.0,1.0\n", ("column Damp in %", "`damping [%]`")),
    ],
)
def test_a_table_of_modes_is_told_by_its_own_columns(tmp_path, table, words):
    lines = said(tmp_path, MODEL.format(nodes=INLINE) + MODES, modes=table)
    assert len(lines) == 1 and all(w in lines[0] for w in words), lines
    assert "channels" not in lines[0]


def test_regularisation_is_the_argument_regularisers(tmp_path):
    from cvxupdate.api.problem import Problem

    with pytest.raises(InputError, match="Did you mean regularisers"):
        Problem({}, regularisation={"kind": "l1"})
    with pytest.raises(InputError, match="Did you mean regularisers"):
        Problem({}, update={"regularisation": {"kind": "l1"}})

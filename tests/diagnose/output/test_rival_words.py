"""Whom a finding shares its probability with, and what was tried, in words and figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.output.diagnosis import tried
from cvxupdate.diagnose.output.evidence_words import evidence_lines
from cvxupdate.diagnose.output.rival_words import SINGLE, named, rival_titles
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.types import Score
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import spec_of
from cvxupdate.study import diagnose
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, weighed
from tests.diagnose.output.test_wording import told

CASE = case_of(PlainEvidence((PlainFit(100.0),)))
A, B, C = (effect("added_mass", nodes=(k,)) for k in (2, 3, 4))


def _chain() -> str:
    """Five storeys of which the third is softer by a fifth; each is a group."""
    rows = ", ".join(
        f"{{ id = {k}, nodes = {[k] if k == 1 else [k - 1, k]}, k = K{k}, group = 'storey {k}' }}"
        for k in range(1, 6)
    )
    lumps = ", ".join(
        f"{{ id = {k + 10}, nodes = [{k}], m = {900 + 10 * k} }}" for k in range(1, 6)
    )
    nodes = ", ".join(f"{{ id = {k}, x = {k} }}" for k in range(1, 6))
    return f"""
[model]
dofs = ["x"]
nodes = [{nodes}]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{rows}]
[[model.elements]]
type = "mass"
rows = [{lumps}]
"""


def test_a_rival_that_no_finding_lists_is_named() -> None:
    one, two, far = (weighed(PlainFit(m), e) for m, e in ((1.0, A), (1.0, B), (90.0, C)))
    found = Judgement(CASE, (), (), one, one, (one, two, far), (told(A),))
    assert rival_titles(found) == [two.hypothesis.title]
    assert rival_titles(replace(found, findings=(told(A, equivalent=(B,)),))) == []
    assert rival_titles(replace(found, final=None)) == []
    assert named(one.hypothesis) == one.hypothesis.title
    same = replace(found, final=two, findings=(told(A),))
    assert f"{A.title}: {SINGLE}" in rival_titles(same)
    assert evidence_lines(found, None)


def test_the_same_with_something_besides_is_no_rival_to_name() -> None:
    one, more = weighed(PlainFit(1.0), A), weighed(PlainFit(0.99), A, B)
    found = Judgement(CASE, (), (), one, one, (one, more), (told(A),))
    assert rival_titles(found) == []


def test_tried_is_the_best_place_of_each_type() -> None:
    a, b = effect("added_mass", nodes=(2,)), effect("viscous_damper", nodes=(3,))
    zero = np.zeros(1)
    scores = (Score(a, 0.2, zero), Score(a, 0.1, zero), Score(b, 0.9, zero, trusted=False))
    assert tried(Found(scores)) == {"added_mass": 0.2, "viscous_damper": None}
    entries = ((weighed(PlainFit(1.0), b).hypothesis, 0.7),)
    assert tried(Found(scores, entries=entries))["viscous_damper"] == pytest.approx(0.3)


def test_groups_let_go_are_named_as_the_rival_that_finds_the_same() -> None:
    """Exact frequencies of a chain with one soft storey: the change of its group by itself, and all
    groups let go, say one thing."""
    k = {f"K{n}": 4.0e6 - 2.0e5 * n for n in range(1, 6)}
    text, true = _chain(), _chain()
    for name, value in k.items():
        text = text.replace(name, repr(value))
        true = true.replace(name, repr(value * (0.8 if name == "K3" else 1.0)))
    f = model_modes(build_model(spec_of(true)), 5).frequencies
    rows = ", ".join(f"{{ frequency = {x!r}, frequency_std = {1e-3 * x!r} }}" for x in f.tolist())
    found = diagnose(f'{text}[[recordings]]\nkind = "modes"\nrows = [{rows}]\n')
    assert [x.place.groups for x in found.findings] == [("storey 3",)]
    (rival,) = found.details["rivals"]
    assert rival.startswith("wrong numbers of whole groups, which finds the same")
    assert rival.endswith("which finds the same")
    assert any("(a change of stiffness in group 'storey 3')" in line for line in found.evidence)

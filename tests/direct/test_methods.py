"""The direct methods by name: exact where they promise it, and known to problem files."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import scipy.linalg as la

from cvxupdate.direct.methods import METHODS, NAMES, Request
from cvxupdate.direct.result import faults
from cvxupdate.spec.update import Update
from cvxupdate.spec.whole import DIRECT

K = 1e5 * (np.diag([15.0, 14.0, 13.0, 9.0, 4.0]) - np.diag([6.0, 8.0, 5.0, 4.0], 1))
K = np.triu(K) + np.triu(K, 1).T
M = np.diag([2.0, 1.5, 1.0, 1.7, 0.6])
EXACT = (
    "baruch",
    "berman-nagy",
    "caesar",
    "wei",
    "fuh-chen",
    "caesar-link",
    "ross",
    "luk",
    "minas-inman",
    "inman-minas",
    "zimmerman-widengren",
)
MOVED = ("baruch", "fuh-chen", "inman-minas", "zimmerman-widengren")
"""Those that move the shapes, to be orthogonal in the mass."""
SECOND = ("sidhu-ewins", "second-order", "he-ewins", "gysin")


def request(count, size=0.05):
    """The lowest modes of a structure that is stiffer in one spring and heavier in one mass."""
    change = size * 6e5 * np.outer([1.0, -1, 0, 0, 0], [1.0, -1, 0, 0, 0])
    values, vectors = la.eigh(K + change, M + np.diag([0, 0, size, 0, 0]))
    own_values, own = la.eigh(K, M)
    own = own * np.sign(np.einsum("ij,ij->j", own, M @ vectors))
    # as real measured modes come: at unit modal mass of the model
    phi = vectors / np.sqrt(np.einsum("ij,ij->j", vectors, M @ vectors))
    places = np.arange(count)
    return Request(K, M, phi[:, :count], values[:count], own[:, :count], own_values[:count], places)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_a_method_reproduces_what_it_promises(method):
    r = request(2, 0.01)
    made = method.apply(r)
    found = faults(made, K, M, *r.asked(made))
    blank = type(made)("none", M, K, *(a if a is None else 0.0 * a for a in (made.C, made.D)))
    before = faults(blank, K, M, *r.asked(made)).reproduction
    if method.name in EXACT:
        limit = 2e-4 if method.name in MOVED else 1e-7
        assert found.reproduction < limit < before
    elif method.name in SECOND:
        assert found.reproduction < 0.5 * before
    assert np.all(np.isfinite(made.K)) and np.all(np.isfinite(made.M))


@pytest.mark.parametrize("name", SECOND)
def test_error_matrices_are_exact_to_first_order(name):
    """Of all modes and a stiffness error alone: what is left falls as the square of the error."""
    method = next(m for m in METHODS if m.name == name)
    left = []
    for size in (0.02, 0.01):
        change = size * 6e5 * np.outer([1.0, -1, 0, 0, 0], [1.0, -1, 0, 0, 0])
        values, vectors = la.eigh(K + change, M)
        own_values, own = la.eigh(K, M)
        r = Request(K, M, vectors, values, own, own_values, np.arange(5))
        left.append(np.linalg.norm(method.apply(r).K - K - change))
    assert left[1] < 0.3 * left[0]


@pytest.mark.parametrize("name", ["baruch", "berman-nagy", "caesar", "fuh-chen", "ross"])
def test_with_the_models_own_shapes_least_change_is_pole_placement(name):
    r = request(2, 0.05)
    r = replace(r, Phi=r.own)
    by_name = {m.name: m for m in METHODS}
    placed = by_name["pole-placement"].apply(r)
    made = by_name[name].apply(r)
    assert np.abs(made.K - placed.K).max() < 1e-9 * np.abs(K).max()
    assert np.abs(made.M - M).max() < 1e-9


def test_problem_files_know_every_method():
    assert DIRECT == NAMES
    assert get_args(Update.model_fields["direct"].annotation) == NAMES
    assert len({m.title for m in METHODS}) == len(METHODS)
    assert all(m.equations and m.changes for m in METHODS)

"""Responses over one another: those that are nothing have no place on a logarithmic scale."""

import warnings

import numpy as np

from cvxupdate.report.correlate_page import correlate_page
from cvxupdate.report.frf_figures import chosen
from cvxupdate.study import correlate
from tests.test_problems import PROBLEMS


def test_what_does_not_answer_is_not_drawn():
    """The bay measured everywhere: out of its plane nothing answers to forces within it."""
    compared = correlate(PROBLEMS / "bay" / "fe1_x1_complete" / "problem.toml")
    (found,) = compared.frfs
    silent = ~np.any(found.measured, axis=0) & ~np.any(found.model, axis=0)
    assert silent.any()
    drawn = chosen(found)
    assert drawn and not any(silent[i, j] for i, j in drawn)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "log-scaled" not in correlate_page(compared)

"""The makers of problem files from real recordings, and what is compared with them, without the
recordings."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from validation.real import diagnoses

PROBLEMS = Path(__file__).resolve().parents[3] / "problems"


def test_a_place_between_nodes_is_the_vertex_of_the_misfit():
    misfit = [(x, 1e7, 3.0 + ((x - 0.1142) / 0.002) ** 2) for x in (0.111, 0.114, 0.117)]
    assert diagnoses.between_nodes(misfit) == pytest.approx(0.1142, abs=1e-9)
    assert diagnoses.between_nodes(misfit[:2]) == 0.114, "without both neighbours the node itself"


def test_one_place_that_is_off_does_not_bend_the_line():
    v = np.array([1.2, 1.6, 2.1, 2.5, 2.9, 3.4])
    x = 0.0563 * v - 0.01
    x[0] += 0.03
    slope, offset = diagnoses.robust_line(v, x)
    assert slope == pytest.approx(0.0563, rel=0.02) and offset == pytest.approx(-0.01, abs=2e-3)


def test_masses_of_the_beam_stand_at_their_printed_places():
    positions = np.array([0.0274, 0.1010, 0.1595, 0.2041, 0.2352, 0.3018])
    xs, at = diagnoses.make.beam_mesh(positions)
    assert np.all(np.diff(xs) > 0) and xs[[n - 1 for n in at]] == pytest.approx(positions)


def test_truths_are_in_no_problem_file():
    """The tool's files say nothing of the sensor's volts, of weighed masses or of the place of the
    loss."""
    for file in (PROBLEMS / "real").glob("*/problem_diagnose_*.toml"):
        own = file.read_text(encoding="utf-8")
        include = tomllib.loads(own)["model"].get("include")
        text = own + ((file.parent / include).read_text(encoding="utf-8") if include else "")
        for secret in ("1.437", "0.270", "0.128", "volt", " V:", "strip welded", "L1"):
            assert secret not in text, f"{file.name}: {secret}"

"""A frame by another program, nothing concealed: Euler's beams on centre lines leave fifteen times
its noise, beams that may shear and be stiff at corners little more than the noise."""

from __future__ import annotations

from cvxupdate.diagnose.gather import gathered
from cvxupdate.study import open_problem
from validation.plates.files import make


def test_a_null_frame_of_expanded_beams_is_within_noise(tmp_path):
    """B32R by CalculiX, seed 21; its sections' shear is found."""
    make(21, tmp_path)
    evidence = gathered(*open_problem(tmp_path / "problem.toml"), lambda said: None)
    base, errors = evidence.bases[-1], evidence.errors(evidence.bases[-1])
    assert base.misfit <= 1.3 * base.noise
    assert errors.fit <= 1.3 * evidence.noise.fit and errors.worst <= 1.3 * evidence.noise.worst
    sizes = {q.of: p for q, p in zip(evidence.model.parameters, base.p, strict=False)}
    assert 0.7 <= sizes["shear"] <= 1.2 and 0.05 <= sizes["corner"] <= 0.5

"""`new`: folders that run, whose recordings show what their heads say."""

import sys

import numpy as np
import pytest

from cvxupdate import cli
from cvxupdate.commands.new import new
from cvxupdate.commands.new_kinds import KINDS
from cvxupdate.errors import InputError
from cvxupdate.study import check, correlate, diagnose


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("new")
    for kind in KINDS:
        new(kind, folder / kind)
    return folder


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_what_is_made_is_in_order_and_differs_from_its_recordings(made, kind):
    path = made / kind / "problem.toml"
    counts = check(path)
    assert counts["recordings"] == 1 and counts["parameters"] >= 2 and not counts["warnings"]
    errors = correlate(path).fit["fit"]
    name = "frf_error" if kind == "matrices" else "frequency_error_percent_mean"
    assert errors[name]["after"] > (0.1 if kind == "matrices" else 0.3)  # of the noise: 0.05 %


def test_the_same_is_made_every_time(made, tmp_path):
    names = new("chain", tmp_path / "chain")
    assert names == ("problem.toml", "modes.csv")
    for name in names:
        assert (tmp_path / "chain" / name).read_bytes() == (made / "chain" / name).read_bytes()


def test_the_soft_foot_that_is_made_is_found(made):
    found = diagnose(made / "frame/problem.toml")
    (finding,) = found.findings
    assert finding.place.nodes == (25,) and "gives way" in finding.says
    assert finding.parameters["k"] == pytest.approx(6.0e4, rel=0.1)


@pytest.mark.slow
def test_the_lump_on_the_plate_is_found_though_its_recordings_know_no_mesh(made):
    """They come from a finer mesh: of the model's own the mass would be 0.265 kg."""
    (finding,) = diagnose(made / "plate/problem.toml").findings
    assert finding.place.nodes == (44,) and finding.physics == "added_mass"
    assert finding.parameters["m"] == pytest.approx(0.25, abs=0.01)


def test_matrices_are_those_of_the_chain(made):
    from cvxupdate.study import open_problem

    chain, matrices = (open_problem(made / k / "problem.toml")[1] for k in ("chain", "matrices"))
    for a, b in zip(
        (chain.matrices().K, chain.matrices().M),
        (matrices.matrices().K, matrices.matrices().M),
        strict=True,
    ):
        assert np.allclose(a.toarray(), b.toarray())


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="nothing is overwritten"):
        new("beam", tmp_path)
    with pytest.raises(InputError, match="nothing is overwritten"):
        new("beam", tmp_path / "mine.txt")
    with pytest.raises(InputError, match="there is no 'bridge'. Give one of beam"):
        new("bridge", tmp_path / "other")
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_the_command_says_what_to_do_next(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["cvxupdate", "new", "chain", "tower"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 0
    assert "Next: cvxupdate view tower/problem.toml" in capsys.readouterr().out

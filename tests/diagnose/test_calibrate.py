"""Generated problems and their judge: the same seed the same files, every word generated and well-formed, an interrupted run resumed, outcomes told apart."""

from __future__ import annotations

import importlib
import sys
import tomllib
from pathlib import Path

import pytest

from cvxupdate.study import open_problem

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"


@pytest.fixture(scope="module")
def generate():
    return _module("generate")


@pytest.fixture(scope="module")
def calibrate():
    return _module("calibrate")


@pytest.fixture(scope="module")
def laboratory():
    return _module("laboratory")


def _module(name):
    if str(PROBLEMS) not in sys.path:
        sys.path.insert(0, str(PROBLEMS))
    return importlib.import_module(name)


def test_a_seed_gives_the_same_files(generate, tmp_path):
    for seed in (2, 4):
        for name in ("a", "b"):
            generate.make(seed, tmp_path / f"{name}{seed}")
        first, second = (sorted((tmp_path / f"{n}{seed}").iterdir()) for n in "ab")
        assert [p.name for p in first] == [p.name for p in second]
        assert [p.read_bytes() for p in first] == [q.read_bytes() for q in second]


@pytest.mark.parametrize("seed", range(24))
def test_generated_problems_can_be_read(generate, tmp_path, seed):
    generate.make(seed, tmp_path)
    spec, model, recordings = open_problem(tmp_path / "problem.toml")
    assert {r.origin.use for r in recordings} == {"fit", "hold-out"}
    truth = tomllib.loads((tmp_path / "truth.toml").read_text())
    assert bool(truth.get("findings")) == (seed % 3 != 0)
    nodes, elements = {n.id for n in spec.model.nodes}, {i for b in model.blocks for i in b.ids.tolist()}
    for f in truth.get("findings", ()):
        assert set(f["location"]["nodes"]) <= nodes and set(f["location"]["elements"]) <= elements


def test_every_word_and_family_comes_up(generate):
    cases = [generate.draw(s) for s in range(160)]
    assert {f.effect["physics"] for c in cases for f in c.findings} == (set(generate.WORDS) - {"soft_support"})
    assert {c.design.family for c in cases} == set(generate.FAMILIES)
    assert {c.kind for c in cases} == {"frf", "time", "modes"}
    assert any(len(c.findings) == 2 for c in cases)
    assert sum(not c.findings for c in cases) == len(range(0, 160, 3))

"""Cases of the rig laboratory: the same seed the same files, files that the package accepts,
visibility as the size of an effect says."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, ncx2
from typer.testing import CliRunner

from cvxupdate.cli import app
from validation.rigs import cases, effects, families, files, generate, rig, visible

QUICK = [  # of every family, with and without rig, with and without files beside
    *(3000, 3001, 3002, 3005, 3014),
    *(4000, 4004, 4009, 4016, 4025),
]


def checked(path):
    return CliRunner().invoke(app, ["check", str(path)])


@pytest.mark.parametrize("seed", QUICK)
def test_generated_problems_pass_check(tmp_path, seed):
    case = generate.make(seed, tmp_path)
    given = checked(tmp_path / "problem.toml")
    assert given.exit_code == 0 and "in order" in given.output
    truth = tomllib.loads((tmp_path / "truth.toml").read_text(encoding="utf-8"))
    assert bool(truth.get("findings")) == (seed % 3 != 0)
    assert len(truth.get("rig", ())) in (range(2, 5) if seed >= 4000 else (0,))
    members = {e for g in truth["groups"].values() for e in g}
    for t in (*truth.get("findings", ()), *truth.get("rig", ())):
        for where in (t["location"], t["near"], *(x["location"] for x in t["also"])):
            assert set(where["nodes"]) <= set(case.drawing.nodes)
            assert set(where["elements"]) <= members
    assert 4 <= len(truth["bench"]["frequencies"]) <= 9
    assert (tmp_path / "reference.toml").exists() == (seed >= 4000)


@pytest.mark.parametrize("seed", [4009, 4004])
def test_reference_recordings_lack_only_what_is_concealed(tmp_path, seed):
    generate.make(seed, tmp_path)
    text = (tmp_path / "reference.toml").read_text(encoding="utf-8")
    assert text.count('state = "reference"') == text.count('state = "today"') > 0
    lines = [x for x in text.splitlines() if not x.startswith("state = ")]
    (tmp_path / "plain.toml").write_text("\n".join(lines), encoding="utf-8")
    assert checked(tmp_path / "plain.toml").exit_code == 0
    case = cases.draw(seed)
    bare = replace(case, concealed=())
    f, g = (c.modal().omega[:6] for c in (replace(case), bare))
    healthy = case.modal(concealed=False).omega[:6]
    assert np.array_equal(g, healthy) and not np.allclose(f, healthy, rtol=1e-9)


def test_a_seed_gives_the_same_files(tmp_path):
    for seed in (3001, 4022):
        for name in "ab":
            generate.make(seed, tmp_path / f"{name}{seed}")
        first, second = (sorted((tmp_path / f"{n}{seed}").iterdir()) for n in "ab")
        assert [p.name for p in first] == [p.name for p in second]
        assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_seeds_of_an_evaluation_are_not_shown(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        generate.main(["5007", "--out", str(tmp_path)])
    assert left.value.code == 2 and "evaluation" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert [cases.laboratory_of(s) for s in (3119, 4089, 5000, 6089)] == 2 * ["tables", "rigs"]


def test_every_family_effect_and_part_of_a_rig_comes_up():
    rng = np.random.default_rng(5)
    words: set[str] = set()
    for family in families.FAMILIES:
        for frf in (True, False):
            for _ in range(6):
                d = families.draw(rng, family)
                places = d.places()
                setting = rig.Setting(d, 10.0, tuple(places[:5]), places[0], frf, frf)
                parts = rig.draw(rng, setting)
                assert 2 <= len(parts) <= 4
                words |= {p.physics for p in parts}
                assert frf or all(p.gain == 1.0 and p.alpha == 0.0 for p in parts)
    assert words == {
        "flexible_support",
        "grounding_spring",
        "stiffness_change",
        "sensor_mass",
        "joint_flexibility",
        "added_mass",
        "sensor_fault",
    }
    drawn = {cases._subject(np.random.default_rng(s), s, True) for s in range(3000, 3600)}
    assert {f for _, f in drawn} == set(families.FAMILIES)
    assert {n for n, _ in drawn} == set(effects.TABLES)


@pytest.mark.parametrize("seed", [3034, 4022])
def test_margin_grows_with_the_size_of_an_effect(seed):
    """Nothing for nothing; in a table as the square of a small size, in FRFs as the size."""
    case = cases.draw(seed)
    lump = case.concealed[0]
    assert lump.physics == "added_mass"
    margins = []
    for m in (1e-9, 0.005, 0.01, 0.5):
        op = {**lump.ops[0], "m": m * case.drawing.mass()}
        tried = replace(case, concealed=(replace(lump, ops=(op,)),))
        margins.append(visible.margin(tried, 0))
    power = 2.0 if case.kind == "modes" else 1.0
    assert margins[0] < 2e-3  # FRFs: what modes above the reduced basis leave
    assert margins[2] / margins[1] == pytest.approx(2.0**power, rel=0.35)
    assert margins[3] > 1.0 > margins[1]


def test_groups_absorb_what_is_theirs_and_nothing_else():
    """A wrong number within the usual scatter is not visible; a linear problem is solved in one
    step."""
    case = cases.draw(3035)
    change = {"do": "factor", "elements": list(range(1, 30)), "fk": 1.01, "fm": 1.0}
    usual = replace(case.concealed[0], ops=(change,))
    assert visible.margin(replace(case, concealed=(usual,)), 0) < 0.1
    rng = np.random.default_rng(0)
    A, b, prior = rng.standard_normal((9, 3)), rng.standard_normal(9), np.array([0.1, 1.0, 5.0])
    left, x = visible.fitted(b, lambda p: A @ p, prior)
    exact = np.linalg.solve(A.T @ A + np.diag(prior**-2.0), A.T @ b)
    assert x == pytest.approx(exact, rel=1e-3)
    assert left == pytest.approx(b @ b - b @ A @ exact, rel=1e-6)


@pytest.mark.parametrize("freedom", [10, 60])
def test_detectable_is_found_in_99_of_100(freedom):
    size = visible.detectable(freedom)
    assert ncx2.sf(chi2.isf(1e-3, freedom), freedom, size) == pytest.approx(0.99, abs=1e-6)


def test_modes_are_paired_by_shape_when_they_change_places():
    shapes = np.eye(4)[:, :3]
    pair = visible.paired(
        np.array([10.0, 11.0, 30.0]), shapes, np.array([10.1, 10.9, 31.0]), shapes[:, [1, 0, 2]]
    )
    assert pair.tolist() == [1, 0, 2]


def test_tables_and_frfs_scatter_as_stated():
    """Deviations of many draws of noise are those of the files."""
    case = cases.draw(3010)
    m, rng = case.modal(), np.random.default_rng(1)
    exact = m.damped(case.sensors, case.top)[0]
    exact = exact[exact > case.low]
    draws = [files.table(rng, m, case) for _ in range(300)]
    z = [
        [(r["frequency"] - f) / r["frequency_std"] for r, f in zip(t, exact, strict=True)]
        for t in draws
    ]
    assert np.std(z) == pytest.approx(1.0, rel=0.06) and abs(np.mean(z)) < 0.1

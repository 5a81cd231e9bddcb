"""Tables of modes: a support is found where it stands however stiff, repeats are held out, and
nothing is found where nothing is."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import let_far, prior_scales, with_nuisance
from cvxupdate.diagnose.nominal.supports import elements_of
from cvxupdate.diagnose.settings import MASS_STD, WIDE
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from cvxupdate.study import correlate, diagnose, run
from tests.cases.cantilever import load, rows_of, text
from tests.cases.long_bar import text as long_bar


def problem(folder, extra, modes=4, again=True):
    """The bare cantilever against the frequencies of one with ``extra`` elements and 0.7 % less E;
    the same modes, measured again, held out."""
    _, real = load(folder, text(extra=extra, E="205.5e9"))
    f = model_modes(real, modes).frequencies[:modes]
    rng = np.random.default_rng(3)
    hold = (
        '[[recordings]]\nkind = "modes"\nuse = "hold-out"\nrows = '
        f"[{rows_of(f * (1 + 3e-4 * rng.standard_normal(modes)))}]\n"
        if again
        else ""
    )
    return load(folder, text(rows_of(f * (1 + 3e-4 * rng.standard_normal(modes))), hold=hold))


def diagnosed(folder, extra, modes=4, again=True):
    """The diagnosis of `problem`."""
    spec, model = problem(folder, extra, modes, again)
    return diagnose_problem(spec, model, load_recordings(spec)).to_json()


@pytest.mark.parametrize(("node", "k"), [(5, 3e4), (8, 2e6), (10, 1e9)])
def test_a_support_is_found_from_soft_to_rigid(tmp_path, node, k):
    spring = (
        f'[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{{ id = 90, nodes = [{node}], k '
        f"= {k} }}]"
    )
    said = diagnosed(tmp_path, spring)
    first = said["findings"][0]
    assert (
        first["physics"] == "grounding_spring"
        and first["location"]["nodes"] == [node]
        and first["location"]["dof"] == "z"
    )
    if k < 1e9:  # a rigid support's stiffness has no upper limit
        assert first["parameters"]["k"] == pytest.approx(k, rel=0.25)
    assert said["fit"]["hold_out"]["after"] < 0.1 * said["fit"]["hold_out"]["before"], (
        "repeats of fitted modes are scored"
    )


def test_a_heavy_lump_is_found(tmp_path):
    """Twice the mass of the bar's last third: far from small."""
    said = diagnosed(
        tmp_path, '[[model.elements]]\ntype = "mass"\nrows = [{ id = 90, nodes = [11], m = 0.35 }]'
    )
    first = said["findings"][0]
    assert (
        first["physics"] == "added_mass"
        and first["location"]["nodes"] == [11]
        and first["parameters"]["m"] == pytest.approx(0.35, rel=0.1)
    )


def test_nothing_is_found_in_the_same_bar(tmp_path):
    said = diagnosed(tmp_path, "")
    assert said["verdict"] == "consistent" and not said["findings"]


def test_what_is_diagnosed_can_be_compared_and_updated(tmp_path):
    """`diagnose`, then `correlate` and `run` of the file that it writes: the held-out repeats of
    the modes go with them all the way."""
    spec, _ = problem(
        tmp_path, '[[model.elements]]\ntype = "mass"\nrows = [{ id = 90, nodes = [11], m = 0.35 }]'
    )
    found = diagnose(spec.path)
    written = tmp_path / "updated.toml"
    written.write_text(found.updated.text, encoding="utf-8")
    for use in ("fit", "hold_out"):
        before = correlate(spec.path).fit[use]["frequency_error_percent_mean"]["after"]
        after = correlate(written).fit[use]["frequency_error_percent_mean"]["after"]
        said = found.metrics[use]["frequency_error_percent_mean"]
        assert abs(before - said["before"]) < 0.05 and abs(after - said["after"]) < 0.05, (
            "but for the mesh: less than 0.05 %"
        )
    updated = run(written)
    assert updated.fit["hold_out"]["frequency_error_percent_mean"]["after"] < 0.1


def test_a_group_that_is_off_beyond_all_scatter_is_named(tmp_path):
    """A quarter less E in the whole bar: nuisance parameters may not take that up."""
    _, real = load(tmp_path, text(E="155e9"))
    f = model_modes(real, 5).frequencies[:5]
    spec, model = load(tmp_path, text(rows_of(f)))
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    first = said["findings"][0]
    told = [first, *first["equivalent"]]
    assert first["location"]["groups"] == ["bar"] and any(
        t["physics"] == "stiffness_change" for t in told
    )
    assert said["fit"]["fit"]["after"] < 2e-3 < 0.1 < said["fit"]["fit"]["before"]


def test_only_groups_of_the_file_are_let_far(tmp_path):
    """What a reference was found to have beside them stays as it is."""
    extra = (
        '[[model.elements]]\ntype = "mass"\n'
        'rows = [{ id = 90, nodes = [9], m = 0.1, group = "lump" }]'
    )
    _, model = load(tmp_path, text(extra=extra))
    start = with_nuisance(undamped(model))
    far = let_far(start, elements_of(model) - {90})
    assert {q.group for q in start.parameters} == {"bar", "lump"}
    for q, before in zip(far.parameters, start.parameters, strict=True):
        assert q == before if q.group == "lump" else q.upper == -q.lower == WIDE
    wide = dict(zip([q.name for q in far.parameters], prior_scales(far, wide=True), strict=True))
    assert wide["bar.stiffness"] == WIDE and wide["bar.mass"] == MASS_STD == wide["lump.mass"]


def test_many_groups_that_are_off_are_a_matter_of_parameters(tmp_path):
    """Four groups, each a seventh off in stiffness: no plate is there to be orthotropic, the
    groups' parameters let go far explain it."""
    words = '[diagnose]\nphysics = ["stiffness_change"]'
    three = re.sub(
        r'(id = (\d+), nodes = \[\d+, \d+\], group = "bar)',
        lambda m: f"{m[1]} {(int(m[2]) - 1) // 3}",
        text("ROWS", hold=words),
    )
    spec, model = load(tmp_path, three.replace("ROWS", "{ frequency = 10.0 }"))
    wide = let_far(with_nuisance(undamped(model)), elements_of(model))
    off = dict(zip(("bar 0", "bar 1", "bar 2", "bar 3"), (0.16, -0.13, 0.17, -0.14), strict=True))
    p = np.array([off[q.group] if q.of == "stiffness" else 0.0 for q in wide.parameters])
    spec, model = load(
        tmp_path, three.replace("ROWS", rows_of(model_modes(wide, 7, p).frequencies[:7]))
    )
    found = diagnose_problem(spec, model, load_recordings(spec))
    assert found.verdict == "parameter_error" and found.findings
    assert all(
        f.physics == "stiffness_change" and set(f.place.groups) <= set(off) for f in found.findings
    ), "which groups, seven frequencies do not settle"
    assert found.fit["fit"]["after"] < 2e-3 < 0.01 < found.fit["fit"]["before"]


OSCILLATOR = """[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 90, nodes = [9, 14], k = 2.0e4 }]
[[model.elements]]
type = "mass"
rows = [{ id = 91, nodes = [14], m = 0.04 }]
[[model.supports]]
nodes = [14]
dofs = ["ry"]
"""


def test_a_hidden_oscillator_is_told_by_the_mode_that_it_brings(tmp_path):
    """Of 0.04 kg at 112.5 Hz, with shapes at four places; its own mode is not the model's."""
    body = text(extra=OSCILLATOR, E="205.5e9").replace(
        "nodes = [{", "nodes = [{ id = 14, x = 0.3 }, {", 1
    )
    _, real = load(tmp_path, body)
    modes, at = model_modes(real, 6), [real.place[f"n{n}.z"] for n in (3, 6, 9, 12)]
    rng = np.random.default_rng(4)
    rows = []
    for k in range(6):
        shape = modes.shapes[at, k] / np.abs(modes.shapes[at, k]).max()
        shape = shape + 0.005 * rng.standard_normal(4)
        f = float(modes.frequencies[k]) * (1.0 + 3e-4 * rng.standard_normal())
        rows.append(
            f"{{ frequency = {f:.7g}, frequency_std = {3e-4 * f:.3g}, "
            f"shape = {[round(float(x), 5) for x in shape]}, shape_std = 0.005 }}"
        )
    channels = ", ".join(
        f'{{ column = {k}, quantity = "displacement", node = {n}, dof = "z" }}'
        for k, n in enumerate((3, 6, 9, 12))
    )
    spec, model = load(tmp_path, text(", ".join(rows)) + f"channels = [{channels}]\n")
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    (first,) = said["findings"]
    assert first["physics"] == "attached_resonator" and first["location"]["nodes"] == [9]
    assert set(first["parameters"]) == {"m", "k"}
    assert first["parameters"]["m"] == pytest.approx(0.04, rel=0.1)
    assert first["parameters"]["k"] == pytest.approx(2.0e4, rel=0.1)


@pytest.mark.parametrize("k", [2e6, 1e9])
@pytest.mark.slow
def test_two_frequencies_place_a_support_among_neighbours(tmp_path, k):
    """Of a mesh that is finer than they tell: the effect is sure, its very node is not, nor is the
    stiffness of one that is as good as rigid."""
    spring = (
        '[[model.elements]]\ntype = "spring"\ndof = "z"\n'
        f"rows = [{{ id = 900, nodes = [54], k = {k} }}]"
    )
    _, real = load(tmp_path, long_bar(160, "rows = [{ frequency = 1.0 }]", spring))
    f = model_modes(real, 2).frequencies[:2] * [1.0004, 0.9994]
    spec, model = load(tmp_path, long_bar(160, f"rows = [{rows_of(f)}]"))
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    first = said["findings"][0]
    assert first["physics"] == "grounding_spring" and first["location"]["dof"] == "z"
    (at,) = first["location"]["nodes"]
    assert abs(at - 54) <= 2
    also = [e["location"]["nodes"] for e in first["equivalent"] if e["location"]["dof"] == "z"]
    assert {n for (n,) in also} >= {at - 1, at + 1}
    assert first["confidence"] < 0.8
    assert any("hardly told from it, is sure to" in line for line in said["evidence"])

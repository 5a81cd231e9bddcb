"""A reference state beside the one that is looked into: what both have in common is no finding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eig, eigh

from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.states import looked_into, parted
from cvxupdate.spec import load_problem
from cvxupdate.study import check, diagnose, open_problem, run
from tests.cases.cantilever_tables import MASS, NODES, SOFT, cantilever
from tests.cases.chain import CHAIN

LINES = np.arange(5.0, 75.0, 0.2)
MODES = 4


def files(folder, measure, states):
    """A problem file of the chain with two FRFs of each (state, laboratory)."""
    text = CHAIN
    for state, lab in states:
        for use, at, seed in (("fit", 4, 11), ("hold-out", 1, 12)):
            r = measure(lab, at, use, seed=seed + 10 * len(text))
            name = f"{state}_{at}.npz"
            np.savez(
                folder / name,
                frequency=r.frequency,
                H=r.H,
                variance=r.variance,
                response_node=[1, 2, 3, 4],
                response_dof=[1] * 4,
                reference_node=[at],
                reference_dof=[1],
            )
            text += f'[[recordings]]\nkind = "frf"\nuse = "{use}"\nfile = "{name}"\n'
            text += f'response = "acceleration"\nstate = "{state}"\n'
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


# of the catalogue, for time: a search that no one or two effects end is long
SOME = ("stiffness_change", "added_mass")
RIG = (0.7, 1.0, 1.0, 1.0)  # the chain stands on something soft


def test_what_changed_is_found_beside_a_rig_that_both_states_have(tmp_path, lab, measure):
    states = ("reference", lab(k=RIG)), ("today", lab(k=RIG, m=(0, 0, 0.2, 0)))
    found = diagnose(files(tmp_path, measure, states))
    (first,) = found.findings
    assert first.physics == "added_mass" and first.place.nodes == (3,)
    assert first.parameters["m"] == pytest.approx(0.2, rel=0.05) and first.confidence > 0.9
    assert found.evidence[0].startswith("The model was first brought to the reference state: ")
    assert found.updated is not None and 'state = "reference"' not in found.updated.text
    assert "taken as common" in found.evidence[0]


def test_nothing_changed_is_consistent_whatever_the_rig(tmp_path, lab, measure):
    states = ("reference", lab(k=RIG)), ("today", lab(k=RIG))
    found = diagnose(files(tmp_path, measure, states))
    assert found.verdict == "consistent" and not found.findings


def test_what_no_effect_explains_in_both_states_hides_nothing(tmp_path, lab, measure):
    """Every spring is off by its own part in both states: no one or two effects say that."""
    off = np.array([0.86, 1.12, 0.9, 1.1])
    states = ("reference", lab(k=off)), ("today", lab(k=off * np.array([1, 1, 0.8, 1])))
    path = files(tmp_path, measure, states)
    with path.open("a", encoding="utf-8") as file:
        file.write(f"[diagnose]\nphysics = {list(SOME)}\n")
    found = diagnose(path)
    assert found.findings[0].place.elements == (103,)
    assert found.findings[0].physics == "stiffness_change"
    assert found.findings[0].parameters["factor"] == pytest.approx(0.8, abs=0.03)


def tables(*states):
    text = CHAIN
    for state, use in states:
        said = "" if state is None else f'state = "{state}"\n'
        text += f'[[recordings]]\nkind = "modes"\nuse = "{use}"\n{said}'
        text += "rows = [{ frequency = 10.0, frequency_std = 0.01 }]\n"
    return text


def damped(lab, own):
    """Frequencies and damping ratios of the lab's complex modes with ratios ``own`` besides."""
    lam, phi = eigh(lab.K, lab.M)
    modal = lab.M @ phi @ np.diag(2.0 * own * np.sqrt(lam)) @ phi.T @ lab.M
    zero, one = np.zeros((4, 4)), np.eye(4)
    a = np.block([[zero, one], [-lab.K, -(modal + lab.C)]])
    s = eig(a, np.block([[one, zero], [zero, lab.M]]), right=False)
    s = s[s.imag > 0][np.argsort(s.imag[s.imag > 0])]
    return np.abs(s) / (2.0 * np.pi), -s.real / np.abs(s)


OWN = np.array([0.012, 0.004, 0.02, 0.007])  # far from the 0.5 % of the file, mode by mode


def in_tables(folder, *states):
    text = CHAIN
    for state, lab, own in states:
        rows = "".join(
            f"  {{ frequency = {f:.7g}, frequency_std = {1e-4 * f:.3g}, damping = {z:.5g}, "
            f"damping_std = {0.03 * z:.3g}, mode = {i + 1} }},\n"
            for i, (f, z) in enumerate(zip(*damped(lab, own), strict=True))
        )
        text += f'[[recordings]]\nkind = "modes"\nstate = "{state}"\nrows = [\n{rows}]\n'
    return opened(folder, text)


def test_ratios_of_a_table_are_compared_with_those_of_the_reference(tmp_path, lab):
    """The file's ratio is up to four times off, which hides or makes up a dashpot."""
    path = in_tables(tmp_path, ("reference", lab(), OWN), ("today", lab(), 1.05 * OWN))
    assert diagnose(path).verdict == "consistent"
    path = in_tables(
        tmp_path, ("reference", lab(), OWN), ("today", lab(c=(0, 0, 8.0, 0)), 1.05 * OWN)
    )
    found = diagnose(path)
    first = found.findings[0]
    assert first.physics == "viscous_damper" and first.place.nodes == (2, 3)
    assert abs(first.parameters["c"] - 8.0) < 3.0 * first.deviations["c"] < 5.0
    assert any("depart from those of the reference" in line for line in found.evidence)


def opened(folder, text):
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_model_has_one_state_beside_its_reference(tmp_path):
    path = opened(tmp_path, tables(("reference", "fit"), ("a", "fit"), (None, "fit")))
    assert check(path)["recordings"] == 3
    with pytest.raises(InputError, match=r"state 'a' and no state: one model has one state"):
        diagnose(path)


@pytest.mark.parametrize(
    ("first", "second", "who"),
    [("fit", "hold-out", "the state that is looked into"), ("hold-out", "fit", "the reference")],
)
def test_each_state_needs_something_to_fit(tmp_path, first, second, who):
    path = opened(tmp_path, tables(("reference", first), ("today", second)))
    with pytest.raises(InputError, match=rf'"fit" of each state; {who} has none\. Add one'):
        diagnose(path)


def test_both_states_are_of_one_kind(tmp_path, lab, measure):
    path = files(tmp_path, measure, (("reference", lab()),))
    text = path.read_text(encoding="utf-8") + tables(("today", "fit")).removeprefix(CHAIN)
    with pytest.raises(InputError, match=r"the reference are responses, those of the other state"):
        diagnose(opened(tmp_path, text))


def test_run_updates_to_the_state_that_is_looked_into(tmp_path):
    """The recordings of the reference are another structure's; alone they are what there is."""
    spec, _, recordings = open_problem(
        opened(tmp_path, tables(("reference", "fit"), ("today", "fit"), ("today", "hold-out")))
    )
    (reference, its), (other, own) = parted(spec, recordings)
    assert [r.origin.state for r in its] == ["reference"] and len(own) == 2
    assert len(reference.recordings) == 1 and len(other.recordings) == 2
    assert looked_into(spec, recordings)[1] == own
    assert looked_into(reference, its) == (reference, its)
    f = model_modes(build_model(spec), MODES).flexible().frequencies[:MODES]
    rows = ", ".join(f"{{ frequency = {v!r} }}" for v in (0.98 * f).tolist())
    text = CHAIN + f'[[recordings]]\nkind = "modes"\nrows = [{rows}]\n'
    text += '[[recordings]]\nkind = "modes"\nstate = "reference"\nrows = [{ frequency = 3.0 }]\n'
    text += '[update]\nmethod = "frequencies"\n'
    text += 'parameters = [{ elements = [101, 102, 103, 104], of = "stiffness" }]\n'
    path = opened(tmp_path, text)
    assert load_problem(path).recordings[1].state == "reference"
    assert run(path).parameters[0].p == pytest.approx(0.98**2 - 1.0, abs=1e-4)


def test_contradictions_are_looked_for_within_a_state(tmp_path, lab, measure):
    from cvxupdate.correlate.plausible.quality import LEVEL, quality_doubts

    sound, changed = measure(lab(), 4), measure(lab(k=(0.5, 1, 1, 1)), 4, seed=5)
    as_one = quality_doubts([sound, changed])
    states = [
        replace(r, origin=replace(r.origin, state=s))
        for r, s in ((sound, "reference"), (changed, "today"))
    ]
    assert LEVEL in {d.check for d in as_one}
    assert LEVEL not in {d.check for d in quality_doubts(states)}
    twice = [replace(r, H=k * r.H) for r, k in ((sound, 1.0), (measure(lab(), 4, seed=5), 2.0))]
    assert "gain" in {d.check for d in quality_doubts(twice)}
    apart = [
        replace(r, origin=replace(r.origin, state=s))
        for r, s in zip(twice, ("reference", "today"), strict=True)
    ]
    assert "gain" not in {d.check for d in quality_doubts(apart)}


def test_a_mass_that_is_taken_off_is_no_bar_that_grows_stiffer(tmp_path) -> None:
    """Frequencies alone say the same of both: a cantilever's curvature as far from the tip is what
    its deflection is from the clamp. The bar of the second test is the bar of the first."""
    rng, tables = np.random.default_rng(7), []
    for state, lumps in (("reference", NODES), ("today", (NODES[0], *NODES[2:]))):
        path = cantilever(
            tmp_path, SOFT.format(kz=1e9, kr=4000.0), lumps, [("today", np.arange(1.0, 6.0))]
        )
        real = build_model(replace(load_problem(path), update=None))
        noisy = 1.0 + 0.001 * rng.standard_normal(5)
        tables.append((state, model_modes(real, 5).frequencies * noisy))
    (first,) = diagnose(cantilever(tmp_path, tables=tables)).findings
    assert first.physics == "added_mass" and first.place.nodes == (NODES[1],)
    assert abs(first.parameters["m"] + MASS) <= 2.0 * first.deviations["m"]
    assert first.confidence > 0.5


def test_a_clamp_that_has_come_looser_is_found_beside_one_that_turned_before(tmp_path) -> None:
    """What the reference gave the model on springs may give more."""
    rng, tables = np.random.default_rng(8), []
    for state, kr in (("reference", 500.0), ("today", 100.0)):
        path = cantilever(
            tmp_path, SOFT.format(kz=1e9, kr=kr), NODES, [("today", np.arange(1.0, 6.0))]
        )
        real = build_model(replace(load_problem(path), update=None))
        noisy = 1.0 + 0.0005 * rng.standard_normal(5)
        tables.append((state, model_modes(real, 5).frequencies * noisy))
    (first,) = diagnose(cantilever(tmp_path, tables=tables)).findings
    assert first.physics == "grounding_spring" and first.place.nodes == (1,)
    assert first.place.dof == "ry" and first.confidence > 0.8
    assert first.parameters["k"] == pytest.approx(100.0, rel=0.15)
    assert "gives more than it did" in first.says

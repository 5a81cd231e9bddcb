"""The diagnosed model written as a problem file: built anew, it is the diagnosed model, effect by
effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.modes.setting import setting_of
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file, updated_problem, with_damping
from cvxupdate.diagnose.results import Further, Updated
from cvxupdate.errors import ModelError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.physics import candidates_of
from cvxupdate.physics.attached_resonator import attach
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.growth import Wanted, append_parameters
from cvxupdate.recordings.corrections import corrected
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, Origin
from cvxupdate.residual.modal import modal_residual
from cvxupdate.spec import Spec, check_problem, load_problem, spec_of
from tests.cases.effects import BEAM, SHAFT, context_of, nuisance, problem
from tests.cases.elements import grid, toml
from tests.cases.signals import signal_of

PLATE = {
    **grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26]),
    "supports": [{"nodes": [1, 4], "dofs": ["z"]}],
    "damping": {"kind": "modal", "zeta": [0.01, 0.02]},
}
STRUCTURES = {"beam": BEAM, "plate": PLATE, "shaft": SHAFT}
LABELS = {
    "beam": ["n3.z", "n4.x", "n4.ry", "n6.z"],
    "plate": ["n6.z", "n9.z", "n12.rx"],
    "shaft": ["n2.y", "n3.z", "n4.ry", "n4.z"],
}
FREQUENCIES = (7.0, 61.0, 333.0)


def receptance(
    model: Model, labels: list[str], p: NDArray[np.float64] | None = None
) -> NDArray[np.complex128]:
    """Dense, with all that C and D hold."""
    m = model.matrices(p)
    K, M, C, D = (x.toarray() for x in (m.K, m.M, m.C, m.D))
    at = [model.place[x] for x in labels]
    return np.array(
        [
            np.linalg.inv(K + 1j * D + 2j * np.pi * f * C - (2 * np.pi * f) ** 2 * M)[
                np.ix_(at, at)
            ]
            for f in FREQUENCIES
        ]
    )


def scale(H: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Of each entry: the geometric mean of its two direct receptances."""
    direct = np.sqrt(np.abs(np.einsum("fii->fi", H)))
    return np.asarray(direct[:, :, None] * direct[:, None, :])


def written(folder: Path, spec: Spec, model: Model, p: NDArray[np.float64]) -> tuple[Spec, Model]:
    path = folder / "again" / "problem.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        problem_file(spec, Updated(model, p, zeta=np.zeros(1)), says=["what\nwas found"]).text,
        encoding="utf-8",
    )
    assert check_problem(path) == ()
    again = load_problem(path)
    return again, build_model(again)


def values_for(candidate: Effect, model: Model) -> NDArray[np.float64]:
    """Nuisance parameters off by percents, physics by much, within bounds."""
    rng = np.random.default_rng(len(candidate.name))
    p = np.concatenate([[0.031, -0.024], rng.uniform(0.2, 0.45, candidate.columns)])
    if candidate.sign == 0 and len(candidate.name) % 2:
        p[2:] *= -1.0
    return np.clip(p, [q.lower for q in model.parameters], [q.upper for q in model.parameters])


WORDS = [
    (s, w)
    for s, names in {
        "beam": (
            "stiffness_change",
            "mass_change",
            "thickness_change",
            "added_mass",
            "grounding_spring",
            "joint_flexibility",
            "shear_deformation",
            "axial_preload",
            "attached_resonator",
            "viscous_damper",
            "structural_damping",
            "mass_proportional_damping",
        ),
        "plate": (
            "stiffness_change",
            "mass_change",
            "thickness_change",
            "orthotropy",
            "added_mass",
            "grounding_spring",
            "attached_resonator",
            "structural_damping",
            "mass_proportional_damping",
        ),
        "shaft": ("gyroscopic", "joint_flexibility", "added_mass", "grounding_spring"),
    }.items()
    for w in names
]


@pytest.mark.parametrize(("structure", "name"), WORDS)
def test_every_effect_at_every_place_is_written(tmp_path: Path, structure: str, name: str) -> None:
    """FRFs of the file built anew are those of the diagnosed model to 1e-8 of the largest, nuisance
    parameters and all damping included."""
    spec = problem(tmp_path, STRUCTURES[structure])
    base = nuisance(undamped(build_model(spec)))
    found = candidates_of(context_of(spec, base), (name,))
    assert found
    acts: list[bool] = []
    few = {
        c.name: c for c in found
    }.values()  # a hidden oscillator has one candidate for each tuning
    for candidate in list(few)[:: max(1, len(few) // 12)]:
        model = candidate.action.plant(candidate, base, np.array([0.07, 0.0, 0.0]), 1.0).model
        p = values_for(candidate, model)
        again, rebuilt = written(tmp_path, spec, model, p)
        wanted = receptance(model, LABELS[structure], p)
        got = receptance(rebuilt, LABELS[structure])
        still = receptance(base, LABELS[structure], p[:2])
        acts.append(bool(np.any(np.abs(wanted - still) > 1e-5 * scale(still))))
        assert np.all(np.abs(got - wanted) <= 1e-8 * scale(wanted)), candidate.name
        if set(model.labels) <= set(rebuilt.labels):  # no DOF of its own: matrix by matrix
            order = [rebuilt.place[label] for label in model.labels]
            ours, theirs = model.matrices(p), rebuilt.matrices()
            for which in "KMCD":
                one, other = getattr(ours, which), getattr(theirs, which)
                assert abs(one - other[order][:, order]).max() <= 1e-12 * abs(one).max(), (
                    candidate.name
                )
        assert rebuilt.size == model.size
        assert again.title.startswith('A "quoted" title')
    assert np.mean(acts) >= 0.5  # a damper along a stiff bar changes next to nothing, the others do


def test_added_masses_taken_off_and_put_on(tmp_path: Path) -> None:
    spec = problem(tmp_path, BEAM)
    base = nuisance(undamped(build_model(spec)))
    lump = next(
        c for c in candidates_of(context_of(spec, base), ("added_mass",)) if c.place.nodes == (4,)
    )
    assert lump.change is not None
    for size in (-3.0, 3.0):
        again, rebuilt = written(tmp_path, spec, lump.change.model, np.array([0.0, 0.0, size]))
        row = again.model.elements[-1].rows[0]
        assert row.taken_off == (size < 0.0) and row.m == pytest.approx(
            abs(size) * 0.01 * base.total_mass()
        )  # type: ignore[union-attr]
        assert rebuilt.total_mass() - base.total_mass() == pytest.approx(
            size * 0.01 * base.total_mass()
        )


def test_several_effects_at_once(tmp_path: Path) -> None:
    """A joint that gives way at the node of a soft support, with a resonator, a spin-free lump and
    a thinner element beside it."""
    spec = problem(tmp_path, BEAM)
    model = nuisance(undamped(build_model(spec)))
    soft = next(
        c
        for c in candidates_of(context_of(spec, model), ("grounding_spring",))
        if c.place.nodes == (2,) and c.place.dof == "z" and c.change and c.change.series
    )
    assert soft.change is not None
    model = soft.change.model
    for name, nodes_ in (("joint_flexibility", (3,)), ("added_mass", (5,))):
        candidate = next(
            c for c in candidates_of(context_of(spec, model), (name,)) if c.place.nodes == nodes_
        )
        assert candidate.change is not None
        model = candidate.change.model
    model = append_parameters(
        attach(model, model.place["n5.z"], 55.0, 0.05, 0.02), [Wanted("thin", "height", (3,))]
    )
    p = np.array([0.02, -0.01, 0.4, 0.7, 2.0, 0.1, -0.1, 0.2, -0.15])
    again, rebuilt = written(tmp_path, spec, model, p)
    wanted = receptance(model, LABELS["beam"], p)
    assert np.all(np.abs(receptance(rebuilt, LABELS["beam"]) - wanted) <= 1e-8 * scale(wanted))
    assert len(again.model.ties) == 1 and again.model.ties[0].dofs == ("x", "z")
    assert (
        rebuilt.place[f"n{again.model.ties[0].nodes[1]}.z"] == rebuilt.place["n3.z"]
    )  # the tied node moves as the first does


def test_matrices_of_other_programs_keep_their_file(tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", K=np.array([[3e4, -1e4], [-1e4, 2e4]]), M=np.diag([1.2, 0.7]))
    (tmp_path / "problem.toml").write_text(
        """
[model]
dofs = ["x"]
[[model.elements]]
type = "matrix"
file = "m.npz"
rows = [{ id = 1, stiffness = "K", mass = "M", group = "all" }]
[model.damping]
kind = "modal"
zeta = 0.01
""",
        encoding="utf-8",
    )
    spec = load_problem(tmp_path / "problem.toml")
    model = nuisance(undamped(build_model(spec)))
    _, rebuilt = written(tmp_path, spec, model, np.array([0.2, -0.1]))
    np.testing.assert_allclose(
        rebuilt.matrices().K.toarray(), 1.2 * np.array([[3e4, -1e4], [-1e4, 2e4]])
    )
    np.testing.assert_allclose(rebuilt.matrices().M.toarray(), 0.9 * np.diag([1.2, 0.7]))


def test_what_no_file_can_say_is_refused(tmp_path: Path) -> None:
    spec = problem(tmp_path, BEAM)
    model = undamped(build_model(spec))
    odd = replace(model.blocks[-1], ids=np.array([99]))
    odd = replace(odd, kind=replace(odd.kind, name="sponge"))
    with pytest.raises(ModelError, match="sponge"):
        problem_file(spec, Updated(replace(model, blocks=(*model.blocks, odd)), np.zeros(0)))


def test_a_model_without_a_title_is_called_a_model(tmp_path: Path) -> None:
    """In the file that is written: of tables there is neither title nor file."""
    for given, title, origin in (
        (replace(problem(tmp_path, BEAM), title=""), tmp_path.name, "from "),
        (spec_of({"model": BEAM}), "model", "diagnose."),
        (spec_of({"title": "Bar", "model": BEAM}), "Bar", "diagnose."),
    ):
        done = problem_file(given, Updated(build_model(given), np.zeros(0)))
        assert done.tables["title"] == f"{title} (updated by diagnose)"
        assert origin in done.head[0] and "from problem." not in done.head[0]


def test_sensor_faults_are_taken_out_of_the_recordings_that_have_them(tmp_path: Path) -> None:
    """What faults made of a recording, the corrections of the written file undo; one without the
    channel is left alone."""
    (tmp_path / "frf.npz").write_bytes(b"x")
    faults = [
        (Fault("n2.z", "gain"), -1.7),
        (Fault("n2.z", "swap", other="n3.z"), 0.0),
        (Fault("n3.z", "delay", 1e-3), 0.8),
    ]
    recordings = "".join(
        f'[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nuse = "{use}"\n'
        for use in ("fit", "hold-out")
    )
    (tmp_path / "problem.toml").write_text(f"model = {toml(BEAM)}\n{recordings}", encoding="utf-8")
    spec = load_problem(tmp_path / "problem.toml")
    model = nuisance(undamped(build_model(spec)))
    text = problem_file(
        spec,
        Updated(model, model.zero(), zeta=np.array([0.01]), faults=tuple(faults)),
        [frozenset({"n2.z", "n3.z"}), frozenset({"n3.z"})],
    ).text
    (tmp_path / "again.toml").write_text(text, encoding="utf-8")
    again = load_problem(tmp_path / "again.toml")
    assert [len(r.corrections) for r in again.recordings] == [3, 1]
    lines = np.arange(5.0, 90.0)
    H = np.random.default_rng(1).normal(size=(len(lines), 2, 1)) + 0.3j
    channels = (Channel(2, "z", "acceleration"), Channel(3, "z", "acceleration"))
    sound = FrequencyResponse(
        Origin("a", "a"), lines, H, "acceleration", channels, (Channel(4, "z", "force"),)
    )
    signal = signal_of(sound)
    wrong = H
    for fault, value in faults:
        wrong = fault.applied(value, signal.sensors, signal.s, wrong)
    back = corrected(replace(sound, H=wrong), again.recordings[0].corrections)
    order = [[c.label for c in back.responses].index(c.label) for c in channels]  # type: ignore[union-attr]
    np.testing.assert_allclose(back.H[:, order], H, rtol=1e-10)  # type: ignore[union-attr]


def test_modal_damping_is_that_of_the_diagnosis(tmp_path: Path) -> None:
    """Each mode its own ratio, a common decay rate beside them, and a free structure's rigid-body
    modes without."""
    spec = problem(tmp_path, {**PLATE, "supports": []})
    model = nuisance(undamped(build_model(spec)))
    air = next(iter(candidates_of(context_of(spec, model), ("mass_proportional_damping",))))
    assert air.change is not None
    p = np.array([0.02, -0.01, 0.7])
    zeta = [0.011, 0.007, 0.02, 0.02, 0.02]
    path = tmp_path / "again.toml"
    path.write_text(
        problem_file(spec, Updated(air.change.model, p, zeta=np.array(zeta))).text, encoding="utf-8"
    )
    rebuilt = build_model(load_problem(path))
    assert rebuilt.modal_damping == (0.011, 0.007, 0.02)
    m = matrices_with_damping(rebuilt)
    modes = model_modes(rebuilt, rebuilt.size).flexible()
    inside = modes.shapes.T @ (m.C @ modes.shapes)
    omega = np.sqrt(modes.eigenvalues)
    wanted = 2 * omega * np.array((zeta + [0.02] * len(omega))[: len(omega)])
    plain = undamped(rebuilt).matrices().C  # what stands beside modal damping stays
    np.testing.assert_allclose(
        np.diag(inside) - np.diag(modes.shapes.T @ (plain @ modes.shapes)), wanted, rtol=1e-9
    )
    np.testing.assert_allclose(
        plain.toarray(), air.change.model.matrices(p).C.toarray(), rtol=1e-12
    )


def test_a_damper_beside_goes_with_what_a_file_has_words_for(tmp_path: Path) -> None:
    """A plate whose sheets were fitted with theory that no file says, and a damper on it, ended in
    an error (the laboratory's table 2735)."""
    spec = problem(tmp_path, PLATE)
    model = nuisance(undamped(build_model(spec)))
    damper = next(iter(candidates_of(context_of(spec, model), ("viscous_damper",))))
    assert damper.change is not None
    said = model.with_parameters(model.parameters[1:])
    found = with_damping(
        Updated(said, np.full(len(said.parameters), 0.1)), (damper.change.model, 3.0)
    )
    names = [q.name for q in said.parameters]
    assert [q.name for q in found.model.parameters] == [
        *names,
        damper.change.model.parameters[-1].name,
    ]
    assert found.p.tolist() == [*[0.1] * len(names), 3.0]
    assert "damper" in problem_file(spec, found).text


MODES = """
[[recordings]]
kind = "modes"
use = "hold-out"
rows = [{ frequency = 30.0, mode = 3 }]
[[recordings]]
kind = "modes"
rows = [{ frequency = 14.0, mode = 1 }, { frequency = 61.0, mode = 2 }, { frequency = FOURTH }]
"""


def test_mode_tables_keep_their_pairs_when_modes_are_counted_anew(tmp_path: Path) -> None:
    """A hidden oscillator below the first mode moves every number up by one; what was not fixed
    stays free."""
    fourth = model_modes(build_model(problem(tmp_path, BEAM)), 4).frequencies[3]
    (tmp_path / "problem.toml").write_text(
        f"model = {toml(BEAM)}\n{MODES.replace('FOURTH', repr(float(fourth)))}", encoding="utf-8"
    )
    spec = load_problem(tmp_path / "problem.toml")
    base = nuisance(undamped(build_model(spec)))
    low = 0.3 * model_modes(base, 1).frequencies[0]
    model = attach(base, base.place["n6.z"], float(low), 1e-3, 0.01)
    fit, hold = (
        [t for t in load_recordings(spec) if isinstance(t, ModeTable) and t.origin.use == use]
        for use in ("fit", "hold-out")
    )
    first = modal_residual(base, fit, hold, False).evaluate(base.zero())
    recordings = load_recordings(spec)
    evidence = gathered(spec, build_model(spec), recordings, lambda said: None)
    setting = setting_of(model, evidence.tables)
    point = replace(
        setting.residual.evaluate(model.zero()),
        places=tuple(np.where(a >= 0, a + 1, a) for a in first.places),
    )
    path = tmp_path / "again.toml"
    updated = evidence.updated(Fit(setting, point, 0.0, 3), Further())
    done = updated_problem(spec, recordings, updated)
    assert done is not None
    path.write_text(done.text, encoding="utf-8")
    again = load_problem(path)
    assert [[row.mode for row in r.rows] for r in again.recordings if r.kind == "modes"] == [
        [4],
        [2, 3, None],
    ]
    assert again.model.damping == spec.model.damping  # tables of frequencies leave it alone
    np.testing.assert_allclose(
        model_modes(build_model(again), 4).frequencies[1:4],
        model_modes(base, 3).frequencies,
        rtol=1e-3,
    )


@pytest.mark.parametrize(
    "damping",
    [
        None,
        {"kind": "structural", "eta": 0.01},
        {"kind": "rayleigh", "alpha": 0.4, "beta": 1e-5},
        {"kind": "modal", "zeta": 0.01},
    ],
)
def test_damping_found_in_tables_stands_beside_that_of_the_file(
    tmp_path: Path, damping: dict[str, Any] | None
) -> None:
    """A common decay rate and a loss factor of a group: C and D of the file plus those of the
    effect."""
    spec = problem(
        tmp_path,
        {
            **{k: v for k, v in BEAM.items() if k != "damping"},
            **({"damping": damping} if damping else {}),
        },
    )
    file, model = build_model(spec), nuisance(undamped(build_model(spec)))
    own = replace(
        file,
        blocks=tuple(
            replace(
                b,
                properties={
                    **b.properties,
                    **{k: 0 * v for k, v in b.properties.items() if k in ("eta", "alpha", "beta")},
                },
            )
            for b in file.blocks
        ),
    ).matrices()  # dashpots alone
    for kind in ("mass_proportional_damping", "structural_damping"):
        candidate = next(c for c in candidates_of(context_of(spec, model), (kind,)))
        assert candidate.change is not None
        p = np.append(model.zero(), 0.8)
        path = tmp_path / "again.toml"
        path.write_text(
            problem_file(spec, Updated(candidate.change.model, p)).text, encoding="utf-8"
        )
        got, was, extra = (
            build_model(load_problem(path)).matrices(),
            file.matrices(),
            candidate.change.model.matrices(p),
        )
        if damping is None or damping["kind"] != "modal":
            for name in "CD":
                wanted = getattr(was, name) + getattr(extra, name) - getattr(own, name)
                assert abs(getattr(got, name) - wanted).max() <= 1e-12 * max(
                    abs(wanted).max(), 1e-300
                ), (kind, name)
        else:  # there the model under diagnosis has kept what stands beside modal damping
            assert abs(got.C - extra.C).max() <= 1e-12 * abs(extra.C).max()
        assert abs(got.K - was.K).max() == 0.0


def test_one_force_transducer_is_put_right_wherever_it_drives() -> None:
    """In each recording the drives that it has; nothing where it does not drive."""
    fault = Fault("n2.z", "force", others=("n3.z",))
    both = fault.corrections(0.25, {"force n2.z", "force n3.z", "n5.z"})
    assert [(row["node"], row["quantity"], row["gain"]) for row in both] == [
        (2, "force", 0.8),
        (3, "force", 0.8),
    ]
    assert [row["node"] for row in fault.corrections(0.25, {"force n3.z"})] == [3]
    assert fault.corrections(0.25, {"n2.z", "n3.z"}) == []
    y = np.ones((2, 3, 3), dtype=complex)
    seen = fault.applied(0.25, ("n5.z",) * 3, np.zeros(2), y, ("n2.z", "n4.z", "n3.z"))
    np.testing.assert_allclose(seen[0, 0], [1.25, 1.0, 1.25])

"""Generated problems and their judge: the same seed the same files, every effect generated and
well-formed, an interrupted run resumed, outcomes told apart."""

from __future__ import annotations

import time
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.study import open_problem
from validation import calibrate, generate
from validation.generated import cases, effects, files, laboratory


def test_a_seed_gives_the_same_files(tmp_path):
    for seed in (2, 4):
        for name in ("a", "b"):
            generate.make(seed, tmp_path / f"{name}{seed}")
        first, second = (sorted((tmp_path / f"{n}{seed}").iterdir()) for n in "ab")
        assert [p.name for p in first] == [p.name for p in second]
        assert [p.read_bytes() for p in first] == [q.read_bytes() for q in second]


# of every family, with every kind of recording, with something concealed and without
SEEDS = (0, 2, 3, 4, 5, 6, 12, 13, 14, 16, 19, 20, 23, 30)


@pytest.mark.parametrize("seed", SEEDS)
def test_generated_problems_can_be_read(tmp_path, seed):
    generate.make(seed, tmp_path)
    spec, model, recordings = open_problem(tmp_path / "problem.toml")
    assert {r.origin.use for r in recordings} == {"fit", "hold-out"}
    truth = tomllib.loads((tmp_path / "truth.toml").read_text())
    assert bool(truth.get("findings")) == (seed % 3 != 0)
    nodes, elements = (
        {n.id for n in spec.model.nodes},
        {i for b in model.blocks for i in b.ids.tolist()},
    )
    for f in truth.get("findings", ()):
        assert set(f["location"]["nodes"]) <= nodes and set(f["location"]["elements"]) <= elements


def test_every_word_and_family_comes_up():
    drawn = [cases.draw(s) for s in range(100)]
    assert {f.effect["physics"] for c in drawn for f in c.findings} == (
        set(effects.MAKERS) - {"soft_support"}
    )
    assert {c.design.family for c in drawn} == {*cases.FAMILIES, "rotor"}
    scene = effects.Scene(drawn[2].design, np.array([10.0]), 100.0, "frf", drawn[2].sensors)
    faults = [
        effects.MAKERS["sensor_fault"](np.random.default_rng(k), scene, "sensor_fault").effect
        for k in range(40)
    ]
    assert {k for e in faults for k in ("gain", "delay", "other") if k in e} == {
        "gain",
        "delay",
        "other",
    }
    assert {c.kind for c in drawn} == {"frf", "time", "modes"}
    assert any(len(c.findings) == 2 for c in drawn)
    assert sum(not c.findings for c in drawn) == len(range(0, 100, 3))


# ---------------------------------------------------------------------------- the laboratory's laws


def bar(elements=16, held=((1, "z"), (17, "z"))):
    nodes = {i + 1: (i / elements, 0.0, 0.0) for i in range(elements + 1)}
    return laboratory.Design(
        "bar",
        ("z", "ry"),
        nodes,
        tuple(laboratory.Element(i + 1, "bar", (i + 1, i + 2), "bar") for i in range(elements)),
        held,
        207e9,
        0.3,
        7850.0,
        (0.05, 0.1),
        0.01,
    )


def test_bar_has_the_frequencies_of_closed_forms():
    d, k = bar(), np.arange(1, 6) * np.pi
    area, inertia = 0.005, 0.05 * 0.1**3 / 12.0
    plain = laboratory.natural(laboratory.build(d, {}, []), 0.0, 5)[0]
    assert plain == pytest.approx(
        k**2 * np.sqrt(d.E * inertia / (d.rho * area + d.rho * inertia * k**2)), rel=1e-5
    )
    pulled = laboratory.natural(
        laboratory.build(d, {}, [{"physics": "axial_preload", "elements": range(1, 17), "N": 3e5}]),
        0.0,
        5,
    )[0]
    assert pulled == pytest.approx(
        np.sqrt((d.E * inertia * k**4 + 3e5 * k**2) / (d.rho * area + d.rho * inertia * k**2)),
        rel=1e-5,
    )
    shear = laboratory.natural(
        laboratory.build(d, {}, [{"physics": "shear_deformation", "elements": range(1, 17)}]),
        0.0,
        5,
    )[0]
    G = laboratory.KAPPA * d.E / 2.6  # Timoshenko's equation of a pinned bar, both inertias
    a, b = (
        d.rho**2 * inertia / G,
        d.rho * area + d.rho * inertia * k**2 + d.rho * area * d.E * inertia / (G * area) * k**2,
    )
    exact = np.sqrt((b - np.sqrt(b**2 - 4.0 * a * d.E * inertia * k**4)) / (2.0 * a))
    assert shear == pytest.approx(exact, rel=2e-4)


def test_spinning_shaft_whirls_as_rayleigh_says():
    """(ρA + ρI k²) ω² ∓ 2 ρI k² Ω ω = E I k⁴ for a pinned round shaft, forward and backward."""
    nodes, spin, d = {i + 1: (i / 12, 0.0, 0.0) for i in range(13)}, 2e4, 0.1
    shafts = tuple(laboratory.Element(i + 1, "shaft", (i + 1, i + 2), "shaft") for i in range(12))
    held = tuple((n, k) for n in (1, 13) for k in ("y", "z"))
    design = laboratory.Design(
        "rotor", ("y", "z", "ry", "rz"), nodes, shafts, held, 207e9, 0.3, 7850.0, (d,), 0.01
    )
    s = laboratory.build(
        design, {}, [{"physics": "gyroscopic", "elements": range(1, 13), "omega": spin}]
    )
    assert np.array_equal(s.C, -s.C.T) and np.any(s.C)
    n = len(s.K)
    omega = np.sort(
        np.abs(
            scipy.linalg.eigvals(
                np.block(
                    [
                        [np.zeros((n, n)), np.eye(n)],
                        [-np.linalg.solve(s.M, s.K), -np.linalg.solve(s.M, s.C)],
                    ]
                )
            ).imag
        )
    )[::2]
    area, inertia = np.pi * d**2 / 4.0, np.pi * d**4 / 64.0
    exact = []
    for k in np.pi * np.arange(1, 4):
        m, g, stiff = (
            7850.0 * (area + inertia * k**2),
            2.0 * 7850.0 * inertia * k**2 * spin,
            207e9 * inertia * k**4,
        )
        exact += [(sign * g + np.sqrt(g**2 + 4.0 * m * stiff)) / (2.0 * m) for sign in (-1.0, 1.0)]
    assert omega[:4] == pytest.approx(np.sort(exact)[:4], rel=1e-4)


def test_plate_has_the_frequencies_of_closed_forms():
    nx, ny, a, b, h = 6, 5, 0.6, 0.6, 0.004
    nodes = {
        1 + i + j * (nx + 1): (a * i / nx, b * j / ny, 0.0)
        for j in range(ny + 1)
        for i in range(nx + 1)
    }
    quads = tuple(
        laboratory.Element(
            1 + i + j * nx,
            "plate",
            tuple(
                1 + p + q * (nx + 1) for p, q in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
            ),
            "plate",
        )
        for j in range(ny)
        for i in range(nx)
    )
    design = laboratory.Design(
        "plate", ("z", "rx", "ry"), nodes, quads, (), 70e9, 0.3, 2700.0, (h,), 0.01
    )
    soft = [
        {"physics": "grounding_spring", "node": n, "dof": "z", "k": 1e-3}
        for n in (1, nx + 1, len(nodes))
    ]
    f = laboratory.natural(laboratory.build(design, {}, soft), 0.0, 9)[0] / (2.0 * np.pi)
    D = 70e9 * h**3 / 12.0 / (1.0 - 0.3**2)
    assert np.all(f[:3] < 0.05)
    exact = [
        13.468,
        19.596,
        24.270,
        34.801,
        34.801,
        61.093,
    ]  # completely free square, converged Ritz series (Liew, Xiang and Kitipornchai 1993)
    assert f[3:] * 2.0 * np.pi * a**2 * np.sqrt(2700.0 * h / D) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("family", ["chain", "bar", "frame", "plate", "rotor"])
def test_runs_agree_with_the_frequency_response(family):
    """Every channel, also those that hardly move: of modes far above the band only their
    flexibility is left."""
    case = next(
        c
        for c in map(cases.draw, range(1, 200))
        if c.design.family == family and not any("eta" in f.effect for f in c.findings)
    )
    m = laboratory.modal(
        laboratory.build(case.design, case.scatter, case.effects),
        case.top,
        np.maximum(case.zeta, 0.02),
    )
    rate, n = 2.56 * case.top, 16384
    t = np.arange(n) / rate
    force = np.exp(-(((t - 0.02 * t[-1]) * 0.6 * case.top) ** 2)) * np.sin(np.pi * case.top * t)
    places = m.rows(case.sensors)
    a = m.run(force, rate, places, m.rows(case.drives)[0])
    f = np.fft.rfftfreq(n, 1.0 / rate)
    keep = (f > 0.2 * case.top) & (f < 0.9 * case.top)
    H = (np.fft.rfft(a, axis=0) / np.fft.rfft(force)[:, None])[keep]
    exact = m.accelerance(2j * np.pi * f[keep], places, m.rows(case.drives)[:1])[:, :, 0]
    loud = np.linalg.norm(exact, axis=0) > 1e-6 * np.linalg.norm(exact)
    assert np.all(
        np.linalg.norm(H - exact, axis=0)[loud] < 2e-3 * np.linalg.norm(exact, axis=0)[loud]
    )


def test_exchanged_cables_exchange_columns_and_nothing_else(tmp_path):
    case = next(
        c for c in map(cases.draw, range(1, 60, 3)) if c.kind == "frf" and len(c.sensors) > 3
    )
    a, b = case.sensors[0], case.sensors[2]
    swap = effects.Finding(
        {"physics": "sensor_fault", "node": a[0], "dof": a[1], "other": b},
        effects.place([a[0], b[0]], dof=a[1]),
        (),
        {},
    )
    H = []
    for k, found in enumerate(((), (swap,))):
        files.write(replace(case, findings=found, noise=1e-9), tmp_path / str(k))
        H.append(np.load(tmp_path / str(k) / "frf1.npz")["H"])
    order = [2, 1, 0, *range(3, len(case.sensors))]
    assert np.allclose(H[1], H[0][:, order], rtol=1e-4, atol=1e-6 * np.abs(H[0]).max())


# --------------------------------------------------------------------------------- judge and resume


def place(nodes=(), elements=(), groups=(), dof=None):
    return {
        "nodes": list(nodes),
        "elements": list(elements),
        "groups": list(groups),
        **({"dof": dof} if dof else {}),
    }


def finding(physics, location, confidence=0.9, equivalent=()):
    return {
        "physics": physics,
        "location": location,
        "parameters": {"m": 1.0},
        "confidence": confidence,
        "says": "…",
        "equivalent": [{"physics": p, "location": x} for p, x in equivalent],
    }


def said(verdict, *findings):
    return {"verdict": verdict, "says": "…", "findings": list(findings), "fit": {}}


def truth(*found):
    return {
        "verdict": "missing_physics" if found else "consistent",
        "accept": ["missing_physics"] if found else ["consistent"],
        "family": "chain",
        "recording": "frf",
        "laboratory": {"noise": 0.01, "visible": [1.0] * len(found), "left": [5.0] * len(found)},
        "findings": [
            {
                "physics": p,
                "location": x,
                "accept": {},
                "equivalent": [],
                "parameters": [{"name": "m", "value": 1.1, "tolerance": 0.2}],
            }
            for p, x in found
        ],
    }


DAMPER = ("viscous_damper", place([2, 3], dof="x"))
SHEAR = [("shear_deformation", place((), ids)) for ids in ([1, 2], [3, 4], [1, 2, 3, 4])]
MASS, SPRING = ("added_mass", place([3], dof="x")), ("grounding_spring", place([5], dof="x"))


@pytest.mark.parametrize(
    ("verdict", "findings", "true", "outcome"),
    [
        ("consistent", (), (), "silent"),
        ("undetermined", (), (), "doubt"),
        ("missing_physics", (MASS,), (), "false alarm"),
        ("parameter_error", (MASS,), (), "false alarm"),
        ("consistent", (), (MASS,), "missed"),
        ("undetermined", (), (MASS,), "undetermined"),
        ("undetermined", (SPRING,), (MASS,), "undetermined"),  # what is not claimed cannot be wrong
        ("missing_physics", (MASS,), (MASS,), "right"),
        ("missing_physics", (SPRING,), (MASS,), "wrong"),
        ("missing_physics", (("added_mass", place([4], dof="x")),), (MASS,), "wrong"),
        ("missing_physics", (MASS, SPRING), (MASS,), "wrong"),
        ("missing_physics", (MASS,), (MASS, SPRING), "part"),
        ("missing_physics", (SPRING, MASS), (MASS, SPRING), "right"),
        (
            "missing_physics",
            (MASS, MASS),
            (MASS,),
            "wrong",
        ),  # the same thing twice is one sentence too many
        ("missing_physics", (DAMPER,), (DAMPER,), "right"),
        (
            "missing_physics",
            (("viscous_damper", place([2], dof="x")),),
            (DAMPER,),
            "wrong",
        ),  # to ground is not between
        (
            "missing_physics",
            (SHEAR[0], SHEAR[1]),
            (SHEAR[2],),
            "right",
        ),  # two parts of one thing are not
        ("missing_physics", (SHEAR[0], SHEAR[0]), (SHEAR[2],), "wrong"),
    ],
)
def test_outcomes(verdict, findings, true, outcome):
    row = calibrate.judged(said(verdict, *(finding(*f) for f in findings)), truth(*true))
    assert row["outcome"] == outcome
    assert row["right_verdict"] == (verdict == ("missing_physics" if true else "consistent"))


def test_truth_among_the_equivalents_is_told_apart():
    row = calibrate.judged(
        said("missing_physics", finding(*SPRING, equivalent=[MASS])), truth(MASS)
    )
    assert (
        row["outcome"] == "wrong"
        and not row["findings"][0]["right"]
        and row["findings"][0]["among"]
    )
    right = calibrate.judged(said("missing_physics", finding(*MASS)), truth(MASS))["findings"][0]
    assert right["right"] and right["among"] and right["size"]


def test_totals_and_reliability():
    rows = [
        calibrate.judged(
            said("missing_physics", finding(*(SPRING if k == 0 else MASS))), truth(MASS)
        )
        for k in range(10)
    ]
    rows += [
        calibrate.judged(
            said("missing_physics", finding(*MASS, 0.4)) if k == 0 else said("consistent"), truth()
        )
        for k in range(20)
    ]
    rows = [{"seed": k, "seconds": 1.0, **r} for k, r in enumerate(rows)]
    s = calibrate.summary(rows)
    assert (s["false_alarms"], s["nulls"], s["claims_right"], s["claimed"]) == (1, 20, 9, 10)
    assert [(b["hits"], b["of"]) for b in s["reliability"]] == [(0, 1), (9, 10)]
    assert [f["seed"] for f in s["wrong_and_sure"]] == [0]
    assert s["brier"] == pytest.approx((9 * 0.01 + 0.81 + 0.16) / 11)
    assert s["by_word"]["added_mass"]["wrong"] == 1
    low, high = calibrate.wilson(1, 20)
    for p in (low, high):  # the interval's ends are where the score test is just significant
        assert abs(0.05 - p) == pytest.approx(1.959964 * np.sqrt(p * (1.0 - p) / 20), rel=1e-5)


def test_rates_per_family_and_kind():
    """A family that is bad shows, whatever the total."""
    rows = [
        {"seed": k, "seconds": 1.0, **calibrate.judged(said("consistent"), truth())}
        for k in range(30)
    ]
    bad = {**truth(), "family": "plate", "recording": "modes"}
    rows += [
        {
            "seed": 30 + k,
            "seconds": 1.0,
            **calibrate.judged(said("missing_physics", finding(*MASS)) if k else said("x"), bad),
        }
        for k in range(2)
    ]
    rows.append(
        {
            "seed": 99,
            "seconds": 1.0,
            **calibrate.judged(said("missing_physics", finding(*MASS)), truth(MASS)),
        }
    )
    r = calibrate.summary(rows)["rates"]
    assert set(r) == {"chain", "plate", "frf", "modes", "chain, frf", "plate, modes"}
    assert (r["plate"]["false_alarms"], r["plate"]["nulls"]) == (1, 2)
    assert r["chain, frf"]["false_alarm_interval"] == calibrate.wilson(0, 30)
    assert (r["frf"]["hits"], r["frf"]["effects"], r["frf"]["wrong"]) == (1, 1, 0)
    lines = "\n".join(calibrate.say(calibrate.summary(rows)))
    assert "1 of 2 (9–91 %)" in lines and calibrate.rate(0, 0) == "–"


def test_an_interrupted_run_goes_on(tmp_path, monkeypatch):
    asked = []

    def diagnose(problem):
        asked.append(problem)
        if len(asked) == 3:
            raise KeyboardInterrupt
        return said("consistent")

    monkeypatch.setattr(calibrate, "diagnose", diagnose)
    seeds = [3, 45, 57, 60]
    rows, complete = calibrate.run(seeds, tmp_path, 1, 60.0)
    assert [r["seed"] for r in rows] == [3, 45] and not complete and len(asked) == 3
    rows, complete = calibrate.run(seeds, tmp_path, 1, 60.0)
    assert [r["seed"] for r in rows] == seeds and complete and len(asked) == 5
    assert {r["outcome"] for r in rows} == {"silent"}
    assert sorted(p.name for p in (tmp_path / "cases").iterdir()) == sorted(
        f"{s}.json" for s in seeds
    )
    monkeypatch.setattr(calibrate, "fingerprint", lambda procedure: "another state")
    calibrate.run(seeds, tmp_path, 1, 60.0, keep=True)
    assert len(asked) == 5
    calibrate.run(seeds[:1], tmp_path, 1, 60.0)
    assert len(asked) == 6
    s = calibrate.write_page(rows, tmp_path)
    assert s["nulls"] == 4 and "<svg" in (tmp_path / "index.html").read_text()


def test_a_case_that_hangs_or_fails_is_an_outcome(tmp_path, monkeypatch):
    monkeypatch.setattr(calibrate, "diagnose", lambda problem: time.sleep(60.0))
    assert calibrate.attempt(3, tmp_path, "", 1.5)["why"] == "longer than 2 s"
    monkeypatch.setattr(calibrate, "diagnose", lambda problem: 1 / 0)
    row = calibrate.attempt(3, tmp_path, "", 60.0)
    assert row["outcome"] == "failed" and row["why"].startswith("ZeroDivisionError")
    assert calibrate.summary([row])["failed"] == 1


@pytest.mark.slow
def test_two_cases_for_real(tmp_path):
    rows, complete = calibrate.run([3, 5], tmp_path, 1, 120.0)
    assert complete and [r["outcome"] for r in rows] == ["silent", "right"]

"""Claims of `cvxupdate diagnose` on real recordings beside what is known of the structures.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.real.diagnoses [--all]   (--all: 70 layouts
of the beam instead of every seventh)

Prints a Markdown table, and writes it with the pages of all diagnoses to out/proof/real/. The
commands see problem files and recordings; truth.toml is opened here, afterwards.
"""

from __future__ import annotations

import json
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import load_problem
from cvxupdate.study import diagnose, open_problem, run
from validation.real import laws, table
from validation.real import problem_files as make
from validation.real.claim import OUT, Claim, found_text, held_out, said_of, whole

PROBLEMS = table.PROBLEMS
ASKED = make.mode_rows(
    [(1, 20.0, 1.0)], "fit", "asked"
)  # a problem file needs a recording; this one is not looked at


def roller(truth: dict[str, Any], everything: bool) -> list[Claim]:
    """Where the missing support stands, at six places; a straight line over the sensor's volts
    through those found."""
    volts = np.array(truth["volts"])
    out, places, ridges = [], [], []
    for k in range(6):
        problem = PROBLEMS / "dropbear-moving-support" / f"problem_diagnose_place_{k + 1}.toml"
        said = said_of(problem)
        out.append(said)
        ridges.append(ridge(said, {n.id: n.x for n in load_problem(problem).model.nodes}))
        places.append(between_nodes(ridges[-1]) if roller_named(said) else float("nan"))
    x = np.array(places)
    line = robust_line(volts, x)
    rows = []
    for k, said in enumerate(out):
        off = abs(x[k] - np.polyval(line, volts[k]))
        note = (
            f"place {1e3 * x[k]:.1f} mm, {1e3 * off:.1f} mm off the line"
            if np.isfinite(off)
            else "no roller named first"
        )
        rows.append(
            Claim(
                "dropbear-moving-support",
                f"rest {k + 1} of 6, all effects",
                found_text(said),
                f"roller at {volts[k]:.3f} V: {1e3 * np.polyval(line, volts[k]):.1f} mm on "
                "the line",
                bool(off <= truth["within"]),
                *held_out(said),
                said["time"],
                note,
            )
        )
    inside = sum(bool(r.right) for r in rows)
    rows.append(
        Claim(
            "dropbear-moving-support",
            "straight line, stiffness free at each rest",
            f"{1e3 * line[0]:.1f} mm/V, {inside} of 6 within 2 mm",
            "a straight line; 56.3 mm/V for a rigid pin (README)",
            inside == 6,
            None,
            None,
            None,
        )
    )
    common = float(
        np.median([said["findings"][0]["parameters"]["k"] for said in out if roller_named(said)])
    )
    return rows + [one_stiffness(truth, volts, k) for k in (common, 1e10)]


def one_stiffness(truth: dict[str, Any], volts: np.ndarray, k: float) -> Claim:
    """A second step: the roller as an element of one stiffness at all rests, placed by the first
    frequency alone; the second one is held out."""
    x, before, after = [], [], []
    for place in range(6):
        problem = PROBLEMS / "dropbear-moving-support" / f"problem_diagnose_place_{place + 1}.toml"
        text, nodes = whole(problem), load_problem(problem).model.nodes
        first, second = load_rows(problem)
        tried = nodes[10:80:4]
        spring = (
            '[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{{ id = 999, nodes = [{}], '
            'k = {:.6g}, group = "roller" }}]\n\n[[model.supports]]'
        )
        f = np.array(
            [
                frequencies(text.replace("[[model.supports]]", spring.format(n.id, k), 1), 2)
                for n in tried
            ]
        )
        x.append(float(np.interp(first, f[:, 0], [n.x for n in tried])))
        after.append(float(np.interp(first, f[:, 0], f[:, 1])) / second - 1.0)
        before.append(frequencies(text, 2)[1] / second - 1.0)
    line = robust_line(volts, np.array(x))
    off = np.abs(np.array(x) - np.polyval(line, volts))
    inside = int(np.sum(off <= truth["within"]))
    return Claim(
        "dropbear-moving-support",
        f"straight line, placed by the first frequency with {k:.2g} N/m at every rest",
        f"{1e3 * line[0]:.1f} mm/V, {inside} of 6 within 2 mm; off by "
        + ", ".join(f"{1e3 * v:.1f}" for v in off)
        + " mm",
        "a straight line; 56.3 mm/V for a rigid pin (README)",
        inside == 6,
        rms(before),
        rms(after),
        None,
        "held out: the second frequencies",
    )


def load_rows(problem: Path) -> tuple[float, float]:
    """The two fitted frequencies of a rest (Hz)."""
    (fitted,) = (
        t for t in open_problem(problem)[2] if isinstance(t, ModeTable) and t.origin.use == "fit"
    )
    return float(fitted.frequency[0]), float(fitted.frequency[1])


def rms(values: Sequence[float] | np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def roller_named(said: dict[str, Any]) -> bool:
    """Whether a spring to ground in z comes first."""
    return (
        bool(said["findings"])
        and said["findings"][0]["physics"] == "grounding_spring"
        and said["findings"][0]["location"].get("dof") == "z"
    )


def ridge(said: dict[str, Any], xs: dict[int, float]) -> list[tuple[float, float, float]]:
    """(place m, stiffness N/m, misfit) of the springs to ground in z that were refitted, along the
    bar."""
    return sorted(
        (xs[c["location"]["nodes"][0]], c["parameters"]["k"], c["misfit"])
        for c in said["candidates"]
        if c["physics"] == "grounding_spring"
        and c["location"].get("dof") == "z"
        and c.get("misfit") is not None
        and c.get("effect", 1) == 1
    )


def between_nodes(springs: Sequence[tuple[float, float, float]]) -> float:
    """Vertex of the parabola through the misfits of the best place and its neighbours, where all
    three were refitted; else the best place (m)."""
    k = int(np.argmin([m for _, _, m in springs]))
    if not 0 < k < len(springs) - 1:
        return springs[k][0]
    (x0, _, a), (x1, _, b), (x2, _, c) = springs[k - 1 : k + 2]
    if not np.isclose(x1 - x0, x2 - x1, rtol=0.01) or x2 - x1 > 0.004:
        return x1
    return x1 + 0.5 * (a - c) / (a - 2 * b + c) * (x2 - x1)


def robust_line(v: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Slope and offset: median of all pairs' slopes, median of what is left (Theil and Sen), so
    that one place that is off does not bend the line."""
    v, x = v[np.isfinite(x)], x[np.isfinite(x)]
    if len(x) < 3:
        return float("nan"), float("nan")
    i, j = np.triu_indices(len(v), 1)
    slope = float(np.median((x[j] - x[i]) / (v[j] - v[i])))
    return slope, float(np.median(x - slope * v))


def six_masses(truth: dict[str, Any], everything: bool) -> list[Claim]:
    """Healthy: what the drawing misses; the clamp calibrated; then which mass went, layout by
    layout, and how much."""
    folder = PROBLEMS / "beam-six-masses-frf"
    said = said_of(folder / "problem_diagnose_healthy.toml")
    rows = [
        Claim(
            "beam-six-masses-frf",
            "healthy, rigidly clamped as drawn",
            found_text(said),
            "not documented",
            None,
            *held_out(said),
            said["time"],
            "what the calibration below adds: a clamp that turns, gives way, and has mass",
        )
    ]
    f, positions = make.layouts()
    rows += mode_five(f, positions)
    by_name = {q.name: q.after for q in run(folder / "problem_calibrate.toml").parameters}
    clamp = make.Clamp(by_name["clamp z.k"], by_name["clamp ry.k"], by_name["clamp mass.m"])
    which = range(70) if everything else range(0, 70, 7)
    for words in (("added_mass",), ()):
        chosen = which if words else range(0, 70, 14)
        rows += layout_rows(truth, f, positions, clamp, chosen, words)
    return rows


def frequencies(text: str, count: int = 5, folder: Path = OUT) -> np.ndarray:
    """The model frequencies (Hz) of a problem file's text."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "asked.toml"
    path.write_text(text, encoding="utf-8")
    return model_modes(open_problem(path)[1], count).frequencies[:count]


def layout_rows(
    truth: dict[str, Any],
    f: np.ndarray,
    positions: np.ndarray,
    clamp: make.Clamp,
    which: Sequence[int],
    words: Sequence[str],
) -> list[Claim]:
    """Statistics over layouts; what the fitted half says is then held against the other half."""
    place = size = first = listed = 0
    times: list[float] = []
    found: list[tuple[int, float, float]] = []
    for k in which:
        healthy = frequencies(make.beam("asked", positions[k], clamp, ASKED))
        measured = (
            f[1, k] * healthy / f[0, k]
            # what the calibrated model still misses of the healthy layout is not to be taken for
            # damage
        )
        path = OUT / f"beam_layout_{k + 1:02d}{'' if words else '_all_words'}.toml"
        path.write_text(make.damaged(k, clamp, measured, positions[k], words), encoding="utf-8")
        said = diagnose(path).to_json()
        times.append(said["time"])
        xs = {n.id: n.x for n in load_problem(path).model.nodes}
        named = [(e["physics"], e["location"]) for e in said["findings"][:1]]
        named += [
            (e["physics"], e["location"]) for x in said["findings"][:1] for e in x["equivalent"]
        ]
        masses = [
            w
            for w, where in named
            if w == "added_mass" and nearest(xs[where["nodes"][0]], positions[k]) == truth["mass"]
        ]
        listed += bool(masses)
        if not named or named[0][0] != "added_mass":
            continue
        first += 1
        m, dm = (said["findings"][0][key]["m"] for key in ("parameters", "standard_deviation"))
        right = nearest(xs[named[0][1]["nodes"][0]], positions[k]) == truth["mass"] and m < 0
        place += right
        size += right and abs(-m - truth["m"]) <= 2 * dm
        if right:
            found.append((k, -m, dm))
    n = len(list(which))
    case = f"{n} layouts, " + ("added_mass asked for" if words else "all effects")
    claimed = (
        f"a mass taken off named first in {first}, nearest to L1 in {place}, size within 2 σ "
        f"in {size} of {n}"
        + (
            f"; mean {1e3 * np.mean([m for _, m, _ in found]):.1f} g, scatter "
            f"{1e3 * np.std([m for _, m, _ in found]):.1f} g"
            if found
            else ""
        )
        + ("" if words else f"; among the equivalents or first in {listed}")
    )
    before, after = across(f, positions, clamp, found) if words and len(found) > 3 else (None, None)
    return [
        Claim(
            "beam-six-masses-frf",
            case,
            claimed,
            f"L1, {1e3 * truth['m']:.1f} g (2.96 % of beam and masses)",
            place >= truth["share"] * n,
            before,
            after,
            max(times, default=None),
            "held out: the mean of odd layouts applied to the even ones, at their own positions"
            if before is not None
            else "",
        )
    ]


def nearest(x: float, positions: np.ndarray) -> int:
    """Which mass is nearest to a place."""
    return int(np.argmin(np.abs(positions - x)))


def across(
    f: np.ndarray,
    positions: np.ndarray,
    clamp: make.Clamp,
    found: Sequence[tuple[int, float, float]],
) -> tuple[float, float]:
    """R.m.s. relative error of the damaged frequencies of the second half of the layouts, without
    and with the mean mass found in the first half."""
    half = len(found) // 2
    taken = float(
        np.average(
            [m for _, m, _ in found[:half]], weights=[1.0 / dm**2 for _, _, dm in found[:half]]
        )
    )
    before, after = [], []
    for k, _, _ in found[half:]:
        healthy = frequencies(make.beam("asked", positions[k], clamp, ASKED))
        lighter = frequencies(
            make.beam("asked", positions[k], clamp, ASKED, (make.SIX - taken, *(make.SIX,) * 5))
        )
        measured = f[1, k] * healthy / f[0, k]
        before.append(healthy / measured - 1.0)
        after.append(lighter / measured - 1.0)
    return rms(np.concatenate(before)), rms(np.concatenate(after))


VARIANTS = (
    ("rigid clamp, E free", None, ('{ group = "beam", of = "E", lower = -0.6, upper = 0.6 }',)),
    (
        "clamp turns",
        make.Clamp(1e12, 1500.0, 1e-6),
        ('{ group = "clamp ry", of = "k", lower = -0.95, upper = 50.0 }',),
    ),
    (
        "clamp turns, E free",
        make.Clamp(1e12, 1500.0, 1e-6),
        (
            '{ group = "clamp ry", of = "k", lower = -0.95, upper = 50.0 }',
            '{ group = "beam", of = "E", lower = -0.6, upper = 0.6 }',
        ),
    ),
    (
        "clamp turns and gives way",
        make.Clamp(5e6, 1500.0, 1e-6),
        (
            '{ group = "clamp ry", of = "k", lower = -0.95, upper = 50.0 }',
            '{ group = "clamp z", of = "k", lower = -0.95, upper = 50.0 }',
        ),
    ),
    (
        "clamp turns, gives way and has mass",
        make.Clamp(),
        (
            '{ group = "clamp ry", of = "k", lower = -0.95, upper = 50.0 }',
            '{ group = "clamp z", of = "k", lower = -0.95, upper = 50.0 }',
            '{ group = "clamp mass", of = "m", lower = -0.95, upper = 5.0 }',
        ),
    ),
)


def mode_five(f: np.ndarray, positions: np.ndarray) -> list[Claim]:
    """What the fifth mode's gap is: variants of the clamp calibrated on the healthy medians, then
    asked for the damaged medians with mass L1 gone."""
    rows, where = make.medians(f[0], positions)
    damaged = np.median(f[1], axis=0)
    out = []
    for name, clamp, parameters in VARIANTS:
        path = OUT / "variant.toml"
        OUT.mkdir(parents=True, exist_ok=True)
        update = (
            '\n[update]\nmethod = "frequencies"\nparameters = [\n'
            + "".join(f"  {p},\n" for p in parameters)
            + "]\n"
        )
        path.write_text(
            make.beam(name, where, clamp, make.mode_rows(rows, "fit", "medians"), tail=update),
            encoding="utf-8",
        )
        begin = time.perf_counter()
        updated = run(path)
        values = {q.name: q.after for q in updated.parameters}
        held = clamp and make.Clamp(
            values.get("clamp z.k", clamp.kz),
            values.get("clamp ry.k", clamp.kr),
            values.get("clamp mass.m", clamp.mass),
        )
        texts = [
            make.beam("asked", where, held, ASKED, masses).replace(
                "E = 200e9", f"E = {values.get('beam.E', 200e9):.8g}"
            )
            for masses in ((make.SIX,) * 6, (1e-9, *(make.SIX,) * 5))
        ]
        healthy, gone = (frequencies(text) for text in texts)
        left, aside = (
            100.0 * (model / measured - 1.0)
            for model, measured in ((healthy, np.array([r[1] for r in rows])), (gone, damaged))
        )
        out.append(
            Claim(
                "beam-six-masses-frf",
                f"mode 5 gap: {name} ({len(parameters)} parameters)",
                f"healthy medians left at {', '.join(f'{v:+.1f}' for v in left)} %; L1 gone, "
                f"held out: {', '.join(f'{v:+.1f}' for v in aside)} %",
                "not documented",
                None,
                None,
                rms(aside / 100.0),
                time.perf_counter() - begin,
                "calibrated with `run` on five frequencies",
            )
        )
    return out


RIG = (
    "added_mass",
    "attached_resonator",
    "grounding_spring",
)  # what may well be missing: the body at the tip, the second resonance, the clamp


def tip_masses(truth: dict[str, Any], everything: bool) -> list[Claim]:
    """The tip mass that the model leaves out, from one hammer test: all effects, then what the
    rig suggests."""
    rows = []
    for words in ((), RIG):
        for name in ("massa1", "massa3", "massa4"):
            problem = PROBLEMS / "unb-cantilever-tip-mass" / f"problem_diagnose_{name}.toml"
            if words:
                OUT.mkdir(parents=True, exist_ok=True)
                text = whole(problem) + make.only(words)
                problem = OUT / f"unb_{name}.toml"
                problem.write_text(text, encoding="utf-8")
            said = said_of(problem)
            first = next((f for f in said["findings"] if f["physics"] == "added_mass"), None)
            near = first is not None and first["location"]["nodes"][0] >= truth["node"] - 2
            right = bool(
                near
                and first is not None
                and abs(first["parameters"]["m"] / truth[name] - 1.0) <= truth["within"]
            )
            tried = [
                c
                for c in said["candidates"]
                if c.get("misfit") is not None and c["physics"] == "added_mass"
            ]
            best = min(tried, key=lambda c: c["misfit"], default=None)
            note = ""
            if best is not None:
                m = best["parameters"]["m"]
                note = (
                    f"nearest added mass: {m:.4g} kg ({100 * (m / truth[name] - 1):+.1f} %) at "
                    f"node {best['location']['nodes'][0]} of 21"
                )
            if "graded" in said:
                note = f"{said['graded']['says']} {note}".rstrip()
            rows.append(
                Claim(
                    "unb-cantilever-tip-mass",
                    f"{name}, hammer FRF, {'effects of the rig' if words else 'all effects'}",
                    found_text(said),
                    f"{truth[name]} kg at the tip (weighed)",
                    right,
                    *held_out(said),
                    said["time"],
                    note,
                )
            )
    return rows


def frame(truth: dict[str, Any], everything: bool) -> list[Claim]:
    """Tests 2 and 3 against the model of test 1; and what clamped legs miss."""
    folder = PROBLEMS / "cristallo-3storey-frame"
    rows = []
    for k in (2, 3):
        said = said_of(folder / f"problem_diagnose_test_{k}.toml")
        rows.append(
            Claim(
                "cristallo-3storey-frame",
                f"test {k} against the model calibrated on test 1",
                found_text(said),
                "nothing was changed",
                said["verdict"] == truth["repeats"],
                *held_out(said),
                said["time"],
            )
        )
    said = said_of(folder / "problem_diagnose_clamped.toml")
    rows.append(
        Claim(
            "cristallo-3storey-frame",
            "clamped legs against test 1",
            found_text(said),
            "8 to 12 % too stiff (README); cause unknown",
            None,
            *held_out(said),
            said["time"],
        )
    )
    storeys = run(folder / "problem_calibrate.toml").parameters
    change = ", ".join(f"{q.name} {100 * (q.after / q.before - 1):+.0f} %" for q in storeys)
    rows.append(
        Claim(
            "cristallo-3storey-frame",
            "what `run` makes of it",
            change,
            "not known",
            None,
            None,
            None,
            None,
            "the three storeys give way by different amounts, the lowest and the highest "
            "most: joints, not the legs' modulus alone",
        )
    )
    return rows


def modal_tables(truth: dict[str, Any], everything: bool) -> list[Claim]:
    """Published tables of modes: nothing was changed on purpose, the true stiffness is not
    known."""
    rows = []
    for file, name in (
        ("problem_footbridge.toml", "steel footbridge, 946 DOFs"),
        ("problem_four_storey.toml", "four-storey frame, floors weighed"),
    ):
        said = said_of(PROBLEMS / "smu-modal-data" / file)
        rows.append(
            Claim(
                "smu-modal-data",
                name,
                found_text(said),
                "not known",
                None,
                *held_out(said),
                said["time"],
                "nothing held out: five modes, or four",
            )
        )
    return rows


SETS: dict[str, tuple[str, Callable[[dict[str, Any], bool], list[Claim]]]] = {
    "dropbear-moving-support": ("roller", roller),
    "beam-six-masses-frf": ("six_masses", six_masses),
    "unb-cantilever-tip-mass": ("tip_masses", tip_masses),
    "cristallo-3storey-frame": ("frame", frame),
    "smu-modal-data": ("footbridge", modal_tables),
    "silverbox": ("silverbox", laws.silverbox),
    "friction-damper-backlash": ("damper", laws.damper),
}


def claims(everything: bool = False, wanted: Sequence[str] = ()) -> list[Claim]:
    """Every claim on the data sets that are there. No diagnosis gets anything of truth.toml; it is
    compared afterwards."""
    root = table.data_root()
    known = tomllib.loads((PROBLEMS / "truth.toml").read_text(encoding="utf-8"))
    return [
        c
        for name, (key, make_rows) in SETS.items()
        if root is not None and (root / name).is_dir() and (not wanted or name in wanted)
        for c in make_rows(known[key], everything)
    ]


def short(value: float | None) -> str:
    """Percent with three digits."""
    return "–" if value is None else f"{100.0 * value:.3g} %"


def markdown(rows: Sequence[Claim]) -> str:
    """The table."""
    lines = [
        "| data set | case | the tool says | known | right | held out: before | after | s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for c in rows:
        right = {True: "yes", False: "**no**", None: "–"}[c.right]
        note = f" ({c.note})" if c.note else ""
        lines.append(
            f"| {c.data} | {c.case} | {c.claimed}{note} | {c.truth} | {right} | "
            f"{short(c.before)} | {short(c.after)} | "
            f"{'–' if c.time is None else f'{c.time:.0f}'} |"
        )
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str]) -> int:
    """Print the table."""
    if table.data_root() is None:
        print(
            "CVXUPDATE_DATA does not name a folder: put the data sets there (README.md says "
            "where they are published).",
            file=sys.stderr,
        )
        return 2
    rows = claims("--all" in arguments, [a for a in arguments if not a.startswith("--")])
    OUT.mkdir(parents=True, exist_ok=True)
    text = markdown(rows)
    (OUT / "claims.md").write_text(text, encoding="utf-8")
    (OUT / "claims.json").write_text(
        json.dumps([asdict(c) for c in rows], indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

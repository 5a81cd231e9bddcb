"""A case as files: ``problem.toml``, recordings, ``truth.toml``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.motions.cases import Case, Run, draw
from validation.motions.march import Marched, march
from validation.motions.visible import margin
from validation.rigs.files import model_text, table_text, toml, truth_table

Real = NDArray[np.float64]
MILDER = 4  # times that the level of all runs is halved at most


def make(seed: int, folder: Path) -> Case:
    """Draw, march and write the case of a seed. Of one whose springs soften until nothing holds it
    the tests are made at half the level, as a laboratory would."""
    case = draw(seed)
    for _ in range(MILDER):
        try:
            write(case, folder)
            return case
        except FloatingPointError:
            runs = tuple(replace(r, force=0.5 * r.force) for r in case.runs)
            case = replace(case, runs=runs)
    write(case, folder)
    return case


def marched(case: Case) -> list[Marched]:
    """Every run on the bench."""
    return [
        march(case.bench, case.laws, case.push, r.force, case.drive.fine, case.change(r))
        for r in case.runs
    ]


def sensed(case: Case, motion: Marched) -> Real:
    """What the sensors see, without noise (samples, sensors)."""
    rows = np.array([case.modal.structure.at(*s) for s in case.plain.sensors]) @ case.bench.basis
    which = {"displacement": motion.eta, "velocity": motion.rate, "acceleration": motion.second}
    heard = which[case.quantity] @ rows.T * np.array(case.plain.gains)
    return np.asarray(case.drive.recorded(heard))


def write(case: Case, folder: Path) -> None:
    """The whole folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([20261125, case.seed])
    runs = marched(case)
    clean = [sensed(case, m) for m in runs]
    quietest = min(range(len(clean)), key=lambda k: float(np.std(clean[k])))
    noise = case.noise * np.std(clean[quietest], axis=0)
    lines = model_text(case.plain.drawing, case.seed, folder)
    for k, (run, values) in enumerate(zip(case.runs, clean, strict=True)):
        heard = values + noise * rng.standard_normal(values.shape)
        force = case.drive.recorded(run.force)
        force = force + 1e-3 * np.std(force) * rng.standard_normal(len(force))
        name = f"run{k + 1}.npz"
        np.savez(folder / name, data=np.column_stack([force, heard]))
        lines += _recording(case, run, name)
    (folder / "problem.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = truth_text(case, runs, clean, noise)
    (folder / "truth.toml").write_text("\n".join(text) + "\n", encoding="utf-8")


def _recording(case: Case, run: Run, name: str) -> list[str]:
    node, dof = case.plain.drives[0]
    channels: list[dict[str, Any]] = [{"column": 0, "quantity": "force", "node": node, "dof": dof}]
    channels += [
        {"column": i + 1, "quantity": case.quantity, "node": n, "dof": k}
        for i, (n, k) in enumerate(case.plain.sensors)
    ]
    keys = {
        "kind": "time",
        "use": run.use,
        "level": run.level,
        "file": name,
        "response": case.quantity,
        "rate": case.drive.rate,
        "channels": channels,
    }
    return table_text("[recordings]", keys)


def truth_text(case: Case, runs: list[Marched], clean: list[Real], noise: Real) -> list[str]:
    """What is concealed and whether it can be seen; materials and sensors, so that naming them is
    no error."""
    d, drifts = case.plain.drawing, bool(case.moving)
    verdicts = ["undetermined"] if drifts else ["consistent"]
    if case.truths:
        verdicts = sorted({v for t in case.truths for v in t.verdicts})
    out = [
        f"accept = {toml(verdicts)}",
        f"laboratory = {toml('motions')}",
        f"family = {toml(d.family)}",
        f"recording = {toml(case.what)}",
        f"drift = {toml(drifts)}",
        f"drive = {toml(case.drive.kind)}",
        f"sudden = {toml(case.drive.sudden)}",
        "",
    ]
    for i, t in enumerate(case.truths):
        size = margin(case, i, runs, clean, noise)
        out += truth_table("findings", t, {"margin": float(f"{size:.3g}"), "visible": size >= 1.0})
    for name, (k, m) in case.plain.scatter.items():
        values = {"group": name, "stiffness": round(k, 5), "mass": round(m, 5)}
        out += table_text("[scatter]", values)
    for (node, dof), gain in zip(case.plain.sensors, case.plain.gains, strict=True):
        out += table_text("[sensors]", {"node": node, "dof": dof, "gain": round(gain, 5)})
    out += table_text("groups", d.groups())
    f = case.modal.omega / (2.0 * np.pi)
    changes = [[round(r.start, 5), round(r.end, 5)] for r in case.runs]
    return [
        *out,
        *table_text(
            "bench",
            {
                "noise": float(f"{case.noise:.3g}"),
                "band": [float(f"{x:.5g}") for x in (case.plain.low, case.plain.top)],
                "frequencies": [float(f"{x:.6g}") for x in f[f < case.plain.top]],
                "levels": [r.level for r in case.runs],
                "changes": changes if drifts else [],
                "moving": list(case.moving),
            },
        ),
    ]

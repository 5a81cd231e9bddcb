"""A case as files: ``problem.toml``, ``reference.toml``, recordings, ``truth.toml``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from validation.rigs.cases import Case, laboratory_of
from validation.rigs.drawing import Drawing, Generator
from validation.rigs.effects import Truth
from validation.rigs.recordings import frf, table
from validation.rigs.visible import margin

REFERENCE, CHANGED = "reference", "today"
DRIFT = 0.01  # of the force channel from one day to another


def toml(value: Any) -> str:
    """A value as TOML text on one line."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value + '"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return repr(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def _key(name: str) -> str:
    return name if name.isidentifier() else f'"{name}"'


def table_text(name: str, values: Mapping[str, Any]) -> list[str]:
    """A table, one key a line."""
    return [f"[{name}]", *(f"{_key(k)} = {toml(v)}" for k, v in values.items()), ""]


def write(case: Case, folder: Path) -> None:
    """The whole folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([20261123, case.seed])
    model = model_text(case.drawing, case.seed, folder)
    today = recordings_text(rng, case, folder, None)
    (folder / "problem.toml").write_text("\n".join([*model, *today]) + "\n", encoding="utf-8")
    if laboratory_of(case.seed) == "rigs":
        both = [
            line for s in (REFERENCE, CHANGED) for line in recordings_text(rng, case, folder, s)
        ]
        (folder / "reference.toml").write_text("\n".join([*model, *both]) + "\n", encoding="utf-8")
    (folder / "truth.toml").write_text("\n".join(truth_text(case)) + "\n", encoding="utf-8")


# -------------------------------------------------------------------------------------------- model


def model_text(d: Drawing, seed: int, folder: Path) -> list[str]:
    """The [model] table, as a stranger writes it from docs/problem-files.md."""
    out = [
        f'title = "{d.family.capitalize()}, test {seed}"',
        'source = "drawing values"',
        "",
        "[model]",
        f"dofs = {toml(d.dofs)}",
    ]
    if seed % 4 < 2:
        rows = [f"{n},{x:.6g},{y:.6g},{z:.6g}" for n, (x, y, z) in d.nodes.items()]
        (folder / "nodes.csv").write_text("\n".join(["id,x,y,z", *rows]) + "\n", encoding="utf-8")
        out += ['nodes = { file = "nodes.csv" }', ""]
    else:
        nodes = [{"id": n, "x": x, "y": y, "z": z} for n, (x, y, z) in d.nodes.items()]
        out += ["nodes = [", *(f"  {toml(n)}," for n in nodes), "]", ""]
    if d.E:
        out += table_text("model.materials.metal", {"E": d.E, "nu": d.nu, "rho": d.rho})
    for name, section in d.sections.items():
        out += table_text(f"model.sections.{name}", section.shape)
    if d.plate is not None:
        out += table_text("model.sections.plate", {"shape": "plate", "thickness": d.plate.h})
    out += _elements(d)
    supports: dict[tuple[str, ...], list[int]] = {}
    for node in d.feet:
        supports.setdefault(tuple(k for n, k in d.held if n == node), []).append(node)
    for dofs, feet in supports.items():
        out += ["[[model.supports]]", f"nodes = {toml(feet)}", f"dofs = {toml(dofs)}", ""]
    eta = 0.012 if d.family != "chain" else 0.024
    return [*out, *table_text("model.damping", {"kind": "structural", "eta": eta})]


def _elements(d: Drawing) -> list[str]:
    out: list[str] = []

    def block(keys: Mapping[str, Any], rows: list[dict[str, Any]]) -> None:
        if rows:
            out.append("[[model.elements]]")
            out.extend(f"{k} = {toml(v)}" for k, v in keys.items())
            out.extend(["rows = [", *(f"  {toml(r)}," for r in rows), "]", ""])

    kind = "beam2d" if d.dofs == ("x", "y", "rz") else "beam3d"
    for name in d.sections:
        keys: dict[str, Any] = {"type": kind, "material": "metal", "section": name}
        if not d.rotary:
            keys["rotary_inertia"] = False
        lines = [e for e in d.lines if e.section == name]
        block(keys, [{"id": e.id, "nodes": e.nodes, "group": e.group} for e in lines])
    if d.plate is not None:
        p = d.plate
        block(
            {"type": "plate", "material": "metal", "section": "plate"},
            [
                {"id": p.element(i, j), "nodes": p.corners(i, j), "group": p.groups[i]}
                for j in range(p.ny)
                for i in range(p.nx)
            ],
        )
    block(
        {"type": "spring", "dof": "x"},
        [{"id": s.id, "nodes": s.nodes, "k": s.k, "group": s.group} for s in d.springs],
    )
    block(
        {"type": "mass"},
        [{"id": x.id, "nodes": [x.node], "m": x.m, "group": x.group} for x in d.lumps],
    )
    return out


# --------------------------------------------------------------------------------------- recordings


def recordings_text(rng: Generator, case: Case, folder: Path, state: str | None) -> list[str]:
    """The [[recordings]] tables of one state (None: today's, state not said); files on the way."""
    said = {} if state is None else {"state": state}
    concealed = state != REFERENCE
    name = "" if state is None else f"{state}_"
    if case.kind == "modes":
        return _tables(rng, case, folder, said, name, concealed)
    out: list[str] = []
    gain = case.gain
    if state is not None and gain != 1.0:
        gain *= 1.0 + DRIFT * rng.standard_normal()
    for k, use in enumerate(("fit", "hold-out")):
        m = case.modal(k, concealed)
        arrays = frf(rng, m, case, case.drives[k], gain)
        averages = int(arrays.pop("averages"))
        with (folder / f"{name}frf{k + 1}.npz").open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        keys: dict[str, Any] = {"kind": "frf", "use": use, **said, "file": f"{name}frf{k + 1}.npz"}
        keys |= {"response": "acceleration", "averages": averages}
        out += table_text("[recordings]", keys)
    return out


def _tables(
    rng: Generator,
    case: Case,
    folder: Path,
    said: dict[str, str],
    name: str,
    concealed: bool,
) -> list[str]:
    rows = table(rng, case.modal(0, concealed), case)
    channels = [
        {"column": i, "quantity": "displacement", "node": n, "dof": d}
        for i, (n, d) in enumerate(case.sensors)
    ]
    apart = len(rows) - 1 if case.seed % 5 == 0 and len(rows) > 4 else len(rows)
    out: list[str] = []
    for use, part in (("fit", rows[:apart]), ("hold-out", rows[apart:])):
        if not part:
            continue
        keys: dict[str, Any] = {"kind": "modes", "use": use, **said}
        if case.seed % 4 in (0, 3):
            file = f"{name}modes{'' if use == 'fit' else '_out'}.csv"
            lines = [",".join(part[0])]
            lines += [",".join(_cell(v) for v in r.values()) for r in part]
            (folder / file).write_text("\n".join(lines) + "\n", encoding="utf-8")
            keys["file"] = file
        out += ["[[recordings]]", *(f"{k} = {toml(v)}" for k, v in keys.items())]
        if "file" not in keys:
            out += ["rows = [", *(f"  {toml(r)}," for r in part), "]"]
        out += ["channels = [", *(f"  {toml(c)}," for c in channels), "]", ""]
    return out


def _cell(value: Any) -> str:
    return " ".join(map(repr, value)) if isinstance(value, list) else repr(value)


# -------------------------------------------------------------------------------------------- truth


def truth_text(case: Case) -> list[str]:
    """``truth.toml``: what is concealed and whether it can be seen, the rig, and what else is true
    (materials, sensors), so that naming it is no error."""
    d = case.drawing
    verdicts = ["consistent"]
    if case.concealed:
        verdicts = sorted({v for t in case.concealed for v in t.verdicts})
    elif case.rig:
        verdicts = ["missing_physics", "parameter_error", "undetermined"]
    elif case.shear:
        verdicts = ["consistent", "missing_physics"]
    out = [
        f"accept = {toml(verdicts)}",
        f"laboratory = {toml(laboratory_of(case.seed))}",
        f"family = {toml(d.family)}",
        f"recording = {toml(case.kind)}",
        "",
    ]
    for i, t in enumerate(case.concealed):
        size = margin(case, i)
        more = {"margin": float(f"{size:.3g}"), "visible": size >= 1.0}
        out += truth_table("findings", t, more)
    for t in case.rig:
        out += truth_table("rig", t, {})
    for t in case.hidden:
        out += truth_table("besides", t, {})
    for name, (k, m) in case.scatter.items():
        values = {"group": name, "stiffness": round(k, 5), "mass": round(m, 5)}
        out += table_text("[scatter]", values)
    for (node, dof), gain in zip(case.sensors, case.gains, strict=True):
        out += table_text("[sensors]", {"node": node, "dof": dof, "gain": round(gain, 5)})
    out += table_text("groups", d.groups())
    f = case.modal().damped(case.sensors, case.top)[0]
    low, high = float(f"{case.low:.5g}"), float(f"{case.top:.5g}")
    return [
        *out,
        *table_text(
            "bench",
            {
                "noise": float(f"{case.noise:.3g}"),
                "spread": float(f"{case.spread:.3g}"),
                "band": [low, high],
                "frequencies": [float(f"{x:.6g}") for x in f[f > case.low]],
                "shear": case.shear,
                "rotary": case.rotary,
            },
        ),
    ]


def truth_table(name: str, t: Truth, more: Mapping[str, Any]) -> list[str]:
    """An effect as a table of truth.toml."""
    parameters = [{"name": n, "value": v, "within": float(f"{w:.4g}")} for n, v, w in t.parameters]
    values: dict[str, Any] = {"physics": t.physics, "location": t.location}
    values |= {"parameters": parameters, "near": t.near, "also": list(t.also), **more}
    return table_text(f"[{name}]", values)

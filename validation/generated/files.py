"""A case as files: ``problem.toml``, recordings, ``truth.toml``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from validation.generated.cases import Case
from validation.generated.drawings import Generator, figures
from validation.generated.laboratory import Design, Element, Modal, build, modal
from validation.generated.recordings import frf, history, table
from validation.generated.visible import visibility

UNITS = {
    "m": "kg",
    "k": "N/m",
    "c": "N*s/m",
    "N": "N",
    "alpha": "1/s",
    "delay": "s",
    "omega": "rad/s",
}


def toml(value: Any) -> str:
    """A value as TOML text on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace('"', "'") + '"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return repr(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def model_text(design: Design) -> list[str]:
    """The [model] table."""
    out = ["[model]", f"dofs = {toml(design.dofs)}", "nodes = ["]
    out += [
        f"  {toml({'id': n, 'x': x, 'y': y, 'z': z})}," for n, (x, y, z) in design.nodes.items()
    ] + ["]", ""]
    if design.family != "chain":
        out += [
            "[model.materials.metal]",
            f"E = {toml(design.E)}",
            f"nu = {toml(design.nu)}",
            f"rho = {toml(design.rho)}",
            "",
            "[model.sections.main]",
        ]
        out += {
            1: {
                "plate": ['shape = "plate"', f"thickness = {toml(design.section[0])}", ""],
                "rotor": ['shape = "circle"', f"diameter = {toml(design.section[0])}", ""],
            }.get(design.family, []),
            2: [
                'shape = "rectangle"',
                f"width = {toml(design.section[0])}",
                f"height = {toml(design.section[-1])}",
                "",
            ],
        }[len(design.section)]
    words = {
        "shaft": "beam3d",
        "bar": "beam2d" if design.family == "frame" else "beam3d",
        "rod": "rod",
        "plate": "plate",
        "spring": "spring",
        "mass": "mass",
    }
    for kind in dict.fromkeys(e.kind for e in design.elements):
        out += ["[[model.elements]]", f'type = "{words[kind]}"']
        if kind in ("bar", "shaft", "rod", "plate"):
            out += ['mass = "consistent"', 'material = "metal"', 'section = "main"']
        out += ['dof = "x"'] if kind == "spring" and design.family == "chain" else []
        rows = [_row(e, design.family) for e in design.elements if e.kind == kind]
        out += ["rows = [", *(f"  {toml(r)}," for r in rows), "]", ""]
    supports: dict[tuple[str, ...], list[int]] = {}
    for node in dict.fromkeys(n for n, _ in design.held):
        supports.setdefault(tuple(d for n, d in design.held if n == node), []).append(node)
    for dofs, nodes in supports.items():
        out += ["[[model.supports]]", f"nodes = {toml(nodes)}", f"dofs = {toml(dofs)}", ""]
    return [*out, "[model.damping]", 'kind = "structural"', f"eta = {toml(design.eta)}", ""]


def _row(e: Element, family: str) -> dict[str, Any]:
    own: dict[str, Any] = {}
    if e.kind == "spring":
        own = {"k": e.value} if family == "chain" else {"k": e.value, "dof": e.dof}
    elif e.kind == "mass":
        own = {"m": e.value, **dict(zip(("Ixx", "Iyy", "Izz"), e.inertia or (), strict=False))}
    return {"id": e.id, "nodes": list(e.nodes), **own, "group": e.group}


def write(case: Case, folder: Path) -> None:
    """The whole folder: problem.toml, recordings, truth.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([20261122, case.seed])
    m = modal(build(case.design, case.scatter, case.effects), case.top, case.zeta)
    out = [
        f'title = "Generated problem {case.seed}"',
        'source = "problems/generate.py: nominal drawing values"',
        "",
        *model_text(case.design),
    ]
    out += recordings_text(rng, m, case, folder)
    (folder / "problem.toml").write_text("\n".join(out) + "\n", encoding="utf-8")
    (folder / "truth.toml").write_text("\n".join(truth_text(case, m)) + "\n", encoding="utf-8")


def recordings_text(rng: Generator, m: Modal, case: Case, folder: Path) -> list[str]:
    """The [[recordings]] tables; their files are written on the way."""
    out: list[str] = []
    if case.kind == "modes":
        rows = table(rng, m, case)
        keep = (
            int(rng.integers(max(1, len(rows) - 3), len(rows))) if len(rows) > 3 else len(rows) - 1
        )
        channels = [
            {"column": i, "quantity": "displacement", "node": n, "dof": d}
            for i, (n, d) in enumerate(case.sensors)
        ]
        for use, part in (
            ("fit", [r for i, r in enumerate(rows) if i != keep]),
            ("hold-out", [rows[keep]]),
        ):
            out += [
                "[[recordings]]",
                'kind = "modes"',
                f'use = "{use}"',
                'response = "displacement"',
            ]
            out += [
                "rows = [",
                *(f"  {toml(r)}," for r in part),
                "]",
                "channels = [",
                *(f"  {toml(c)}," for c in channels),
                "]",
                "",
            ]
        return out
    uses = (
        ("fit", "fit", "hold-out")
        if case.kind == "time" or rng.random() < 0.3
        else ("fit", "hold-out")
    )
    for k, use in enumerate(uses):
        drive = case.drives[1] if use == "hold-out" else case.drives[0]
        name = f"{'run' if case.kind == 'time' else 'frf'}{k + 1}"
        out += ["[[recordings]]", f'kind = "{case.kind}"', f'use = "{use}"']
        if case.kind == "frf":
            arrays = frf(rng, m, case, drive)
            averages = int(arrays.pop("averages"))
            np.savez(folder / f"{name}.npz", **arrays)
            out += [
                f'file = "{name}.npz"',
                'response = "acceleration"',
                f"averages = {averages}",
                "",
            ]
            continue
        data, rate = history(rng, m, case, drive)
        channels = [{"column": 0, "quantity": "force", "node": drive[0], "dof": drive[1]}]
        channels += [
            {"column": i + 1, "quantity": "acceleration", "node": n, "dof": d}
            for i, (n, d) in enumerate(case.sensors)
        ]
        if case.seed % 4 == 1:
            header = ",".join(f"channel {i}" for i in range(data.shape[1]))
            np.savetxt(
                folder / f"{name}.csv", data, fmt="%.6g", delimiter=",", header=header, comments=""
            )
        else:
            np.savez(folder / f"{name}.npz", data=data)
        out += [
            f'file = "{name}.{"csv" if case.seed % 4 == 1 else "npz"}"',
            'response = "acceleration"',
            f"rate = {toml(rate)}",
            "channels = [",
            *(f"  {toml(c)}," for c in channels),
            "]",
            "",
        ]
    return out


def truth_text(case: Case, m: Modal, here: Modal | None = None) -> list[str]:
    """``truth.toml`` in the form of problems/concealed, with how strongly the effect can be seen;
    ``here``: the structure in this laboratory, where ``m`` is of another."""
    verdicts: list[str] = ["consistent"]
    if case.findings:
        both = [set(f.verdicts) for f in case.findings]
        verdicts = (
            ["missing_physics"]
            if any("parameter_error" not in v for v in both)
            else [v for v in ("parameter_error", "missing_physics") if all(v in b for b in both)]
        )
    out = [
        f"verdict = {toml(verdicts[0])}",
        f"accept = {toml(verdicts)}",
        f"family = {toml(case.design.family)}",
        f"recording = {toml(case.kind)}",
        "",
    ]
    for f in case.findings:
        out += [
            "[[findings]]",
            f"physics = {toml(f.effect['physics'])}",
            f"location = {toml(f.location)}",
            f"accept = {toml(f.accept)}",
            f"equivalent = {toml(list(f.equivalent))}",
        ]
        for name, value, tolerance in f.parameters:
            out += [
                "[[findings.parameters]]",
                f"name = {toml(name)}",
                f"value = {toml(value)}",
                f"unit = {toml(UNITS.get(name, '1'))}",
                f"tolerance = {toml(tolerance)}",
                "aliases = []",
                "required = true",
            ]
        out.append("")
    seen = [visibility(case, i, here or m) for i in range(len(case.findings))]
    return [
        *out,
        "[laboratory]",
        f"noise = {toml(figures(case.noise))}",
        f"visible = {toml([figures(v, 3) for v, _ in seen])}",
        f"left = {toml([figures(v, 3) for _, v in seen])}",
        f"frequencies = {toml([figures(x, 6) for x in m.damped()[0][:8]])}",
    ]

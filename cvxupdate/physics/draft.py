"""A problem file in the making, and what a diagnosis changed on the elements of the file.

Elements that it added are written by the effects that add them (`EffectType.writers`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Block
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.sections import section_constants
from cvxupdate.spec import Spec
from cvxupdate.spec.write import tables_of

OWN = (
    "k",
    "c",
    "m",
    "Ixx",
    "Iyy",
    "Izz",
    "Ip",
    "omega",
    "N",
    "offset",
)  # properties that are keys of a row
# of a section
DRAWN = ("width", "height", "diameter", "wall", "thickness", "Dx", "Dy", "D1", "Dxy")
CONSTANTS = ("A", "Iy", "Iz", "J")
MADE_OF = ("E", "nu", "G", "rho")


@dataclass
class Draft:
    """The file in the making: its tables, rows and blocks by element number, the last numbers of
    nodes and elements.

    ``known`` (element, property) of the model → (element, key) here; ``split`` label of what
    turns by itself, without its direction → its node; ``loss`` element → the loss factor that the
    file gave it.
    """

    tables: dict[str, Any]
    rows: dict[int, dict[str, Any]]
    blocks: dict[int, dict[str, Any]]
    node: int
    element: int
    known: dict[tuple[int, str], tuple[int, str]] = field(default_factory=dict)
    split: dict[str, int] = field(default_factory=dict)
    loss: dict[int, float] = field(default_factory=dict)

    @property
    def model(self) -> dict[str, Any]:
        """[model]."""
        part: dict[str, Any] = self.tables["model"]
        return part

    def fresh_node(self, like: int) -> int:
        """A further node where node ``like`` is."""
        self.node += 1
        at = next((n for n in self.model.get("nodes", ()) if n["id"] == like), None)
        self.model.setdefault("nodes", []).append({**(at or {"x": 0.0}), "id": self.node})
        return self.node

    def fresh_element(self) -> int:
        """A further element number."""
        self.element += 1
        return self.element

    def put(self, kind: str, row: dict[str, Any]) -> None:
        """A further element."""
        self.model["elements"].append({"type": kind, "rows": [row]})

    def hold(self, node: int, dofs: Sequence[str]) -> None:
        """A further support."""
        if dofs:
            self.model.setdefault("supports", []).append({"nodes": [node], "dofs": list(dofs)})

    def held(self, node: int, kind: str) -> bool:
        """Whether a support holds a DOF."""
        return any(
            kind in s["dofs"] and (s["nodes"] == "all" or node in s["nodes"])
            for s in self.model.get("supports", ())
        )

    def release(self, node: int, dof: str) -> None:
        """The supports without one DOF of one node."""
        out: list[dict[str, Any]] = []
        for support in self.model["supports"]:
            every = support["nodes"] == "all"
            nodes = [n["id"] for n in self.model["nodes"]] if every else support["nodes"]
            if node not in nodes or dof not in support["dofs"]:
                out.append(support)
                continue
            others, kept = [n for n in nodes if n != node], [k for k in support["dofs"] if k != dof]
            out += [{"nodes": others, "dofs": support["dofs"]}] if others else []
            out += [{"nodes": [node], "dofs": kept}] if kept else []
        self.model["supports"] = out
        if not out:
            del self.model["supports"]

    def end(self, model: Model, dof: int) -> int:
        """The node of a DOF here: one of its own for what turns by itself, tied to that where it
        stands in all else."""
        node, name = node_of(model, dof), model.labels[dof].split(".")[0]
        if "@" not in name:
            return node
        if name not in self.split:
            self.split[name] = self.fresh_node(node)
            own = [d for d, label in enumerate(model.labels) if label.split(".")[0] == name]
            turning = {kind_of(model, d) for d in own}
            tied = [k for k in self.model["dofs"] if k not in turning]
            if tied:
                tie = {"nodes": [node, self.split[name]], "dofs": tied}
                self.model.setdefault("ties", []).append(tie)
        return self.split[name]

    def fresh_group(self, what: str, node: int) -> str:
        """A group of its own."""
        used = {row.get("group") for block in self.model["elements"] for row in block["rows"]}
        name, number = f"{what} at node {node}", 2
        while name in used:
            name, number = f"{what} at node {node} ({number})", number + 1
        return name


Writer = Callable[[Draft, Model, Block, int, Mapping[str, float]], None]
"""Writes element number e of a block with its property values as rows of a draft."""


def draft_of(spec: Spec, model: Model) -> Draft:
    """The file as it was read; fresh numbers begin above those of ``model`` too."""
    tables = tables_of(spec)
    rows = {row["id"]: row for block in tables["model"]["elements"] for row in block["rows"]}
    blocks = {row["id"]: block for block in tables["model"]["elements"] for row in block["rows"]}
    top = max([int(b.ids.max(initial=0)) for b in model.blocks] + list(rows))
    return Draft(tables, rows, blocks, max(int(model.node_ids.max()), 0), top)


def node_of(model: Model, dof: int) -> int:
    """The node number of a free DOF."""
    return int(model.node_ids[model.dof_node[dof]])


def kind_of(model: Model, dof: int) -> str:
    """Its direction, "x" to "rz"."""
    return KINDS[int(model.dof_kind[dof])]


def _own(row: dict[str, Any], number: int, now: Mapping[str, float], moved: set[str]) -> None:
    """Figures of a row; a spring that gives more (`cvxupdate.physics.sprung`) has its k anew."""
    for key in OWN:
        if key in moved:
            row[key] = not_negative(number, key, now[key])
    if "a0" in now:
        if "stiffness" not in moved:
            row.pop("stiffness_factor", None)
        row["k"] = not_negative(number, "k", now["share"] / (now["a0"] + now["a"]))


def change(
    draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float], damped: bool
) -> None:
    """What moved on an element of the file."""
    number = int(block.ids[e])
    row = draft.rows[number]
    was = {k: float(v[e]) for k, v in block.properties.items()}
    moved = {k for k, v in now.items() if v != was[k]}
    matrices = {t.matrix for t in block.terms}
    for word, matrix in (("stiffness", "K"), ("mass", "M")):
        if matrix in matrices and word in moved:
            row[f"{word}_factor"] = now[word]
    if "K" in matrices and damped:
        row.pop("eta", None)
        if now["eta"] != 0.0:
            row["eta"] = now["eta"]
    elif "K" in matrices and "eta" in moved:  # beside what the file says
        row["eta"] = (
            now["eta"] - was["eta"] + draft.loss.setdefault(number, _file_loss(draft, row))
        )  # once, though a spring is a block for each DOF
    if row.get("taken_off") or now.get("m", 0.0) < 0.0:
        moved |= {k for k in ("m", "Ixx", "Iyy", "Izz") if k in now}
        now = {**now, **{k: -now[k] for k in ("m", "Ixx", "Iyy", "Izz") if k in now}}
        row["taken_off"] = True
    _own(row, number, now, moved)
    if "damping" in moved:
        _damping_factor(row, block, number, now)
    if moved & set(MADE_OF):
        material = {k: v for k, v in draft.model["materials"][row["material"]].items() if k != "G"}
        made = {k: now[k] for k in MADE_OF if k in now and (k != "G" or now[k] != 0.0)}
        row["material"] = _variant(draft, "materials", row["material"], {**material, **made})
    if moved & {*DRAWN, *CONSTANTS, "shear", "kappa"}:
        row["section"] = _variant(
            draft,
            "sections",
            row["section"],
            _section(draft.model["sections"][row["section"]], block, e, now, moved),
        )
    if "rotary" in moved:  # a switch of the whole block
        draft.blocks[number]["rotary_inertia"] = now["rotary"] >= 0.5
    for dof in block.dofs[e].tolist():
        if dof >= 0 and f"@e{number}." in model.labels[dof]:
            node, fresh = node_of(model, dof), draft.end(model, dof)
            row["nodes"] = [fresh if n == node else n for n in row["nodes"]]


def _damping_factor(
    row: dict[str, Any], block: Block, number: int, now: Mapping[str, float]
) -> None:
    """The factor on an element's damping; of a dashpot in its c."""
    if block.kind.name == "dashpot":
        row["c"] = not_negative(number, "c", now["c"] * now["damping"])
    else:
        row["damping_factor"] = not_negative(number, "damping_factor", now["damping"])


def _file_loss(draft: Draft, row: Mapping[str, Any]) -> float:
    material = draft.model.get("materials", {}).get(row.get("material"), {})
    return float(
        row.get("eta", material.get("eta", draft.model.get("damping", {}).get("eta", 0.0)))
    )


def not_negative(number: int, key: str, value: float) -> float:
    """The value of a row's key.

    Raises
    ------
    ModelError
        Where it is below zero and must not be.
    """
    if value < 0.0 and key not in ("omega", "N", "offset"):
        raise ModelError(
            f"element {number}: {key} = {value:.4g} is below zero, which a problem file "
            "cannot say. Give it a lower bound."
        )
    return value


def _section(
    section: Mapping[str, Any], block: Block, e: int, now: Mapping[str, float], moved: set[str]
) -> dict[str, Any]:
    out = {**section, **{k: now[k] for k in DRAWN if k in moved}}
    if moved & {"shear", "kappa"}:
        out.pop("kappa", None)
        if now["shear"] > 0.0:
            out["kappa"] = now["kappa"] / now["shear"]  # only their ratio acts
    if moved & set(CONSTANTS) and out["shape"] != "plate":
        shape = getattr(block.kind, "section", None)
        if shape is None:
            raise ModelError(f"element {int(block.ids[e])}: its section has no constants.")
        constants = section_constants(shape, {k: np.array([v]) for k, v in now.items()})
        out = {
            "shape": "general",
            **{k: float(constants[k][0]) for k in CONSTANTS if constants[k][0] > 0.0},
            **{k: v for k, v in out.items() if k == "kappa"},
        }
    return out


def _variant(draft: Draft, what: str, name: str, wanted: dict[str, Any]) -> str:
    """The name of a material or section that is as ``wanted``, made where there is none."""
    known = draft.model[what]
    for other, table in known.items():
        if table == wanted:
            return str(other)
    number = 2
    while f"{name}-{number}" in known:
        number += 1
    known[f"{name}-{number}"] = wanted
    return f"{name}-{number}"

"""A finite-element model in a program: made of arrays or matrices, or opened from a problem."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from cvxupdate.api.arrays import numbers
from cvxupdate.api.blocks import (
    EVERY,
    dofs_needed,
    element_blocks,
    node_rows,
    support_rows,
)
from cvxupdate.api.frf import Frf
from cvxupdate.api.matrices import groups_of, matrix_block
from cvxupdate.api.mesh import mesh_tables
from cvxupdate.api.modes import Modes
from cvxupdate.api.places import places_of
from cvxupdate.api.shared import motion_of
from cvxupdate.api.shown import card
from cvxupdate.api.views import damping_ratios, elements_frame, row_of
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.damping import with_modal_damping
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.spec import Given, Spec, spec_of
from cvxupdate.spec.given import plain
from cvxupdate.spec.write import tables_of, to_toml


class Model:
    """A structure.

    Parameters
    ----------
    nodes : (nodes, 1 to 3) coordinates in m, numbered from 1; or {number: coordinates}; or rows
        (also a DataFrame) with id, x, y, z.
    elements : a list of blocks. Each has ``type`` (spring, mass, beam3d, shell … as in
        docs/problem-files.md), ``nodes`` (elements, nodes of each) and the further keys of the type
        (material, section, k, m, group …), one value for all or one for each element; or ``rows``
        as a problem file has them.
    materials, sections : {name: {E = …, rho = …}}, {name: {shape = "rectangle", …}}.
    supports : {node: "all"} or {node: ["x", "y"]}, or rows with nodes and dofs.
    dofs : the directions that nodes may move in, "x" to "rz"; None: those that the elements need.
    damping : {"kind": "modal", "zeta": 0.01}, {"kind": "rayleigh", …}, {"kind": "structural", …}.
    further : what else [model] may hold, e.g. ties.

    Raises
    ------
    InputError
        With every fault, as `check` says them.
    """

    def __init__(
        self,
        nodes: Any,
        elements: Any,
        *,
        materials: Mapping[str, Any] | None = None,
        sections: Mapping[str, Any] | None = None,
        supports: Any = None,
        dofs: Any = None,
        damping: Mapping[str, Any] | None = None,
        **further: Any,
    ) -> None:
        blocks = element_blocks(elements)
        tables = {
            "dofs": list(plain(dofs, "dofs")) if dofs is not None else dofs_needed(blocks),
            "nodes": node_rows(nodes),
            "materials": materials,
            "sections": sections,
            "elements": blocks,
            "supports": support_rows(supports) or None,
            "damping": damping,
            **further,
        }
        self._open({k: v for k, v in tables.items() if v is not None}, ())

    def _open(self, tables: Mapping[str, Any], keep: tuple[Any, ...]) -> None:
        self._spec = spec_of({"model": tables})
        self._structure = build_model(self._spec)
        self._keep = keep

    @classmethod
    def from_matrices(
        cls,
        K: Any = None,
        M: Any = None,
        C: Any = None,
        D: Any = None,
        *,
        labels: Any = None,
        groups: Mapping[str, Any] | None = None,
        nodes: Any = None,
        damping: Mapping[str, Any] | None = None,
    ) -> Model:
        """A structure of given matrices, dense or sparse, symmetric.

        Parameters
        ----------
        K, M, C, D : stiffness, mass, viscous and structural damping (N, N); a complex K brings D.
        labels : the place of each row, ``"n4.z"`` or ``(4, "z")``; None: row i is n<i>.x.
        groups : the part of each group, which can then be updated and diagnosed by itself:
            {name: K of it}, {name: (K, M)} or {name: {"K": …, "M": …, "labels": …}} of the
            whole size or with labels of its own. What they leave of K, M, C, D stays beside them;
            without K and M they are the whole.
        nodes : coordinates as for `Model`, for drawing.

        Raises
        ------
        InputError
            When sizes or labels do not agree, or a matrix is not symmetric.
        """
        parts = groups_of({"K": K, "M": M, "C": C, "D": D}, labels, groups)
        block, held = matrix_block(parts)
        used = {label.partition(".")[2] for part in parts for label in part.labels}
        tables: dict[str, Any] = {"dofs": [k for k in EVERY if k in used], "elements": [block]}
        more = {"nodes": None if nodes is None else node_rows(nodes), "damping": damping}
        return cls.of_tables(tables | {k: v for k, v in more.items() if v is not None}, held)

    @classmethod
    def from_mesh(
        cls,
        mesh: Any,
        elements: Mapping[str, Any],
        *,
        supports: Mapping[Any, Any] | None = None,
        scale: float = 1.0,
        **further: Any,
    ) -> Model:
        """A structure on a mesh that meshio reads (Gmsh, Abaqus and CalculiX, Nastran …), or has.

        ``elements``: for each named set, "all" for the rest, the keys of its block ({"material":
        "steel", "section": "sheet"}, also ``type``); the set is its group. ``supports``: what a
        named set is held in, "all" or directions. ``scale``: metres to a unit of the mesh.
        ``further``: materials, sections … as for `Model`. Raises `InputError`.
        """
        return cls(**mesh_tables(mesh, elements, supports, scale), **further)

    @classmethod
    def from_problem(cls, problem: Given) -> Model:
        """The model of a problem file, of its text, or of its tables."""
        return cls.of_tables(tables_of(spec_of(problem))["model"])

    @classmethod
    def of_tables(cls, tables: Mapping[str, Any], keep: tuple[Any, ...] = ()) -> Model:
        """From a [model] table; ``keep`` are what its files live by."""
        made = cls.__new__(cls)
        made._open(tables, keep)
        return made

    @property
    def labels(self) -> tuple[str, ...]:
        """The free degrees of freedom, in the order of the matrices' rows."""
        return self._structure.labels

    @cached_property
    def _matrices(self) -> Any:
        return self._structure.matrices()

    @property
    def K(self) -> sp.csc_array:
        """Stiffness (N, N), sparse, over the free DOFs."""
        return self._matrices.K

    @property
    def M(self) -> sp.csc_array:
        """Mass (N, N)."""
        return self._matrices.M

    @cached_property
    def C(self) -> sp.csc_array:
        """Viscous damping (N, N), modal damping included."""
        modal = self._structure.modal_damping
        return with_modal_damping(self._structure, self._matrices).C if modal else self._matrices.C

    @property
    def D(self) -> sp.csc_array:
        """Hysteretic damping (N, N), the stiffness's imaginary part; that of modes included."""
        lossy = self._structure.hysteretic
        return with_modal_damping(self._structure, self._matrices).D if lossy else self._matrices.D

    @property
    def nodes(self) -> dict[int, tuple[float, ...]]:
        """Coordinates in m of every node."""
        ids, xyz = self._structure.node_ids.tolist(), self._structure.xyz.tolist()
        return {int(number): tuple(at) for number, at in zip(ids, xyz, strict=True)}

    @property
    def groups(self) -> dict[str, list[int]]:
        """The elements of each group."""
        out: dict[str, list[int]] = {}
        for block in self._spec.model.elements:
            for row in block.rows:
                if row.group is not None:
                    out.setdefault(row.group, []).append(row.id)
        return out

    @property
    def mass(self) -> float:
        """Total mass in kg."""
        return self._structure.total_mass()

    def modes(self, count: int = 10) -> Modes:
        """The lowest flexible modes, mass-normalised, at every free DOF; with their damping ratios
        where the model is damped (to first order where damping couples them).

        Raises
        ------
        InputError
            When the model is a mechanism, or has no such mode.
        """
        if (wanted := int(numbers(count, "count", 0))) < 1:
            raise InputError(f"count: {count} modes cannot be found. Give at least 1.")
        found = model_modes(self._structure, wanted).flexible()
        if not len(found.eigenvalues):
            raise InputError("the model has no flexible mode.")
        f, shapes = found.frequencies[:wanted], found.shapes[:, :wanted]
        damping = damping_ratios(self._structure, f, shapes, self._matrices)
        return Modes(f, shapes, self.labels, damping=damping)

    def frf(
        self,
        frequencies: Any,
        responses: Any = None,
        references: Any = None,
        quantity: str = "displacement",
        **settings: Any,
    ) -> Frf:
        """Frequency responses at ``frequencies`` (lines,) Hz.

        ``responses`` and ``references`` are places (None: every free DOF; the responses);
        ``settings`` are those of `Frf`.

        Raises
        ------
        InputError
            For a place that is not in the model, or a line on a resonance without damping.
        """
        f = numbers(frequencies, "frequencies", 1)
        every = self.labels if responses is None else responses
        outputs = places_of(every, None, "responses")
        inputs = outputs if references is None else places_of(references, None, "references")
        rows, columns = (
            [row_of(self._structure, p) for p in places] for places in (outputs, inputs)
        )
        motion = motion_of(quantity)
        H = frequency_responses(self._structure, f, np.array(rows), np.array(columns), motion)
        plus = [[f"{p.node}.{p.dof}" for p in places] for places in (outputs, inputs)]
        return Frf(f, H, *plus, quantity=motion, **settings)

    @property
    def spec(self) -> Spec:
        """The model as the rest of the package has it: a problem without recordings."""
        return self._spec

    def table(self) -> dict[str, Any]:
        """The [model] table of a problem file."""
        return dict(tables_of(self._spec)["model"])

    def to_toml(self) -> str:
        """The [model] of a problem file as text; `Problem.save` puts matrices beside it."""
        return to_toml({"model": self.table()})

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of the elements: a row for each, with its type and properties."""
        return elements_frame(self.table()["elements"])

    def plot(self) -> Any:
        """Nodes, elements and supports, as a matplotlib figure; needs coordinates."""
        from cvxupdate.correlate.compare import geometry_of
        from cvxupdate.report.plots import structure_figure

        shown = geometry_of(self._spec, self._structure)
        if shown is None:
            raise InputError("the model has no coordinates to draw. Give nodes.")
        return structure_figure(shown)

    def _facts(self) -> dict[str, str]:
        return {
            "nodes": str(len(self._structure.node_ids)),
            "free DOFs": str(len(self.labels)),
            "elements": str(sum(len(b.rows) for b in self._spec.model.elements)),
            "groups": str(len(self.groups)),
            "mass": f"{self.mass:.6g} kg",
        }

    def __repr__(self) -> str:
        *counts, (_, mass) = self._facts().items()
        return f"Model({', '.join(f'{n} {what}' for what, n in counts)}, {mass})"

    def _repr_html_(self) -> str:
        return card(repr(self), (), (), ())

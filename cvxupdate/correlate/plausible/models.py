"""Mistakes in a model that a factor on its numbers takes back: units, and sections on their
side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec

LENGTHS = {"width": 1, "height": 1, "diameter": 1, "wall": 1, "thickness": 1}
AREAS = {"A": 2, "Iy": 4, "Iz": 4, "J": 4}
PSI = 6894.757


@dataclass(frozen=True)
class Mistake:
    """A mistake in the model: the question to its author, and the problem without it."""

    asks: str
    spec: Spec

    def model(self) -> Model | None:
        """The model without the mistake; None where it cannot be built."""
        try:
            return replace(build_model(self.spec), modal_damping=())
        except InputError:
            return None


def mistakes(spec: Spec) -> Iterator[Mistake]:
    """Every mistake that is looked for, as far as the model has what it is about."""
    model = spec.model

    def without(asks: str, **parts: Any) -> Mistake:
        return Mistake(asks, replace(spec, model=model.model_copy(update=parts)))

    if model.materials:
        for unit, factor in (("MPa", 1e6), ("GPa", 1e9), ("psi", PSI), ("ksi", 1e3 * PSI)):
            yield without(f"is E in {unit}?", materials=_materials(model, factor, 1.0))
        for unit, factor in (("g/cm³", 1e3), ("t/mm³", 1e12), ("lb/in³", 27679.9)):
            yield without(f"is the density in {unit}?", materials=_materials(model, 1.0, factor))
    for unit, factor in (("mm", 1e-3), ("cm", 1e-2), ("inches", 0.0254), ("feet", 0.3048)):
        nodes, sections = _nodes(model, factor), _sections(model, factor)
        if sections:
            yield without(f"are the sections in {unit}?", sections=sections)
        if any(n.x or n.y or n.z for n in model.nodes):
            yield without(f"are the coordinates of the nodes in {unit}?", nodes=nodes)
            if sections:
                asks = f"are nodes and sections in {unit}?"
                yield without(asks, nodes=nodes, sections=sections)
    turned = {n: s for n, s in model.sections.items() if s.shape == "rectangle" and _oblong(s)}
    for names in [*([name] for name in turned), *([[*turned]] if len(turned) > 1 else [])]:
        sides = {n: _turned(turned[n]) for n in names}
        yield without(_side(names, turned), sections={**model.sections, **sides})
    yield from _springs_and_masses(model, without)
    if model.materials:
        parts = {
            "nodes": _nodes(model, 1e-3),
            "sections": _sections(model, 1e-3),
            "materials": _materials(model, 1e6, 1e12),
            "elements": _rows(_rows(model.elements, "k", 1e3), "m", 1e3),
        }
        yield without("is the model in mm, t and MPa?", **parts)


def _springs_and_masses(model: Any, without: Callable[..., Mistake]) -> Iterator[Mistake]:
    for key, units in (
        ("k", (("N/mm or kN/m", 1e3), ("kN/mm", 1e6))),
        ("m", (("g", 1e-3), ("t", 1e3))),
    ):
        what = "the springs' stiffness" if key == "k" else "the lumps' mass"
        for unit, factor in units:
            rows = _rows(model.elements, key, factor)
            if rows != tuple(model.elements):
                yield without(f"is {what} in {unit}?", elements=rows)


def _side(names: list[str], sections: dict[str, Any]) -> str:
    s = sections[names[0]]
    ratio = max(s.width, s.height) / min(s.width, s.height)
    which = f"section {names[0]!r}" if len(names) == 1 else "every rectangular section"
    return (
        f"is {which} on its side (width {s.width:g} along local y, height {s.height:g} along "
        f"local z; {max(s.width, s.height):g}/{min(s.width, s.height):g} = {ratio:.3g})?"
    )


def _oblong(s: Any) -> bool:
    return bool(max(s.width, s.height) > 1.2 * min(s.width, s.height))


def _turned(s: Any) -> Any:
    return s.model_copy(update={"width": s.height, "height": s.width})


def _materials(model: Any, stiff: float, heavy: float) -> dict[str, Any]:
    return {
        name: m.model_copy(
            update={
                "E": m.E * stiff,
                "G": None if m.G is None else m.G * stiff,
                "rho": m.rho * heavy,
            }
        )
        for name, m in model.materials.items()
    }


def _nodes(model: Any, factor: float) -> tuple[Any, ...]:
    return tuple(
        n.model_copy(update={"x": n.x * factor, "y": n.y * factor, "z": n.z * factor})
        for n in model.nodes
    )


def _sections(model: Any, factor: float) -> dict[str, Any]:
    out = {}
    for name, s in model.sections.items():
        powers = {**LENGTHS, **AREAS}
        given = {k: v for k, v in s.model_dump().items() if k in powers and v is not None}
        out[name] = s.model_copy(update={k: v * factor ** powers[k] for k, v in given.items()})
    return out


def _rows(elements: Any, key: str, factor: float) -> tuple[Any, ...]:
    """The blocks with the numbers ``key`` of their rows multiplied."""
    out = []
    for block in elements:
        rows = tuple(
            r.model_copy(update={key: getattr(r, key) * factor})
            if key in type(r).model_fields and isinstance(getattr(r, key), float)
            else r
            for r in block.rows
        )
        same = all(a is b for a, b in zip(rows, block.rows, strict=True))
        out.append(block if same else block.model_copy(update={"rows": rows}))
    return tuple(out)

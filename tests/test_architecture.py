"""The table of rooms in house.md, enforced on static imports; no cycles; no unlisted part; a light
`import cvxupdate`."""

from __future__ import annotations

import ast
import importlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.cases.sources import tree

PACKAGE = Path(__file__).resolve().parents[1] / "cvxupdate"
BASE = {"errors"}
TEXT = BASE | {"registry", "keys"}  # what a problem file is made of
MODEL = TEXT | {"spec", "fe", "forces"}
DATA = TEXT | {"spec", "recordings"}
# a format that brings models and recordings alike, and what any packed file may unpack to
SHARED = {"matfile", "unpacking"}

# Room or single module → rooms it may import. `errors` and `system` are shared parts: errors for
# all, LinearSystem for those that make, solve or loop over it. What a room may use it may also see
# through (correlate may name the errors and specs of the rooms below it).
ROOMS: dict[str, set[str]] = {
    "errors": set(),
    "system": BASE,
    "registry": BASE,
    "keys": BASE | {"registry"},
    "spec": TEXT,
    "parallel": BASE,
    "blas": set(),
    "inherited": set(),
    "forked": BASE | {"parallel", "blas", "inherited"},
    "unpacking": BASE,
    "matfile": BASE | {"unpacking"},
    "forces": BASE,
    "fe": TEXT | SHARED | {"spec", "forces"},
    "reduction": MODEL,
    "recordings": TEXT | SHARED | {"spec"},
    "simulate": MODEL,
    "correlate": MODEL | DATA | {"reduction", "simulate"},
    "residual": MODEL | DATA | {"reduction", "simulate", "correlate", "system"},
    "convex": BASE | {"system", "keys"},
    "direct": MODEL | {"reduction"},
    "update": MODEL
    | DATA
    | {"reduction", "simulate", "correlate", "residual", "convex", "direct", "system"}
    | {"parallel"},
    "physics": MODEL | {"residual"},
    "diagnose": MODEL
    | DATA
    | {"reduction", "simulate", "correlate", "residual", "convex", "direct", "update", "physics"}
    | {"system", "parallel", "forked"},
    "report": BASE,
}
ROOMS["written"] = set(ROOMS)
ROOMS["beside"] = set(ROOMS)
ROOMS["study"] = set(ROOMS)
ROOMS["commands"] = set(ROOMS)
ROOMS["api"] = set(ROOMS)  # functions for programs, the commands among them
ROOMS["cli"] = BASE | {
    "study",
    "commands",
    "report",
    "spec",
    "parallel",
}  # it hands what study returns to the report, and prints the schema
ROOMS["__init__"] = set(ROOMS)
ROOMS["__main__"] = {"cli"}

# These two may name the types of results (under TYPE_CHECKING, so that nothing runs); every other
# room keeps to the table in that as well.
NAMES_RESULTS = {"report", "cli"}
# The only room that may import each of these.
ONLY = {
    "cvxpy": "convex",
    "qpsolvers": "convex",
    "matplotlib": "report",
    "jinja2": "report",
}
# They know all parts; nothing stands on them.
WIRING = {"written", "study", "api", "commands", "cli", "__init__", "__main__"}
# The picture of diagnose/ in CONTRIBUTING.md: its floors from the ground up. A room may import
# from the floors below its own, never from its own or from above, wherever the statement stands.
DIAGNOSE: tuple[tuple[str, ...], ...] = (
    ("settings", "shown"),
    ("fit", "results", "budget"),
    ("types",),
    ("hypothesis",),
    ("priced",),
    ("screen", "nominal"),
    ("responses", "modes"),
    ("motion",),
    ("search",),
    ("judge",),
    ("output",),
    ("pipeline", "gather", "component"),
    ("reference", "states"),
    ("apart",),
    ("__init__",),
)
MOST_ROOMS = 9
HEAVY = (
    "cvxpy",
    "qpsolvers",
    "clarabel",
    "osqp",
    "scs",
    "matplotlib",
    "jinja2",
    "pyuff",
    "h5py",
    "pydantic",
    "typer",
    "rich",
    "scipy.optimize",
    "scipy.sparse",
    "scipy.signal",
    "scipy.linalg",
)


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(p): p for p in sorted(PACKAGE.rglob("*.py"))}


def room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def statements(node: ast.AST, bodies: bool = True, types: bool = True) -> Iterator[ast.AST]:
    """Every statement of a syntax tree, those in functions only with ``bodies``, those in
    TYPE_CHECKING blocks only with ``types``. An import is a statement: no expression is entered."""
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, block, ()):
            yield child
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef) and not bodies:
                continue
            if isinstance(child, ast.If) and not types and "TYPE_CHECKING" in ast.dump(child.test):
                continue
            yield from statements(child, bodies, types)


def imports(
    source: str | ast.AST, module: str, is_package: bool, bodies: bool = True, types: bool = True
) -> set[str]:
    """Every module that ``source`` imports, wherever the statement stands (see `statements`),
    relative ones made absolute.

    ``from a import b`` counts as a.b where that is a module, else as a.
    """
    out: set[str] = set()
    whole = ast.parse(source) if isinstance(source, str) else source
    for node in statements(whole, bodies, types):
        if isinstance(node, ast.Import):
            out |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                here = module.split(".")
                up = node.level - 1 if is_package else node.level
                base = ".".join([*here[: len(here) - up], *([base] if base else [])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                out.add(inner if inner in MODULES or base == "cvxupdate" else base)
    return out


@cache
def imports_of(module: str, bodies: bool = True, types: bool = True) -> frozenset[str]:
    """Those of a module of the package."""
    path = MODULES[module]
    found = imports(tree(path), module, path.name == "__init__.py", bodies, types)
    return frozenset(found)


def imports_on_load(module: str) -> frozenset[str]:
    """What runs when the module is imported."""
    return imports_of(module, bodies=False, types=False)


def test_every_part_is_listed() -> None:
    found = {room(m) for m in MODULES}
    assert found <= set(ROOMS), f"not in the table of rooms: {sorted(found - set(ROOMS))}"


@pytest.mark.parametrize("module", sorted(MODULES))
def test_imports_stay_in_the_table(module: str) -> None:
    mine = room(module)
    for target in imports_of(module, types=mine not in NAMES_RESULTS):
        first = target.split(".")[0]
        if first == "cvxupdate":
            other = room(target)
            if other == "__init__":
                continue  # the bare package: its version
            assert other == mine or other in ROOMS.get(mine, set()), (
                f"{module} imports {target}: {mine} may not import {other}"
            )
        elif first in ONLY:
            assert mine == ONLY[first], f"{module} imports {first}: only {ONLY[first]} may"


def test_rooms_have_no_cycle() -> None:
    """The table itself is a hierarchy, and so are the modules (by what runs on import)."""
    assert (
        cycle({a: {b for b in others if b != a} for a, others in ROOMS.items() if a not in WIRING})
        is None
    )


def test_modules_have_no_cycle() -> None:
    """By what runs on import; a package stands for its __init__."""
    found = cycle(
        {
            module: {t for t in imports_on_load(module) if t in MODULES and t != module}
            for module in MODULES
        }
    )
    assert found is None, " → ".join(found or [])


def every_import(module: str) -> set[str]:
    """The package's modules that ``module`` needs at any time: on load, inside its functions and
    for its types; with the packages whose ``__init__`` runs on the way to them."""
    targets = {t for t in imports_of(module) if t in MODULES}
    return {t for target in targets for t in {target} | packages_above(target, module)} - {module}


def packages_above(target: str, module: str) -> set[str]:
    """The packages that hold ``target`` but not ``module``, whose own they would be."""
    parts = target.split(".")
    above = {".".join(parts[:k]) for k in range(1, len(parts))}
    return {a for a in above if module != a and not module.startswith(a + ".")}


def test_no_import_closes_a_circle() -> None:
    """Nor one that is hidden in a function: a part is understood without those that stand on it."""
    found = cycle(
        {
            module: {t for t in every_import(module) if room(t) not in WIRING}
            for module in MODULES
            if room(module) not in WIRING
        }
    )
    assert found is None, " → ".join(found or [])


def diagnose_room(module: str) -> str:
    """The room of diagnose/ that a module lies in."""
    parts = module.split(".")
    return parts[2] if len(parts) > 2 else "__init__"


IN_DIAGNOSE = sorted(m for m in MODULES if room(m) == "diagnose")
FLOOR = {name: k for k, names in enumerate(DIAGNOSE) for name in names}


def climbs(module: str, targets: set[str]) -> list[str]:
    """Imports of a module of diagnose/ from its own floor's other rooms, or from above."""
    mine = diagnose_room(module)
    others = {t: diagnose_room(t) for t in targets if room(t) == "diagnose"}
    return sorted(
        t
        for t, other in others.items()
        if other not in ("__init__", mine) and FLOOR[other] >= FLOOR[mine]
    )


def test_diagnose_has_the_rooms_of_its_picture() -> None:
    """Every room is on a floor, and every room of the floors is there."""
    assert {diagnose_room(m) for m in IN_DIAGNOSE} == set(FLOOR)
    folders = [p for p in (PACKAGE / "diagnose").iterdir() if (p / "__init__.py").is_file()]
    assert len(folders) <= MOST_ROOMS


@pytest.mark.parametrize("module", IN_DIAGNOSE)
def test_no_room_of_diagnose_imports_upwards(module: str) -> None:
    """Nor inside a function, nor for a type; so none stands in a circle."""
    found = climbs(module, set(imports_of(module)))
    assert found == [], f"{module} imports upwards: {found}"


def test_the_net_of_diagnose_catches_what_climbs() -> None:
    here, up = "cvxupdate.diagnose.screen.sizes", "cvxupdate.diagnose.search.race"
    assert climbs(here, {up, "cvxupdate.diagnose.types"}) == [up]
    assert climbs(here, {"cvxupdate.diagnose.nominal.mesh"}) == ["cvxupdate.diagnose.nominal.mesh"]
    assert climbs(up, {here, "cvxupdate.diagnose.search.beside", "cvxupdate.physics"}) == []


def test_the_picture_in_contributing_is_that_of_the_floors() -> None:
    """Top floor first, one line a floor, each with its rooms in brackets."""
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = text.partition("### How a diagnosis goes")[2].partition("\n#")[0]
    drawn = section.split("```")[1]
    rows = [re.findall(r"\[ *([a-z]+)(?:\.py)? *\]", line) for line in drawn.splitlines()]
    floors = [tuple(names) for names in rows if names]
    assert floors == [names for names in reversed(DIAGNOSE) if names != ("__init__",)]
    for name in FLOOR:
        assert name == "__init__" or f"* `{name}" in section, f"a line that says what {name} is"


def cycle(graph: dict[str, set[str]]) -> list[str] | None:
    """A cycle of the graph, or None."""
    done: set[str] = set()

    def visit(node: str, trail: list[str]) -> list[str] | None:
        if node in trail:
            return [*trail[trail.index(node) :], node]
        if node in done:
            return None
        for other in sorted(graph.get(node, ())):
            found = visit(other, [*trail, node])
            if found:
                return found
        done.add(node)
        return None

    for start in sorted(graph):
        found = visit(start, [])
        if found:
            return found
    return None


def test_the_reader_of_imports_sees_them_all() -> None:
    """The net itself: relative, nested, aliased and lazy imports; a cycle is found."""
    source = (
        "from . import base\nfrom ..fe.model import Model\ndef f():\n    import cvxpy as cp\n    "
        "from cvxupdate import update\nimport numpy.linalg"
    )
    assert imports(source, "cvxupdate.convex.step", False) == {
        "cvxupdate.convex",
        "cvxupdate.fe.model",
        "cvxpy",
        "cvxupdate.update",
        "numpy.linalg",
    }
    assert imports("from .spec import load_problem", "cvxupdate", True) == {"cvxupdate.spec"}
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) == ["a", "b", "c", "a"]
    assert cycle({"a": {"b", "c"}, "b": {"c"}}) is None
    here = "cvxupdate.convex.constraints.tied"
    assert packages_above(here, "cvxupdate.convex.step") == {"cvxupdate.convex.constraints"}
    assert packages_above(here, "cvxupdate.convex.constraints.bounds") == set()
    typed = (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .a import A\ndef f():\n   "
        " import b\nclass C:\n    def g(self):\n        import d\n"
    )
    assert imports(typed, "cvxupdate.x", False, types=False) == {"typing", "b", "d"}
    assert imports(typed, "cvxupdate.x", False, bodies=False, types=False) == {"typing"}
    assert imports(typed, "cvxupdate.x", False) == {"typing", "b", "d", "cvxupdate.a"}
    hidden = (
        "try:\n    import a\nexcept ImportError:\n    import b\nelse:\n    import c\nfinally:\n"
        "    import d\nwith x:\n    import e\nfor i in x:\n    import f\nelse:\n    import g\n"
        "match x:\n    case 1:\n        import h\nif x:\n    pass\nelif y:\n    import i\n"
    )
    assert imports(hidden, "cvxupdate.x", False) == set("abcdefghi")


def loaded_by(statement: str) -> list[str]:
    script = (
        "import sys, json\nimport numpy\nbefore = "
        f"set(sys.modules)\n{statement}\nprint(json.dumps(sorted(set(sys.modules) - before)))"
    )
    return list(
        json.loads(
            subprocess.run(
                [sys.executable, "-c", script], capture_output=True, text=True, check=True
            ).stdout.splitlines()[-1]
        )
    )


def test_import_is_light() -> None:
    """`import cvxupdate` beyond numpy loads its own light parts and standard modules, nothing
    heavy."""
    loaded = loaded_by("import cvxupdate")
    heavy = [m for m in loaded if any(m == h or m.startswith(h + ".") for h in HEAVY)]
    assert heavy == []
    assert "cvxupdate" in loaded


@pytest.mark.parametrize(
    "name",
    sorted(
        m
        for m in MODULES
        if room(m)
        not in ("convex", "report", "update", "study", "api", "cli", "diagnose", "__main__")
    ),
)
def test_no_room_loads_cvxpy_or_plots_on_import(name: str) -> None:
    """Statically: nothing heavy is imported when a module outside convex and report runs."""
    for target in imports_on_load(name):
        assert target.split(".")[0] not in (
            "cvxpy",
            "qpsolvers",
            "matplotlib",
            "pyuff",
            "h5py",
        ), target


def test_nothing_imports_scipy_stats() -> None:
    """It takes a second; `cvxupdate.recordings.quantiles` has what is needed of it."""
    assert [m for m in MODULES if any(t.startswith("scipy.stats") for t in imports_of(m))] == []


def test_the_model_loads_without_cvxpy() -> None:
    loaded = loaded_by("import cvxupdate.spec, cvxupdate.fe.build, cvxupdate.fe.modes")
    assert not [
        m
        for m in loaded
        if m.split(".")[0] in ("cvxpy", "qpsolvers", "matplotlib", "pyuff", "h5py")
    ]


def test_the_registries_hold_every_part_of_their_folders() -> None:
    """The four lists are all that `registry` names, and no class or format of their folders is left
    out."""
    from cvxupdate import registry
    from cvxupdate.recordings.read.contents import Format

    part = {  # how a part of each kind is known
        registry.ELEMENTS: lambda found: (
            isinstance(found, type) and hasattr(found, "from_row") and hasattr(found, "text")
        ),
        registry.CONSTRAINTS: lambda found: isinstance(found, type) and "clauses" in vars(found),
        registry.REGULARISERS: lambda found: (
            isinstance(found, type) and "weight_range" in vars(found)
        ),
        registry.READERS: lambda found: isinstance(found, Format),
    }
    known = {r for r in vars(registry).values() if isinstance(r, registry.Registry)}
    assert known == {*part, registry.EFFECTS}  # effects: tests/physics/test_contract.py
    for listed, is_part in part.items():
        home = listed.home.partition(":")[0]
        modules = [importlib.import_module(m) for m in MODULES if m.startswith(home + ".")]
        found = {
            id(value): value
            for module in modules
            for value in vars(module).values()
            if is_part(value) and not getattr(value, "_is_protocol", False)
        }
        assert set(found) == {id(member) for member in listed.members()}, listed.kind


def test_recordings_are_read_by_the_wiring_alone():
    """They go down as data, so none is read twice."""
    reading = {
        module
        for module, path in MODULES.items()
        if room(module) != "recordings"
        and "load_recordings" in path.read_text(encoding="utf-8")
        and any(
            isinstance(node, ast.ImportFrom)
            and any(alias.name == "load_recordings" for alias in node.names)
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        )
    }
    assert reading == {"cvxupdate.study"}

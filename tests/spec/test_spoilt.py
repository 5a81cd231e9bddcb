"""Every spoilt problem file gives one clear message: the file, the key, the value, the remedy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from cvxupdate.errors import ProblemFileError
from cvxupdate.spec import check_problem, load_problem

Spoil = Callable[..., Path]


@dataclass(frozen=True)
class Spoilt:
    """What is edited, the key of the one fault, and words that its message must hold."""

    name: str
    edits: tuple[tuple[str, str], ...]
    key: str
    words: tuple[str, ...]


def one(name: str, old: str, new: str, key: str, *words: str) -> Spoilt:
    return Spoilt(name, ((old, new),), key, words)


TIP = '{ id = 2, nodes = [2, 3], group = "tip" }'
SHAPE = "shape = [0.4, 1.0], shape_std = 0.01, mode = 1"
TIED = 'tied = [{ parameters = ["e1.stiffness", "e2.stiffness"] }]'
LINEAR = 'linear = [{ coefficients = { "e11.stiffness" = 1.0, skin = -3.0 }, equals = 0.0 }]'
FIRST = '{ elements = "all", of = "stiffness", each = "element", lower = -0.4, upper = 0.4 }'
ROW = "model.elements[0].rows[1]"
FAMILY = "[[model.families]]\nelements = [1]\nK = [[1, 1, 0.1]]\n\n"

SPOILT = [
    Spoilt(
        "exact elements and eigenstructure",
        (
            ('type = "beam3d"', 'type = "exact_beam"'),
            ('method = "frequencies"', 'method = "ceam"'),
        ),
        "update.method",
        (
            "needs matrices that do not depend on the frequency",
            'Take method = "rfm" for responses, "sensitivity" for modes',
        ),
    ),
    one(
        "a G that follows E",
        '{ material = "steel", of = "rho" }',
        '{ elements = [1], of = "G" }',
        "update.parameters[2].of",
        "has no 'G'",
        "Give it a G of its own (that of E and nu is",
    ),
    # what pydantic finds, in our words
    one(
        "unknown key",
        "thickness = 0.002",
        "thickness = 0.002\ntickness = 0.002",
        "model.sections.skin.tickness",
        "unknown key",
        "Did you mean 'thickness'?",
    ),
    one(
        "unknown key at the top",
        "[solver]",
        "[solvers]",
        "solvers",
        "unknown key 'solvers'",
        "Did you mean 'solver'?",
    ),
    one(
        "unknown key in a row",
        "nodes = [2, 3], group",
        "nodes = [2, 3], groop",
        f"{ROW}.groop",
        "unknown key 'groop'",
        "Did you mean 'group'?",
    ),
    one(
        "wrong case of a key",
        "E = 207e9",
        "e = 1.0\nE = 207e9",
        "model.materials.steel.e",
        "unknown key 'e'",
        "Did you mean 'E'?",
    ),
    one(
        "text for a number",
        "E = 207e9",
        'E = "207e9"',
        "model.materials.steel.E",
        "'207e9' is not a number",
        "without quotes",
    ),
    one(
        "true for a number", "eta = 0.01", "eta = true", "model.damping.eta", "true is not a number"
    ),
    one(
        "true for a sign",
        "sign = -1",
        "sign = true",
        "recordings[1].channels[1].sign",
        "true",
        "1 or -1",
    ),
    one(
        "number for text",
        'title = "Cantilever with a panel"',
        "title = 3",
        "title",
        "3 is not text",
    ),
    one(
        "fraction for a number of a node",
        "id = 5, x",
        "id = 5.5, x",
        "model.nodes[4].id",
        "5.5 is not a whole number",
    ),
    one(
        "NaN",
        "rho = 7850.0",
        "rho = nan",
        "model.materials.steel.rho",
        "nan is not a finite number",
    ),
    one("infinity", "x = 0.31 }", "x = inf }", "model.nodes[1].x", "inf is not a finite number"),
    one(
        "negative mass", "m = 0.35", "m = -0.35", "model.elements[3].rows[0].m", "-0.35 is negative"
    ),
    one(
        "negative modulus",
        "E = 207e9",
        "E = -207e9",
        "model.materials.steel.E",
        "-207000000000.0 is negative",
        "greater than 0",
    ),
    one(
        "Poisson's ratio",
        "nu = 0.3",
        "nu = 0.7",
        "model.materials.steel.nu",
        "0.7 is out of range",
        "at most 0.5",
    ),
    one(
        "negative stiffness on the block",
        "k = 1.5e4",
        "k = -1.5e4",
        "model.elements[2].k",
        "-15000.0 is negative",
    ),
    one(
        "missing number",
        "thickness = 0.002",
        "",
        "model.sections.skin.thickness",
        "is missing",
        "thickness [m]",
    ),
    one(
        "missing in a row and in its block",
        "k = 1.5e4\n",
        "",
        "model.elements[2].rows[0].k",
        "is missing",
        "on the row, or once on the block",
    ),
    one(
        "unknown element type",
        'type = "beam3d"',
        'type = "beam4d"',
        "model.elements[0]",
        "unknown type 'beam4d'",
        "Did you mean 'beam3d'?",
    ),
    one(
        "no element type",
        'type = "beam3d"\n',
        "",
        "model.elements[0]",
        "`type` is missing",
        "beam3d",
    ),
    one(
        "unknown shape",
        'shape = "plate"',
        'shape = "plait"',
        "model.sections.skin",
        "unknown shape 'plait'",
        "Did you mean 'plate'?",
    ),
    one(
        "unknown method",
        'method = "frequencies"',
        'method = "frequency"',
        "update.method",
        "'frequency'",
        "Did you mean 'frequencies'?",
    ),
    one(
        "unknown solver",
        'name = "clarabel"',
        'name = "mosek"',
        "solver.name",
        "'MOSEK'",
        "CLARABEL",
    ),
    one(
        "unknown physics",
        '"clearance"]',
        '"clearence"]',
        "diagnose.physics[1]",
        "'clearence'",
        "Did you mean 'clearance'?",
    ),
    one(
        "a scatter that is none",
        'physics = ["added_mass", "clearance"]',
        'physics = ["added_mass", "clearance"]\nscatter = 1.5',
        "diagnose.scatter",
        "1",
    ),
    one(
        "unknown regularisation",
        'kind = "tikhonov"',
        'kind = "tikonov"',
        "regularisation.kind",
        "Did you mean 'tikhonov'?",
    ),
    one(
        "weight",
        'weight = "l-curve"',
        'weight = "lcurve"',
        "regularisation.weight",
        "'lcurve'",
        "discrepancy",
    ),
    one(
        "negative weight",
        'weight = "l-curve"',
        "weight = -1.0",
        "regularisation.weight",
        "-1.0",
        "a number ≥ 0",
    ),
    one(
        "three nodes of a beam",
        "nodes = [2, 3], g",
        "nodes = [2, 3, 4], g",
        f"{ROW}.nodes",
        "has 3 entries",
        "at most 2",
    ),
    one(
        "one node of a beam",
        "nodes = [2, 3], g",
        "nodes = [2], g",
        f"{ROW}.nodes",
        "has 1 entries",
        "at least 2",
    ),
    one(
        "a number for nodes", "nodes = [2, 3], g", "nodes = 2, g", f"{ROW}.nodes", "2 is not a list"
    ),
    one(
        "no rows",
        "rows = [{ id = 31, nodes = [4], m = 0.35, Ixx = 1e-4 }]",
        "rows = []",
        "model.elements[3].rows",
        "is empty",
    ),
    one(
        "unknown DOF kind",
        'dofs = ["y", "z"]',
        'dofs = ["y", "w"]',
        "model.elements[4].rows[0].dofs[1]",
        "'w'",
        "Allowed: x, y, z",
    ),
    one(
        "zero frequency",
        "frequency = 14.2",
        "frequency = 0.0",
        "recordings[0].rows[0].frequency",
        "0.0 is out of range",
        "greater than 0",
    ),
    one(
        "disc without an axis",
        "[[model.supports]]",
        '[[model.elements]]\ntype = "gyroscopic"\nrows = [{ id = 91, nodes = [2], Ip = 0.1, '
        "omega = 3.0 }]\n\n[[model.supports]]",
        "model.elements[5].rows[0].axis",
        "has no axis",
        "spins about",
    ),
    one(
        "shaft with an axis",
        "[[model.supports]]",
        '[[model.elements]]\ntype = "gyroscopic"\nrows = [{ id = 91, nodes = [2, 3], Ip = '
        "0.1, omega = 3.0, axis = [1.0, 0.0, 0.0] }]\n\n[[model.supports]]",
        "model.elements[5].rows[0].axis",
        "is a shaft",
        "Leave `axis` out",
    ),
    one(
        "tie to a missing node",
        "[[model.supports]]",
        '[[model.ties]]\nnodes = [2, 77]\ndofs = ["z"]\n\n[[model.supports]]',
        "model.ties[0].nodes",
        "node 77 is tied, but does not exist",
    ),
    one(
        "tie of distant nodes",
        "[[model.supports]]",
        '[[model.ties]]\nnodes = [2, 3]\ndofs = ["z"]\n\n[[model.supports]]',
        "model.ties[0].nodes",
        "do not lie at one point",
    ),
    one(
        "tie of a node to itself",
        "[[model.supports]]",
        '[[model.ties]]\nnodes = [2, 2]\ndofs = ["z"]\n\n[[model.supports]]',
        "model.ties[0].nodes",
        "names a node twice",
    ),
    one(
        "preload of a rod",
        "[[model.supports]]",
        '[[model.elements]]\ntype = "rod"\nmaterial = "steel"\nsection = "bar"\nrows = [{ id '
        "= 92, nodes = [1, 5], N = 100.0 }]\n\n[[model.supports]]",
        "model.elements[5].rows[0].N",
        "only beams can carry",
    ),
    one(
        "correction that says nothing",
        'use = "hold-out"',
        'use = "hold-out"\ncorrections = [{ node = 3, dof = "y" }]',
        "recordings[1].corrections[0]",
        "gives no fault",
        "Give one of",
    ),
    one(
        "correction that says two things",
        'use = "hold-out"',
        'use = "hold-out"\ncorrections = [{ node = 3, dof = "y", gain = 2.0, delay = 0.1 }]',
        "recordings[1].corrections[0]",
        "gives gain and delay",
    ),
    one(
        "correction by nothing",
        'use = "hold-out"',
        'use = "hold-out"\ncorrections = [{ node = 3, dof = "y", gain = 0.0 }]',
        "recordings[1].corrections[0].gain",
        "is 0",
    ),
    one(
        "channel exchanged with itself",
        'use = "hold-out"',
        'use = "hold-out"\ncorrections = [{ node = 3, dof = "y", exchanged_with = { node = '
        '3, dof = "y" } }]',
        "recordings[1].corrections[0].exchanged_with",
        "the channel itself",
    ),
    # names and numbers
    one("duplicate node", "id = 5, x = 0.31", "id = 4, x = 0.31", "", "node 4 appears twice"),
    one(
        "duplicate element across blocks",
        "id = 31",
        "id = 2",
        "model.elements[3].rows[0].id",
        "element 2 appears twice",
    ),
    one(
        "element to a missing node",
        "nodes = [2, 3], g",
        "nodes = [2, 93], g",
        f"{ROW}.nodes",
        "element 2 stands on node 93, which does not exist",
    ),
    one(
        "unknown material",
        TIP,
        TIP.replace("group", 'material = "stele", group'),
        f"{ROW}.material",
        "no material 'stele'",
        "Did you mean 'steel'?",
    ),
    one(
        "unknown section",
        TIP,
        TIP.replace("group", 'section = "bat", group'),
        f"{ROW}.section",
        "no section 'bat'",
        "Did you mean 'bar'?",
    ),
    one(
        "plate section on a beam",
        TIP,
        TIP.replace("group", 'section = "skin", group'),
        f"{ROW}.section",
        "is a beam3d, but section 'skin' is a plate",
    ),
    one(
        "support at a missing node",
        "nodes = [1]\n",
        "nodes = [1, 71]\n",
        "model.supports[0].nodes",
        "node 71 is held, but does not exist",
    ),
    # structure and geometry
    one(
        "mechanism: loose node",
        "  { id = 5, x",
        "  { id = 6, x = 1.0 },\n  { id = 5, x",
        "model.nodes[4]",
        "node 6 belongs to no element",
        "mechanism",
    ),
    Spoilt(
        "mechanism: floating mass",
        (
            ("  { id = 5, x", "  { id = 6, x = 1.0 },\n  { id = 5, x"),
            ("nodes = [4], m", "nodes = [6], m"),
        ),
        "model.elements[3].rows[0].nodes",
        ("mass 31 at node 6 is joined to nothing", "mechanism"),
    ),
    one(
        "no length",
        "id = 2, x = 0.31",
        "id = 2, x = 0.0",
        "",
        "beam3d 1 has no length: nodes 1 and 2 coincide",
    ),
    one(
        "same node twice",
        "nodes = [2, 3], g",
        "nodes = [3, 3], g",
        f"{ROW}.nodes",
        "names a node twice",
    ),
    one(
        "orientation along the axis",
        "orientation = [0.0, 0.0, 1.0]",
        "orientation = [-2.0, 0.0, 0.0]",
        "model.elements[0].rows[0].orientation",
        "parallel to the axis",
    ),
    one(
        "plate not rectangular",
        "id = 4, x = 0.74, y = 0.2",
        "id = 4, x = 0.80, y = 0.2",
        "model.elements[1].rows[0].nodes",
        "plate 11 is not a rectangle",
    ),
    one(
        "plate clockwise",
        "nodes = [2, 3, 4, 5]",
        "nodes = [2, 5, 4, 3]",
        "model.elements[1].rows[0].nodes",
        "counter-clockwise",
        "Write [2, 3, 4, 5]",
    ),
    one(
        "plate crossed",
        "nodes = [2, 3, 4, 5]",
        "nodes = [2, 3, 5, 4]",
        "model.elements[1].rows[0].nodes",
        "counter-clockwise",
        "Write [2, 3, 4, 5]",
    ),
    Spoilt(
        "shell crossed",
        (('type = "plate"', 'type = "shell"'), ("nodes = [2, 3, 4, 5]", "nodes = [2, 3, 5, 4]")),
        "model.elements[1].rows[0].nodes",
        ("shell 11 has no area", "Order its nodes"),
    ),
    Spoilt(
        "shell not convex",
        (('type = "plate"', 'type = "shell"'), ("x = 0.74, y = 0.2", "x = 0.40, y = 0.05")),
        "model.elements[1].rows[0].nodes",
        ("shell 11 is not convex", "divide it into triangles"),
    ),
    one(
        "rectangle with a shear coefficient",
        "thickness = 0.002",
        "thickness = 0.002\nkappa = 0.83",
        "model.elements[1].section",
        "plate 11 does not deform in shear",
        'type = "shell"',
    ),
    one(
        "spring with dof and dofs",
        'k = 2.0e3, dof = "ry"',
        'k = 2.0e3, dof = "ry", dofs = ["z"]',
        "model.elements[2].rows[1].dof",
        "both `dof` and `dofs`",
    ),
    one(
        "spring without direction",
        'dof = "z"\nk',
        "k",
        "model.elements[2].rows[0].dof",
        "spring 21 has no `dof`",
    ),
    # recordings
    one(
        "missing file",
        'file = "run.csv"',
        'file = "rum.csv"',
        "recordings[1].file",
        "there is no file",
        "rum.csv",
    ),
    one(
        "a modulus beyond all quantities",
        "E = 207e9",
        "E = 207e99",
        "model.materials.steel.E",
        "is larger than any quantity in SI",
    ),
    one("folder for a file", 'file = "run.csv"', 'file = "."', "recordings[1].file", "is a folder"),
    one(
        "no file",
        'file = "run.csv"\n',
        "",
        "recordings[1].file",
        "is missing",
        "a time recording needs data",
    ),
    one(
        "channel at a missing node",
        'node = 3, dof = "z" },\n  { column = 1, quantity = "a',
        'node = 33, dof = "z" },\n  { column = 1, quantity = "a',
        "recordings[1].channels[0].node",
        "channel 0 sits at node 33, which does not exist",
    ),
    one(
        "channel without a node",
        'quantity = "force", node = 3,',
        'quantity = "force",',
        "recordings[1].channels[0].node",
        "is missing",
        "reads force",
    ),
    one(
        "duplicate column",
        'column = 1, quantity = "acceleration"',
        'column = 0, quantity = "acceleration"',
        "recordings[1].channels[1].column",
        "column 0 is already used by another channel",
    ),
    one(
        "shape too short",
        SHAPE,
        SHAPE.replace("[0.4, 1.0]", "[0.4]"),
        "recordings[0].rows[0].shape",
        "has 1 entries for 2 channels",
    ),
    one(
        "shape of zeros",
        SHAPE,
        SHAPE.replace("[0.4, 1.0]", "[0.0, 0.0]"),
        "recordings[0].rows[0].shape",
        "zero everywhere",
    ),
    one(
        "two modes paired with one",
        "mode = 2",
        "mode = 1",
        "recordings[0].rows[0].mode",
        "2 measured modes are paired with mode 1",
    ),
    one(
        "nothing to fit",
        'use = "fit"',
        'use = "hold-out"',
        "recordings",
        "every recording is a hold-out",
    ),
    one(
        "method without its recording",
        'method = "frequencies"',
        'method = "rfm"',
        "update.method",
        "'rfm' needs a recording of kind frf or time",
        "only modes",
    ),
    one(
        "empty band",
        "level = 2.0",
        "level = 2.0\nband = [80.0, 20.0]",
        "recordings[1].band",
        "is empty",
    ),
    one(
        "no samples left",
        "rate = 512.0",
        "rate = 512.0\nstart = 40\nstop = 40",
        "recordings[1].stop",
        "no samples are left",
    ),
    Spoilt(
        "excitation at a missing node",
        (
            ('kind = "time"', 'kind = "frf"'),
            ("rate = 512.0", 'references = [{ node = 55, dof = "z" }]'),
        ),
        "recordings[1].references[0].node",
        ("the excitation sits at node 55, which does not exist",),
    ),
    Spoilt(
        "channel without its reference",
        (
            ('kind = "time"', 'kind = "frf"'),
            ("rate = 512.0", 'references = [{ node = 3, dof = "z" }]'),
            ("sign = -1", "reference = 1"),
        ),
        "recordings[1].channels[1].reference",
        ("1 of 1 references",),
    ),
    # update, constraints, regularisation
    one(
        "bounds crossed",
        "lower = -0.4, upper = 0.4",
        "lower = 0.4, upper = -0.4",
        "update.parameters[0].lower",
        "lower 0.4 is above upper -0.4",
    ),
    one(
        "common bounds crossed",
        "lower = -0.5, upper = 0.5",
        "lower = 0.5, upper = -0.5",
        "constraints.bounds.lower",
        "lower 0.5 is above upper -0.5",
    ),
    one(
        "unphysical bound",
        "lower = -0.5, upper = 0.5",
        "lower = -1.0, upper = 0.5",
        "constraints.bounds.lower",
        "zero or negative",
        "above -1",
    ),
    one(
        "unphysical stiffness",
        "lower = -0.4, upper = 0.4",
        "lower = -1.5, upper = 0.4",
        "update.parameters[0].lower",
        "negative",
        "at or above -1",
    ),
    one(
        "unknown group",
        'group = "panel", of',
        'group = "panle", of',
        "update.parameters[1].group",
        "no group 'panle'",
        "Did you mean 'panel'?",
    ),
    one(
        "unknown element",
        'elements = "all", of',
        "elements = [1, 2, 11, 777], of",
        "update.parameters[0].elements",
        "no element 777",
    ),
    one(
        "wrong word for elements",
        'elements = "all", of',
        'elements = "every", of',
        "update.parameters[0].elements",
        "'every'",
        '"all"',
    ),
    one(
        "property the elements do not have",
        'of = "thickness"',
        'of = "Iy"',
        "update.parameters[1].of",
        "no element of this parameter has 'Iy'",
    ),
    one(
        "two ways to choose",
        'group = "panel", of',
        'group = "panel", elements = [11], of',
        "update.parameters[1]",
        "names elements and group",
        "exactly one",
    ),
    one(
        "no way to choose",
        'group = "panel", of',
        "of",
        "update.parameters[1]",
        "does not state where 'thickness' changes",
    ),
    one(
        "relative change of nothing",
        "k = 2.0e3",
        "k = 0.0",
        "update.parameters[0]",
        "'e22.stiffness' is 0 in the model",
        'of = "k"',
    ),
    one(
        "the same parameter twice",
        '{ material = "steel", of = "rho" }',
        '{ elements = [2], of = "stiffness" }',
        "update.parameters[2]",
        "'e2.stiffness' is already a parameter",
    ),
    one(
        "unknown name in a tie",
        TIED,
        TIED.replace("e2.", "e7."),
        "constraints.tied[0].parameters",
        "no parameter 'e7.stiffness'",
    ),
    one(
        "linear clause without side",
        LINEAR,
        LINEAR.replace(", equals = 0.0", ""),
        "constraints.linear[0]",
        "no right-hand side",
    ),
    one(
        "unknown name in a clause",
        LINEAR,
        LINEAR.replace("skin", "skim"),
        "constraints.linear[0].coefficients",
        "no parameter 'skim'",
        "Did you mean 'skin'?",
    ),
    one(
        "total mass neither",
        "{ conserve = true }",
        "{}",
        "constraints.total_mass",
        "neither `conserve` nor `value`",
    ),
    one(
        "groups without a group penalty",
        'weight = "l-curve"',
        'weight = 1.0\ngroups = [["skin"]]',
        "regularisation.groups",
        "do not apply to kind 'tikhonov'",
    ),
    one(
        "not in this version",
        "total_mass = ",
        "centre_of_gravity = { x = 0.1 }\ntotal_mass = ",
        "constraints.centre_of_gravity",
        "unknown key",
    ),
    one(
        "a family of one number",
        FIRST,
        FIRST[:-2] + ", family = {} }",
        "update.parameters[0].family",
        "does not apply to 'stiffness'",
        'of = "generic"',
    ),
    one(
        "modes of two matrices",
        '{ material = "steel", of = "rho" },',
        '{ material = "steel", of = "rho" },\n'
        '{ elements = [1], of = "generic", family = { classes = [[1, 2]] } },',
        "update.parameters[3].family.classes",
        "number their modes each by itself",
        'matrices = ["K"]',
    ),
    one(
        "a factor on a member of a family",
        "[[model.supports]]",
        FAMILY + "[[model.supports]]",
        "update.parameters[0]",
        "acts on element 1, whose matrix is given",
        'of = "generic"',
    ),
    one(
        "a family of nothing",
        "[[model.supports]]",
        FAMILY.replace("elements = [1]\n", "") + "[[model.supports]]",
        "model.families[0]",
        "names no elements",
        "exactly one of elements, group",
    ),
    one(
        "a family of an element that is not there",
        "[[model.supports]]",
        FAMILY.replace("[1]\n", "[99]\n") + "[[model.supports]]",
        "model.families[0].elements",
        "element 99 does not exist",
        "Name rods, beams",
    ),
]


@pytest.mark.parametrize("case", SPOILT, ids=[case.name.replace(" ", "-") for case in SPOILT])
def test_one_clear_message(case: Spoilt, spoil: Spoil) -> None:
    path = spoil(*case.edits)
    with pytest.raises(ProblemFileError) as caught:
        load_problem(path)
    faults = caught.value.faults
    mine = [f for f in faults if f.key == case.key] if case.key else list(faults)
    assert mine, f"no fault at {case.key}: {[str(f) for f in faults]}"
    said = str(mine[0]) if case.key else str(caught.value)
    for word in case.words:
        assert word in said, f"{word!r} is not in: {said}"
    assert all(f.file and f.problem and f.remedy for f in faults), (
        "a fault without file, problem or remedy"
    )
    assert (
        "pydantic" not in str(caught.value).lower()
        and "input should" not in str(caught.value).lower()
    )
    consequences = {"duplicate node": 3, "no length": 2, "mechanism: floating mass": 2}.get(
        case.name, 1
    )
    assert len(faults) <= consequences, f"more than one message: {[str(f) for f in faults]}"


def test_the_names_differ() -> None:
    assert len({case.name for case in SPOILT}) == len(SPOILT) >= 30


def test_all_faults_at_once(spoil: Spoil) -> None:
    path = spoil(
        ("E = 207e9", 'E = "207e9"'),
        ("thickness = 0.002", "thickness = 0.002\ntickness = 1.0"),
        (TIP, '{ id = 2, nodes = [2, 93], group = "tip" }'),
        ("m = 0.35", "m = -0.35"),
        ('file = "run.csv"', 'file = "rum.csv"'),
        ("lower = -0.5, upper = 0.5", "lower = 0.5, upper = -0.5"),
    )
    keys = {f.key for f in check_problem(path)}
    assert keys == {
        "model.materials.steel.E",
        "model.sections.skin.tickness",
        "model.elements[0].rows[1].nodes",
        "model.elements[3].rows[0].m",
        "recordings[1].file",
        "constraints.bounds.lower",
    }


def test_keys_are_those_of_the_file_when_earlier_rows_are_broken(spoil: Spoil) -> None:
    path = spoil(
        (
            '{ id = 1, nodes = [1, 2], group = "root",',
            '{ id = "1", nodes = [1, 2], group = "root",',
        ),
        (TIP, TIP.replace("[2, 3]", "[2, 93]")),
    )
    assert [f.key for f in check_problem(path)] == [
        "model.elements[0].rows[0].id",
        "model.elements[0].rows[1].nodes",
    ]


def test_a_fault_of_a_block_is_said_once_for_all_its_rows(spoil: Spoil) -> None:
    path = spoil(("k = 1.5e4", 'k = "soft"'))
    assert [f.key for f in check_problem(path)] == ["model.elements[2].k"]


def test_a_section_that_no_one_has_is_said_at_the_block_that_names_it(spoil: Spoil) -> None:
    path = spoil(('section = "bar"\n', 'section = "bra"\n'))
    (fault,) = check_problem(path)
    assert fault.key == "model.elements[0].section" and "'bar'" in fault.remedy


def test_a_misspelt_channel_takes_no_entry_from_the_shapes(spoil: Spoil) -> None:
    path = spoil(
        (
            'column = 0, quantity = "displacement", node = 2',
            'column = 0, quantity = "displ", node = 2',
        )
    )
    assert [f.key for f in check_problem(path)] == ["recordings[0].channels[0].quantity"]


def test_many_faults_alike_are_counted(spoil: Spoil) -> None:
    rows = ", ".join(f"{{ id = {i}, nodes = [{i}, 3] }}" for i in range(1000, 1200))
    path = spoil((TIP, f"{TIP}, {rows}"))
    faults = check_problem(path)
    assert len(faults) == 11 and "190 more faults of the same kind" in str(faults[-1])


# What keeps a file from being read at all.


@pytest.mark.parametrize(
    ("blob", "words"),
    [
        (b"", ("is empty",)),
        (b"title = \n", ("not valid TOML", "line 1")),
        (b"[model\n", ("not valid TOML",)),
        (b"a = 1\na = 2\n", ("not valid TOML", "overwrite")),
        (b"\xef\xbb\xbftitle = 'x'\n", ("byte-order mark", "without BOM")),
        ("title = 'x'\n".encode("utf-16"), ("byte-order mark",)),
        (b"title = '\xe9t\xe9'\n", ("not UTF-8", "line 1")),
        (b"x = " + b"[" * 5000, ("nested too deeply",)),
        (b"x = " + b"9" * 5000, ("not valid TOML",)),
        (b"title = 'x'\n", ("model: is missing",)),
    ],
    ids=[
        "empty",
        "no-value",
        "bracket",
        "twice",
        "bom",
        "utf-16",
        "latin-1",
        "deep",
        "digits",
        "no-model",
    ],
)
def test_unreadable_files(tmp_path: Path, blob: bytes, words: tuple[str, ...]) -> None:
    path = tmp_path / "p.toml"
    path.write_bytes(blob)
    faults = check_problem(path)
    assert len(faults) == 1
    for word in words:
        assert word in str(faults[0])


def test_a_folder_and_a_missing_file(good: Path, tmp_path: Path) -> None:
    assert check_problem(good.parent) == () and load_problem(good.parent) == load_problem(good)
    (tmp_path / "empty").mkdir()
    (folder,) = check_problem(tmp_path / "empty")
    assert "is a folder, without a problem.toml" in str(folder)
    (missing,) = check_problem(tmp_path / "none.toml")
    assert "there is no such file" in str(missing) and "none.toml" in missing.file
    (nul,) = check_problem(str(tmp_path) + "/a\0b.toml")
    assert "NUL" in str(nul)

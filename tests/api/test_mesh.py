"""Meshes of other programs: CalculiX's input against the frequencies that it prints, sheets on a
mesh made here, and what no element can be made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from cvxupdate import Frf, InputError, Model, diagnose

meshio = pytest.importorskip("meshio")
CALCULIX = Path(__file__).resolve().parents[1] / "cases" / "calculix"
STEEL = {"STEEL": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}}
SHEET = {"sheet": {"shape": "plate", "thickness": 0.004}}
INP = CALCULIX / "plate.inp"


def sheet(cells: str = "quad") -> meshio.Mesh:
    x, y = np.meshgrid([0.0, 120.0, 310.0, 400.0], [0.0, 90.0, 250.0])
    points = np.c_[x.ravel(), y.ravel(), 0 * x.ravel()]
    quads = [
        (4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in (0, 1) for i in (0, 1, 2)
    ]
    edge = np.array([[0, 4], [4, 8]])
    faces = np.array(quads)
    if cells == "triangle":
        faces = np.vstack([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return meshio.Mesh(
        points,
        [(cells, faces), ("line", edge)],
        cell_sets={"left": [np.arange(2), None], "clamp": [None, np.arange(2)]},
    )


def test_the_input_of_calculix_is_its_block() -> None:
    """Mass of the whole; frequencies within what two bricks with incompatible modes differ by:
    CalculiX gives its internal motions mass, ours are condensed."""
    block = {"material": "STEEL"}
    free = Model.from_mesh(INP, {"BLOCK": block}, materials=STEEL)
    assert free.mass == pytest.approx(7850 * 0.2 * 0.1 * 0.02)
    assert free.groups == {"BLOCK": [1, 2]}
    held = Model.from_mesh(
        INP, {"all": block}, supports={n: "all" for n in (1, 4, 7, 10)}, materials=STEEL
    )
    assert len(held.labels) == 24
    assert held.modes(1).frequencies[0] == pytest.approx(448.155, rel=0.03)


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_a_sheet_in_millimetres_with_its_edge_held(cells: str, tmp_path: Path) -> None:
    both = {
        "left": {"material": "STEEL", "section": "sheet"},
        "all": {"material": "STEEL", "section": "sheet"},
    }
    made = Model.from_mesh(
        sheet(cells), both, supports={"clamp": "all"}, scale=1e-3, materials=STEEL, sections=SHEET
    )
    assert made.mass == pytest.approx(7850 * 0.004 * 0.4 * 0.25)
    assert made.groups == {"left": [1, 2]} and len(made.labels) == 9 * 6
    assert made.modes(2).frequencies[0] > 1.0
    assert made.plot().axes


def test_gmsh_files_with_physical_groups(tmp_path: Path) -> None:
    mesh = sheet()
    mesh.cell_sets = {}
    mesh.field_data = {"skin": np.array([7, 2]), "clamp": np.array([3, 1])}
    tags = [np.full(len(block.data), tag) for block, tag in zip(mesh.cells, (7, 3), strict=True)]
    mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(tmp_path / "a.msh", mesh, "gmsh22", binary=False)
    keys = {"skin": {"material": "STEEL", "section": "sheet"}}
    made = Model.from_mesh(
        tmp_path / "a.msh",
        keys,
        supports={"clamp": ["x", "y", "z"]},
        scale=1e-3,
        materials=STEEL,
        sections=SHEET,
    )
    assert made.groups == {"skin": [1, 2, 3, 4, 5, 6]} and len(made.labels) == 12 * 6 - 9


@pytest.mark.parametrize("kind", ["line", "hexahedron20", "tetra10"])
def test_beams_and_quadratic_solids(kind: str) -> None:
    corner = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    )
    edges = {
        "line": [],
        "hexahedron20": [
            (0, 1),
            (1, 2),
            (2, 3),
            (3, 0),
            (4, 5),
            (5, 6),
            (6, 7),
            (7, 4),
            (0, 4),
            (1, 5),
            (2, 6),
            (3, 7),
        ],
        "tetra10": [(0, 1), (1, 3), (3, 0), (0, 4), (1, 4), (3, 4)],
    }[kind]
    first = {"line": [0, 1], "hexahedron20": list(range(8)), "tetra10": [0, 1, 3, 4]}[kind]
    points = np.vstack([corner, *[corner[list(e)].mean(axis=0)[None] for e in edges]]).astype(float)
    cell = [*first, *range(8, 8 + len(edges))]
    mesh = meshio.Mesh(points, [(kind, [cell])])
    bar = {"bar": {"shape": "circle", "diameter": 0.1}}
    keys = {"material": "STEEL", **({"section": "bar"} if kind == "line" else {})}
    made = Model.from_mesh(mesh, {"all": keys}, materials=STEEL, sections=bar)
    volume = {"line": np.pi * 0.05**2, "hexahedron20": 1.0, "tetra10": 1.0 / 6.0}[kind]
    assert made.mass == pytest.approx(7850 * volume)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Model.from_mesh(3, {}), "is no mesh"),
        (lambda: Model.from_mesh("none.msh", {}), "no such file"),
        (lambda: Model.from_mesh(CALCULIX / "plate.dof", {}), "meshio cannot read"),
        (lambda: Model.from_mesh(INP, {}, materials=STEEL), "nothing is said of 2 cells"),
        (lambda: Model.from_mesh(INP, {"ROOF": {}}), "no set 'ROOF'. It has BLOCK"),
        (lambda: Model.from_mesh(INP, {"all": "STEEL"}), "give a dictionary"),
        (lambda: Model.from_mesh(INP, {"all": {}}, scale=-1), "scale"),
        (
            lambda: Model.from_mesh(INP, {"all": {"material": "STEEL"}}, supports={"W": "all"}),
            "'W'",
        ),
        (lambda: Model.from_mesh(INP, {"all": {"material": "WOOD"}}, materials=STEEL), "WOOD"),
        (
            lambda: Model.from_mesh(
                meshio.Mesh(np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])]), {"all": {}}
            ),
            "too stiff",
        ),
        (lambda: Model.from_mesh(meshio.Mesh(np.eye(3), []), {"all": {}}), "no cells"),
    ],
)
def test_bad_input_is_said_in_words(make, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()


def test_a_mesh_of_gmsh_has_the_frequencies_that_calculix_finds_on_it() -> None:
    """Twenty C3D20, an edge clamped by its physical surface; CalculiX 2.20 from its own matrices
    (docs/calculix.md)."""
    held = Model.from_mesh(
        CALCULIX / "gmsh.inp", {"plate": {"material": "STEEL"}}, supports={"clamp": "all"},
        materials={"STEEL": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}},
    )  # fmt: skip
    assert len(held.labels) == 495 and held.groups == {"plate": list(range(1, 21))}
    wanted = [33.4102063, 101.49733156, 216.4647822, 359.32044044, 426.61576555]
    assert held.modes(5).frequencies == pytest.approx(wanted, rel=1e-6)


def test_a_lump_is_found_on_matrices_of_calculix() -> None:
    """Answers of the same matrices with 0.3 kg on a corner, by dense inversion; .sti, .mas and .dof
    as CalculiX wrote them."""
    K_file, M_file = (str(CALCULIX / f"plate.{ending}") for ending in ("sti", "mas"))
    rows = [{"id": 1, "stiffness": K_file, "mass": M_file, "group": "plate"}]
    model = Model.from_problem(
        {
            "model": {
                "dofs": ["x", "y", "z"],
                "elements": [{"type": "matrix", "rows": rows}],
                "damping": {"kind": "modal", "zeta": 0.01},
            }
        }
    )
    K, M = model.K.toarray(), model.M.toarray()
    place = {label: k for k, label in enumerate(model.labels)}
    lumped = M.copy()
    for d in "xyz":
        lumped[place[f"n12.{d}"], place[f"n12.{d}"]] += 0.3
    # internal motions of the bricks have no mass: modes of unit strain energy, 1/ω² beside them
    soft, phi = scipy.linalg.eigh(lumped, K)
    soft, f = np.maximum(soft, 0.0), np.arange(200.0, 3000.0, 4.0)
    sensors, drives = ["n3.z", "n9.y", "n11.z", "n12.z"], ["n9.z", "n6.z"]
    s = 2j * np.pi * f[:, None]
    recordings = []
    for use, drive, seed in zip(("fit", "hold-out"), drives, (1, 2), strict=True):
        shapes = phi[[place[x] for x in sensors]] * phi[place[drive]]
        H = s**2 * ((1.0 / (1.0 + 0.02 * s * np.sqrt(soft) + s**2 * soft)) @ shapes.T)
        noise, rng = 0.002 * np.abs(H), np.random.default_rng(seed)
        H = H + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
        frf = Frf(f, H, sensors, [drive], quantity="acceleration", variance=2 * noise**2, use=use)
        recordings.append(frf)
    found = diagnose(model, recordings)
    (first,) = found.findings
    assert first.physics == "added_mass" and first.place.nodes == (12,)
    assert first.parameters["m"] == pytest.approx(0.3, rel=0.02)

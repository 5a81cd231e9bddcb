"""Contract of every element type: symmetry, definiteness, rigid-body motion, patch tests, mass."""

from typing import get_args

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.registry import ELEMENTS
from cvxupdate.spec.elements import row_model
from tests.cases.elements import (
    ALLOY,
    CASES,
    FLAT_Y,
    SECTIONS,
    SPACE,
    STEEL,
    Case,
    build,
    chain,
    grid,
    joined,
    lines,
    with_values,
)

EVERY = pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
AREA = {"bar": 0.1 * 0.012, "general": 6.0e-4}
IY = {"bar": 0.1 * 0.012**3 / 12, "general": 5.0e-8}
IZ = {"bar": 0.012 * 0.1**3 / 12, "general": 2.0e-8}


def own_blocks(case: Case, **values: float) -> list[Block]:
    return [b for b in case.build(**values).blocks if b.kind.name == case.name.split()[0]]


def element_matrices(block: Block) -> dict[str, np.ndarray]:
    return block.combine(block.scalars(block.properties))


def test_every_element_type_has_a_case() -> None:
    """Over the registry; matrices from another program bring no geometry, and have their contract
    in test_matrix_element.py."""
    assert set(ELEMENTS.names()) - {c.name.split()[0] for c in CASES} == {"matrix"}


@pytest.mark.parametrize("kind", ELEMENTS.members(), ids=lambda k: k.name)
def test_an_element_type_says_what_its_rows_and_its_matrices_need(kind: type) -> None:
    """Its block knows its word, and what a parameter may change is one of its properties, a factor
    that every element has, a dimension of its sections or the I of a beam."""
    assert kind.name in ELEMENTS.names()
    assert kind.name in get_args(kind.text.block.model_fields["type"].annotation)
    blocks = [b for c in CASES for b in c.build().blocks if b.kind.name == kind.name]
    own = {name for block in blocks for name in block.properties}
    sizes = {"height", "width", "diameter", "wall", "A", "Iy", "Iz", "J", "I"}
    assert set(kind.text.changes) <= own | set(COMMON) | sizes
    rows = row_model(kind.text.block).model_fields
    assert {"id", "group"} <= set(rows)


ELASTIC = pytest.mark.parametrize(
    "case", [c for c in CASES if not c.name.startswith("gyroscopic")], ids=lambda c: c.name
)


@ELASTIC
def test_element_matrices_are_symmetric_and_semidefinite(case: Case) -> None:
    for block in own_blocks(case, eta=0.02, alpha=3.0, beta=1e-5):
        for name, batch in element_matrices(block).items():
            size = np.abs(batch).max()
            assert np.abs(batch - batch.transpose(0, 2, 1)).max() <= 1e-13 * size, name
            values = np.linalg.eigvalsh(batch)
            assert values.min() >= -1e-12 * np.abs(values).max(), name


@pytest.mark.parametrize(
    "case", [c for c in CASES if c.name.startswith("gyroscopic")], ids=lambda c: c.name
)
def test_gyroscopic_moments_do_no_work(case: Case) -> None:
    """G = −Gᵀ, and a rigid translation feels nothing."""
    m = case.build().matrices()
    assert abs(m.C + m.C.T).max() <= 1e-15 * abs(m.C).max()
    model = case.build()
    for k in range(3):
        assert np.abs(m.C @ (model.dof_kind == k).astype(float)).max() <= 1e-12 * abs(m.C).max()


def test_a_shaft_turned_as_a_whole_has_the_moment_of_its_angular_momentum() -> None:
    """All of the shaft turning at a rate θ': the forces add up to the moment Ip L Ω (θ' × e) about
    any point, and to no force."""
    ex = np.array([0.4, -0.3, 0.866]) / np.linalg.norm([0.4, -0.3, 0.866])
    along = np.array([0.0, 0.13, 0.5])
    points = along[:, None] * ex + [0.2, 0.1, -0.3]
    text = joined(
        lines("beam3d", points, chain(2), SPACE, "round"),
        {
            "elements": [
                {
                    "type": "gyroscopic",
                    "omega": 250.0,
                    "Ip": 3e-4,
                    "rows": [{"id": 9, "nodes": [1, 2]}, {"id": 10, "nodes": [2, 3]}],
                }
            ]
        },
    )
    C = build(text).matrices().C
    rate = np.array([0.7, -0.2, 1.1])
    motion = np.hstack([np.cross(rate, points), np.tile(rate, (3, 1))])
    force = (C @ motion.ravel()).reshape(-1, 6)
    np.testing.assert_allclose(force[:, :3].sum(axis=0), 0.0, atol=1e-12)
    moment = force[:, 3:].sum(axis=0) + np.cross(points, force[:, :3]).sum(axis=0)
    np.testing.assert_allclose(moment, 3e-4 * 0.5 * 250.0 * np.cross(rate, ex), atol=1e-12)


def test_a_disc_whirls_at_the_frequencies_of_the_textbook() -> None:
    """A disc on an isotropic angular spring, Friswell et al. (2010) 3.5: s² Id + i s Ip Ω + k = 0
    for θy + i θz; forward and backward whirl."""
    k, Id, Ip, omega = 900.0, 0.05, 0.09, 120.0
    text = {
        "dofs": ["ry", "rz"],
        "nodes": [{"id": 1, "x": 0.0}],
        "elements": [
            {"type": "spring", "dofs": ["ry", "rz"], "rows": [{"id": 1, "nodes": [1], "k": k}]},
            {"type": "mass", "rows": [{"id": 2, "nodes": [1], "m": 0.0, "Iyy": Id, "Izz": Id}]},
            {
                "type": "gyroscopic",
                "rows": [
                    {"id": 3, "nodes": [1], "Ip": Ip, "omega": omega, "axis": [1.0, 0.0, 0.0]}
                ],
            },
        ],
    }
    m = build(text).matrices()
    K, M, C = (np.asarray(x.todense()) for x in (m.K, m.M, m.C))
    state = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]
    )
    found = np.sort(np.abs(np.linalg.eigvals(state).imag))[[0, 2]]
    h = Ip * omega / (2 * Id)
    np.testing.assert_allclose(
        found, [np.sqrt(h**2 + k / Id) - h, np.sqrt(h**2 + k / Id) + h], rtol=1e-12
    )
    s = np.linalg.eig(state)
    forward = int(
        np.argmax(s[0].imag)
    )  # the faster whirl goes the way of the spin: θz is a quarter turn behind θy
    assert (s[1][1, forward] / s[1][0, forward] * 1j).real == pytest.approx(1.0)


@ELASTIC
def test_global_matrices_are_symmetric(case: Case) -> None:
    m = case.build(eta=0.02, alpha=3.0, beta=1e-5).matrices()
    for A in (m.K, m.M, m.C, m.D):
        assert abs(A - A.T).max() <= 1e-13 * (abs(A).max() or 1.0)


@EVERY
def test_rank_of_element_matrices(case: Case) -> None:
    """A single element resists everything but its rigid-body motion (and what it has no stiffness
    for, a rod's swing)."""
    main = {"dashpot": "C", "mass": "M", "gyroscopic": "none"}.get(case.name.split()[0], "K")
    for block in own_blocks(case):
        matrices = element_matrices(block)
        if main in matrices:
            assert set(_ranks(matrices[main])) == {
                len(matrices[main][0])
                - (case.null if main == "K" else 0 if main == "M" else _loose(block))
            }
        if "M" in matrices:
            assert set(_ranks(matrices["M"])) == {case.mass_rank}


def _loose(block: Block) -> int:
    return block.kind.nodes - 1


def _ranks(batch: np.ndarray) -> list[int]:
    """Ranks after scaling each DOF to a unit diagonal, so that metres and radians count alike."""
    d = np.sqrt(np.einsum("eii->ei", batch))
    d[d == 0.0] = 1.0
    values = np.linalg.eigvalsh(batch / d[:, :, None] / d[:, None, :])
    return [int(n) for n in np.sum(values > 1e-11, axis=1)]


@pytest.mark.parametrize(
    "case",
    [
        c
        for c in CASES
        if c.null and not c.name.startswith(("dashpot", "gyroscopic")) and c.name != "mass"
    ],
    ids=lambda c: c.name,
)
def test_rigid_motion_takes_no_energy(case: Case) -> None:
    model = case.build()
    m = model.matrices()
    R = rigid_body_modes(model, m.K, m.M)
    expected = {"plate": 3, "beam2d": 3, "spring": 1}.get(case.name.split()[0], 6)
    expected = 3 if case.name == "shell flat" else expected
    assert R.shape[1] == expected
    assert np.allclose(R.T @ (m.M @ R), np.eye(expected), atol=1e-10)
    assert np.abs(m.K @ R).max() <= 1e-9 * np.abs(m.K).max() * np.abs(R).max()


@pytest.mark.parametrize("lumped", [False, True])
def test_rod_patch(lumped: bool) -> None:
    """A constant strain over unequal elements: no force inside, the energy ½ E A ε² L."""
    direction = np.array([0.4, -0.3, 0.866])
    direction /= np.linalg.norm(direction)
    along = np.array([0.0, 0.13, 0.5, 0.62, 1.0])
    model = build(
        lines(
            "rod",
            along[:, None] * direction,
            chain(4),
            "xyz",
            "bar",
            mass="lumped" if lumped else "consistent",
        )
    )
    K = model.matrices().K
    u = 1e-3 * (along[:, None] * direction).ravel()
    force = (K @ u).reshape(-1, 3)
    assert np.abs(force[1:-1]).max() <= 1e-10 * np.abs(force[0]).max()
    assert u @ K @ u == pytest.approx(STEEL["E"] * AREA["bar"] * 1e-6, rel=1e-12)


BENT = {"bending about y": ("Iy", 2), "bending about z": ("Iz", 1)}


@pytest.mark.parametrize("shear", [0.0, 1.0])
@pytest.mark.parametrize("axis", BENT)
@pytest.mark.parametrize("section", ["bar", "general"])
def test_beam_patch_constant_curvature(axis: str, section: str, shear: float) -> None:
    """w = ½ κ s²: end moments only, energy ½ E I κ² L, in an oblique beam with an orientation
    vector."""
    along = np.array([0.0, 0.13, 0.5, 0.62, 1.0])
    ex = np.array([0.4, -0.3, 0.866]) / np.linalg.norm([0.4, -0.3, 0.866])
    v = np.array([0.3, 1.0, 0.2])
    ey = np.cross(v, ex) / np.linalg.norm(np.cross(v, ex))
    ez = np.cross(ex, ey)
    model = with_values(
        build(lines("beam3d", along[:, None] * ex, chain(4), SPACE, section, orientation=v)),
        shear=shear,
    )
    K = model.matrices().K
    kappa = 1e-3
    if axis == "bending about z":
        move, turn, inertia = ey, ez, IZ[section]
    else:
        move, turn, inertia = ez, -ey, IY[section]
    u = np.hstack([0.5 * kappa * along[:, None] ** 2 * move, kappa * along[:, None] * turn])
    force = (K @ u.ravel()).reshape(-1, 6)
    assert np.abs(force[1:-1]).max() <= 1e-9 * np.abs(force[-1]).max()
    assert u.ravel() @ K @ u.ravel() == pytest.approx(STEEL["E"] * inertia * kappa**2, rel=1e-9)


def test_beam_patch_constant_twist() -> None:
    along = np.array([0.0, 0.13, 0.5, 0.62, 1.0])
    ex = np.array([0.4, -0.3, 0.866]) / np.linalg.norm([0.4, -0.3, 0.866])
    K = build(lines("beam3d", along[:, None] * ex, chain(4), SPACE, "general")).matrices().K
    u = np.hstack([np.zeros((5, 3)), 1e-3 * along[:, None] * ex]).ravel()
    G = STEEL["E"] / 2 / (1 + STEEL["nu"])
    assert u @ K @ u == pytest.approx(G * 1.3e-8 * 1e-6, rel=1e-10)
    assert np.abs((K @ u).reshape(-1, 6)[1:-1]).max() <= 1e-9 * np.abs(K @ u).max()


def test_timoshenko_cantilever_deflection_is_exact() -> None:
    """P L³ / 3 E I + P L / κ G A at the tip, whatever the mesh."""
    along = np.array([0.0, 0.07, 0.31])
    model = with_values(
        build(
            {
                **lines(
                    "beam2d", along[:, None] * [1.0, 0.0, 0.0], chain(2), ["x", "y", "rz"], "bar"
                ),
                "supports": [{"nodes": [1], "dofs": ["x", "y", "rz"]}],
            }
        ),
        shear=1.0,
    )
    K = model.matrices().K.toarray()
    f = np.zeros(model.size)
    f[model.place["n3.y"]] = 1.0
    tip = np.linalg.solve(K, f)[model.place["n3.y"]]
    E, G = STEEL["E"], STEEL["E"] / 2 / (1 + STEEL["nu"])
    assert tip == pytest.approx(
        0.31**3 / 3 / E / IZ["bar"] + 0.31 / (5 / 6 * G * AREA["bar"]), rel=1e-10
    )


def test_preload_energy_of_a_tilted_beam() -> None:
    """N over a slope: ½ N θ² L (no bending)."""
    along = np.array([0.0, 0.13, 0.5, 1.0])
    text = lines("beam3d", along[:, None] * [1.0, 0.0, 0.0], chain(3), SPACE, "bar")
    dK = with_values(build(text), N=5e3).matrices().K - build(text).matrices().K
    for translation, rotation, sign in (("y", "rz", 1.0), ("z", "ry", -1.0)):
        model = build(text)
        u = np.zeros(model.size)
        for i, s in enumerate(along):
            u[model.place[f"n{i + 1}.{translation}"]] = 1e-2 * s
            u[model.place[f"n{i + 1}.{rotation}"]] = sign * 1e-2
        assert u @ dK @ u == pytest.approx(5e3 * 1e-4, rel=1e-8)


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("field", ["x", "y", "both", "twist"])
def test_plate_patch(field: str, turn: int) -> None:
    """Constant curvatures and constant twist over unequal rectangles: no force inside, the energy
    of the plate's definition."""
    kx, ky, kxy = {
        "x": (1.0, 0.0, 0.0),
        "y": (0.0, 1.0, 0.0),
        "both": (0.7, -1.3, 0.0),
        "twist": (0.0, 0.0, 1.0),
    }[field]
    xs, ys = np.array([0.0, 0.11, 0.3, 0.42]), np.array([0.1, 0.27, 0.36, 0.5])
    model = build(grid(xs, ys, "rolled", ALLOY, turn=turn))
    x, y = model.xyz[:, 0], model.xyz[:, 1]
    w = 0.5 * kx * x**2 + 0.5 * ky * y**2 + kxy * x * y
    u = np.stack([w, ky * y + kxy * x, -(kx * x + kxy * y)], axis=1).ravel()  # w, ∂w/∂y, −∂w/∂x
    K = model.matrices().K
    s, nu = SECTIONS["rolled"], ALLOY["nu"]
    D = ALLOY["E"] * s["thickness"] ** 3 / 12 / (1 - nu**2)
    along, across = (
        ("Dx", "Dy") if turn % 2 == 0 else ("Dy", "Dx")
    )  # local x follows the node order
    energy = (
        D
        * (
            s[along] * kx**2
            + s[across] * ky**2
            + 2 * s["D1"] * nu * kx * ky
            + 4 * s["Dxy"] * (1 - nu) / 2 * kxy**2
        )
        * 0.42
        * 0.4
    )
    assert u @ K @ u == pytest.approx(energy, rel=1e-10)
    inside = (x > 0) & (x < 0.42) & (y > 0.1) & (y < 0.5)
    force = (K @ u).reshape(-1, 3)
    assert np.abs(force[inside]).max() <= 1e-9 * np.abs(force).max()


def test_clockwise_plate_is_the_same_plate() -> None:
    """Seen from below, the same sheet (the checks of a problem file ask for one order; other
    callers need not keep to it)."""
    from cvxupdate.fe.elements import Plate

    points = np.array([[[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0], [0, 0.2, 0]]])
    swap = np.array([0, 3, 2, 1])
    places = (swap[:, None] * 3 + np.arange(3)).ravel()
    a = {t.coefficient: t.values[0] for t in Plate().terms(points, np.zeros((1, 3)))}
    b = {t.coefficient: t.values[0] for t in Plate().terms(points[:, swap], np.zeros((1, 3)))}
    for here, there in (("Dx", "Dy"), ("Dy", "Dx"), ("D1", "D1"), ("Dxy", "Dxy"), ("rhoh", "rhoh")):
        assert np.allclose(
            b[there], a[here][np.ix_(places, places)], atol=1e-12 * np.abs(a[here]).max()
        )


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0, 0], [0.3, 0, 0], [0.4, 0.2, 0], [0, 0.2, 0]], "not a rectangle"),
        ([[0.0, 0, 0], [0.3, 0, 0.1], [0.3, 0.2, 0.1], [0, 0.2, 0]], "parallel to the x-y plane"),
    ],
)
def test_bad_plates_are_refused(points: list[list[float]], words: str) -> None:
    from cvxupdate.fe.elements import Plate

    with pytest.raises(ModelError, match=words):
        Plate().terms(np.array([points]), np.zeros((1, 3)))


# ---- mass

VOLUME = {
    "bar": 0.1 * 0.012,
    "upright": 0.008 * 0.03,
    "round": np.pi * 1e-4,
    "tube": np.pi / 4 * (0.04**2 - 0.034**2),
    "general": 6e-4,
}


def volume(corners: np.ndarray, faces: tuple[tuple[int, ...], ...]) -> float:
    """⅓ ∮ x · n dA over faces that are triangles or bilinear, their corners anticlockwise from
    outside."""
    total = 0.0
    for face in faces:
        p = corners[list(face)]
        if len(face) == 3:
            total += np.linalg.det(p) / 6.0
            continue
        for u in 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3):
            for v in 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3):
                at = (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[3] + u * p[2])
                along = (1 - v) * (p[1] - p[0]) + v * (p[2] - p[3])
                across = (1 - u) * (p[3] - p[0]) + u * (p[2] - p[1])
                total += at @ np.cross(along, across) / 12.0
    return float(total)


@EVERY
def test_total_mass(case: Case) -> None:
    """Density times volume, or the lumps, whatever the mass matrix; and what a unit translation
    carries."""
    model, text = case.build(), case.model
    xyz = {n["id"]: np.array([n["x"], n["y"], n["z"]]) for n in text["nodes"]}
    mass = 0.0
    for block in text["elements"]:
        for row in block["rows"]:
            if block["type"] == "mass":
                mass += row["m"]
            elif block["type"] == "plate":
                a, b, _, d = (xyz[n] for n in row["nodes"])
                mass += (
                    text["materials"]["m"]["rho"]
                    * text["sections"]["s"]["thickness"]
                    * np.linalg.norm(b - a)
                    * np.linalg.norm(d - a)
                )
            elif block["type"] == "shell":
                corners = np.array([xyz[n] for n in row["nodes"]])
                area = (
                    np.linalg.norm(
                        np.cross(
                            corners[2] - corners[0],
                            corners[-1 if len(corners) > 3 else 0] - corners[1],
                        )
                    )
                    / 2.0
                )
                mass += text["materials"]["m"]["rho"] * text["sections"]["s"]["thickness"] * area
            elif block["type"] in ("hex8", "hex20", "tet10"):
                faces = ELEMENTS.named(block["type"]).text.faces
                corners = np.array([xyz[n] for n in row["nodes"]])
                mass += text["materials"]["m"]["rho"] * volume(corners, faces)
            elif "section" in block:
                area = next(VOLUME[k] for k, v in SECTIONS.items() if v == text["sections"]["s"])
                mass += (
                    text["materials"]["m"]["rho"]
                    * area
                    * np.linalg.norm(np.diff([xyz[n] for n in row["nodes"]], axis=0))
                )
    assert model.total_mass() == pytest.approx(mass, rel=1e-12)
    for kind in (0, 1, 2):
        u = (model.dof_kind == kind).astype(float)
        if u.any():
            assert u @ model.matrices().M @ u == pytest.approx(mass, rel=1e-10)


def test_total_mass_counts_supports_and_every_type() -> None:
    """Masses at held nodes count; a plate (no x) and its stiffening beams (x, y, z) both count."""
    sheet = {**grid([0.0, 0.2, 0.5], [0.0, 0.3]), "dofs": SPACE}
    beam = lines("beam3d", FLAT_Y, [(1, 2), (2, 3)], SPACE, "round")
    beam["elements"][0].update(material="b", section="b")
    text = joined(sheet, beam)
    text |= {
        "materials": {**sheet["materials"], "b": ALLOY},
        "sections": {**sheet["sections"], "b": SECTIONS["round"]},
        "supports": [{"nodes": [1, 4], "dofs": SPACE}],
    }
    model = build(text)
    assert model.total_mass() == pytest.approx(
        7850 * 0.0025 * 0.15 + 2700 * np.pi * 1e-4 * 0.5, rel=1e-12
    )


def test_torsion_alone_carries_no_mass() -> None:
    model = build(lines("beam3d", FLAT_Y * [1, 0, 0], chain(3), ["rx"], "round"))
    assert model.total_mass() == 0.0


def test_rod_in_a_frame_has_no_rotations_of_its_own() -> None:
    """A lump without inertia brings no rotational DOF, so a truss with lumps works with all six
    kinds active."""
    text = lines(
        "rod",
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [(1, 2), (1, 3), (1, 4)],
        SPACE,
        "round",
    )
    text["elements"].append({"type": "mass", "rows": [{"id": 9, "nodes": [1], "m": 4.0}]})
    text["supports"] = [{"nodes": [2, 3, 4], "dofs": ["x", "y", "z"]}]
    model = build(text)
    assert model.labels == ("n1.x", "n1.y", "n1.z")
    assert model_modes(model, 3).rigid == 0


def test_shear_coefficients() -> None:
    """Cowper: 6 (1 + ν) / (7 + 6 ν) of a round bar, 2 (1 + ν) / (4 + 3 ν) of a thin tube; 5/6
    otherwise."""
    nu = STEEL["nu"]
    thin = {"shape": "circle", "diameter": 0.1, "wall": 1e-6}
    for section, kappa in (
        ("round", 6 * (1 + nu) / (7 + 6 * nu)),
        (thin, 2 * (1 + nu) / (4 + 3 * nu)),
        ("bar", 5 / 6),
        ("general", 5 / 6),
    ):
        model = build(lines("beam3d", FLAT_Y, chain(3), SPACE, section))
        assert np.allclose(model.blocks[0].properties["kappa"], kappa, rtol=1e-4)


def test_small_elements_beside_large_ones_keep_their_own_matrices() -> None:
    """Equal shapes share their matrices, but only when they are equal on their own scale."""
    x = np.cumsum([0.0, 1e-3, 1e-3 * (1 + 1e-7), 50.0, 50.0])
    model = build(lines("rod", x[:, None] * [1.0, 0, 0], chain(4), ["x"]))
    K = model.matrices().K.toarray()
    assert np.allclose(-np.diag(K, 1), STEEL["E"] * AREA["bar"] / np.diff(x), rtol=1e-12)
    assert len(model.blocks[0].terms[0].values) == 3

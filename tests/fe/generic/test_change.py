"""Families in a model: through the problem file, into K, M, C and D, their derivatives, wherever
the structure stands."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cvxupdate.errors import ModelError
from cvxupdate.fe.generic.pieces import pieces_of
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.parameters import Parameter
from tests.cases.elements import POINTS, SPACE, build, grid, held, lines, sheet

RECORDING = [{"kind": "modes", "rows": [{"frequency": 1.0}]}]


def generic(text: dict[str, Any], *rows: dict[str, Any], folder: Path | None = None) -> Model:
    parameters = [{"elements": "all", "of": "generic", **row} for row in rows]
    update = {"method": "frequencies", "parameters": parameters}
    return build(text, folder, update=update, recordings=RECORDING)


def random_p(model: Model, size: float = 0.1) -> np.ndarray:
    return np.random.default_rng(4).uniform(-size, size, len(model.parameters))


def plates(**more: Any) -> dict[str, Any]:
    return grid([0.0, 0.1, 0.17], [0.0, 0.08, 0.15], **more)


def test_names_units_and_values_of_one_element() -> None:
    model = generic(plates(), {"elements": [2], "family": {"matrices": ["K"]}})
    use = model.families[0]
    assert use.columns[:2] == ("e2.K[1,1]", "e2.K[1,5]") and use.elements == (2,)
    first, beside = model.parameters[:2]
    assert first.physical(0.0) == pytest.approx(use.families[0].values[0]) and first.unit == "N/m"
    assert beside.physical(0.0) == 0.0
    X = use.families[0].relative(np.eye(len(use.columns))[1] * 0.3)
    sizes = use.families[0].sizes
    assert beside.physical(0.3) == pytest.approx(sizes[0] * X[0, 4] * sizes[4])


@pytest.mark.parametrize("each", [None, "element", "group"])
def test_the_matrices_are_those_of_the_members(each: str | None) -> None:
    """Element by element, V D (N + P) D Vᵀ of its own modes; derivatives are exact and constant."""
    model = generic(plates(), {} if each is None else {"each": each})
    plain = build(plates())
    p = random_p(model)
    pieces = pieces_of(plain, frozenset({1, 2, 3, 4}), [])
    assert len(model.families) == {None: 2, "element": 8, "group": 4}[each]
    full = {name: np.zeros((model.size, model.size)) for name in "KM"}
    number = {name: i for i, name in enumerate(q.name for q in model.parameters)}
    for use in model.families:
        own = p[[number[c] for c in use.columns]]
        for e in use.elements:
            q = pieces[e]
            family = next(
                f
                for f in use.families
                if np.allclose(f.member(np.diag(f.values)), getattr(q, use.matrix), rtol=1e-9)
            )
            X = family.sizes[:, None] * family.relative(own) * family.sizes
            full[use.matrix][np.ix_(q.dofs, q.dofs)] += family.member(X)
    m = model.matrices(p)
    for name in "KM":
        got = getattr(m, name).toarray()
        np.testing.assert_allclose(got, full[name], atol=1e-9 * np.abs(got).max())
    for j in range(0, len(p), 7):
        step = np.zeros(len(p), dtype=complex)
        step[j] = 1e-30j
        d = np.zeros((model.size, model.size))
        for b in model.derivative(j, p):
            for block, dofs in zip(b.K if b.K is not None else b.M, b.dofs, strict=True):  # type: ignore[arg-type]
                d[np.ix_(dofs, dofs)] += block
        by_step = model.matrices(p + step)
        A = by_step.K if "K[" in model.parameters[j].name else by_step.M
        np.testing.assert_allclose(d, A.toarray().imag / 1e-30, atol=1e-9 * np.abs(d).max())


def test_loss_goes_along_with_the_stiffness() -> None:
    text = held(plates(), ([1, 2], ["z", "rx", "ry"]))
    model = generic({**text, "damping": {"kind": "structural", "eta": 0.03}}, {"each": "element"})
    m = model.matrices(random_p(model))
    assert abs(m.D - 0.03 * m.K).max() <= 1e-12 * abs(m.K).max()


def test_a_turned_structure_has_the_same_frequencies_at_the_same_entries() -> None:
    """Classes and signs belong to the element, not to the axes: unlike elements of one macro family
    too."""
    turn = Rotation.from_euler("xyz", (0.4, -1.1, 0.8))
    section = {"shape": "rectangle", "width": 0.02, "height": 0.012}
    found = []
    for points, v in (
        (POINTS, np.array([0.3, -0.9, 0.4])),
        (turn.apply(POINTS), turn.apply([0.3, -0.9, 0.4])),
    ):
        text = lines("beam3d", points, [(1, 2), (2, 3), (3, 4)], SPACE, section, orientation=v)
        model = generic(text, {"family": {"classes": "symmetry"}})
        assert {len(u.families) for u in model.families} == {3}
        found.append(model_modes(model, 6, random_p(model, 0.05)).flexible().eigenvalues)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7)


def test_plates_that_start_at_another_corner_share_one_family() -> None:
    """A square's local axes turn with its first node, and so do its modes."""
    found = []
    for corner in (0, 2):
        model = generic(grid([0.0, 0.1, 0.2], [0.0, 0.1, 0.2], turn=corner), {})
        found.append(model_modes(model, 5, random_p(model, 0.05)).flexible().eigenvalues)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


def test_the_beam_has_eight_parameters_or_nine() -> None:
    """7.7.4 counts 8, (7.20) and table 7.1 have x₁₂ too, which the mirror at mid-length forbids:
    the first is the default, the second takes a row for each matrix. At x₁₂ = 0 they are one."""
    text = lines("beam2d", POINTS[:3] * [1.0, 0.0, 0.0], [(1, 2), (2, 3)], ["z", "ry"])
    eight = generic(text, {})
    nine = generic(
        text,
        {"name": "k", "family": {"matrices": ["K"], "classes": "none"}},
        {"name": "m", "family": {"matrices": ["M"]}},
    )
    names = [[q.name.split(".")[1] for q in model.parameters] for model in (eight, nine)]
    assert len(names[0]) == 8 and sorted(set(names[1]) - set(names[0])) == ["K[1,2]"]
    p = dict(zip(names[0], random_p(eight).tolist(), strict=True))
    a = eight.matrices(np.array(list(p.values())))
    b = nine.matrices(np.array([p.get(name, 0.0) for name in names[1]]))
    for name in "KM":
        full = getattr(a, name).toarray()
        np.testing.assert_allclose(
            getattr(b, name).toarray(), full, atol=1e-12 * np.abs(full).max()
        )


@pytest.mark.parametrize("places", [True, False], ids=["with places", "without"])
def test_an_imported_matrix_has_a_family(places: bool, tmp_path: Path) -> None:
    """7.6: known by its numbers alone. The same classes by its places or by its own modes, held
    DOFs included; rotations without places are as they came."""
    source = build(grid([0.0, 0.1], [0.0, 0.07]))
    m = source.matrices()
    np.savez(tmp_path / "e.npz", K=m.K.toarray(), M=m.M.toarray())
    row = {"id": 1, "stiffness": "K", "mass": "M", "file": "e.npz", "labels": list(source.labels)}
    text = {
        "dofs": ["z", "rx", "ry"],
        "nodes": grid([0.0, 0.1], [0.0, 0.07])["nodes"] if places else [],
        "elements": [{"type": "matrix", "rows": [row]}],
        "supports": [{"nodes": [1], "dofs": ["z"]}] if places else [],
    }
    model = generic(text, {}, folder=tmp_path)
    K, M = (use.families[0] for use in model.families)
    assert sorted(len(c) for c in K.classes) == [2, 2, 2, 3] and K.rigid == 3
    assert [len(c) for c in M.classes] == [3, 3, 3, 3]
    if places:
        drawn = generic(held(grid([0.0, 0.1], [0.0, 0.07]), ([1], ["z"])), {})
        p = random_p(model)
        for name in "KM":
            a, b = (getattr(x.matrices(p), name).toarray() for x in (model, drawn))
            np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(a).max())


def test_what_cannot_share_a_family_is_said() -> None:
    sides = sheet(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0)], [[0, 1, 2, 3], [1, 4, 2]]
    )
    with pytest.raises(ModelError, match='use each = "element"'):
        generic(sides, {})
    with pytest.raises(ModelError, match="element 1 is in two families, e1.K and odd.K"):
        generic(plates(), {"elements": [1]}, {"elements": [1, 2], "name": "odd"})


def test_bounds_and_other_parameters_stay(tmp_path: Path) -> None:
    model = generic(
        plates(), {"lower": -0.4, "upper": 0.6}, {"of": "E", "elements": "all", "name": "E"}
    )
    own = [q for q in model.parameters if q.of == "generic"]
    assert {(q.lower, q.upper) for q in own} == {(-0.4, 0.6)}
    assert isinstance(model.parameters[0], Parameter) and model.parameters[0].of == "E"
    assert replace(model, parameters=()).families == model.families

"""Changes that no recording can see: closed forms of beams and plates, and what `run` says."""

import numpy as np
import pytest

from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import select_parameters
from cvxupdate.system import LinearSystem
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.invisible import invisible
from tests.cases.elements import SPACE, STEEL, build, chain, grid, lines
from tests.fe.test_derivatives import Wanted

POINTS = [(0.0, 0.0, 0.0), (0.5, 0.1, 0.2), (0.7, 0.6, 0.4), (1.3, 0.7, 0.1)]
OWN = {"E": 207e9, "G": 79.6e9, "rho": 7850.0}


def plate(*words: str, elements: tuple[int, ...] = (1, 2)) -> Model:
    model = build(grid([0.0, 0.11, 0.3], [0.0, 0.17, 0.26]))
    wanted = [Wanted(f"e{e}.{w}", w, (e,)) for e in elements for w in words]
    return model.with_parameters(select_parameters(wanted, model))


def beams(
    material: dict[str, float],
    section: str,
    *words: str,
    polar: str = "Iy+Iz",
    kind: str = "beam3d",
) -> Model:
    model = build(lines(kind, POINTS, chain(3), SPACE, section, material, polar_inertia=polar))
    return model.with_parameters(select_parameters([Wanted(w, w) for w in words], model))


@pytest.mark.parametrize("at", [0.0, 0.2])
def test_a_plate_sees_three_of_its_four(at: float) -> None:
    """K sees E h³ and nu, M rho h (8.4): one direction an element, whatever the parameters are."""
    model = plate("thickness", "E", "rho", "nu")
    found = invisible(model, np.full(8, at))
    assert [np.flatnonzero(f.direction).tolist() for f in found] == [[0, 1, 2], [4, 5, 6]]
    for f in found:
        part = f.direction[f.direction != 0.0]
        assert np.allclose(part / part[0], [1.0, -3.0, -1.0], atol=1e-9)
    says = {f.says.split(" change")[0] for f in found}
    assert says == {f"e{e}.thickness × t, e{e}.E ÷ t³ and e{e}.rho ÷ t" for e in (1, 2)}


@pytest.mark.parametrize("kind", ["beam3d", "exact_beam"])
def test_a_beam_by_its_section_and_its_material(kind: str) -> None:
    """E, G, rho × t with A, I, J ÷ t (8.2): with the inertia rho J of the thesis in one piece, with
    rho (Iy + Iz) the product G J by itself. By drawn dimensions nothing is free."""
    words = ("E", "G", "rho", "A", "I", "J")
    (thesis,) = (
        invisible(m, m.zero()) for m in (beams(OWN, "general", *words, polar="J", kind=kind),)
    )
    assert len(thesis) == 1
    part = thesis[0].direction
    assert np.allclose(part, np.array([1, 1, 1, -1, -1, -1.0]) * part[0])
    model = beams(OWN, "general", *words, kind=kind)
    says = [f.says.split(" change")[0] for f in invisible(model, model.zero())]
    assert says == ["E × t, rho × t, A ÷ t and I ÷ t", "G × t and J ÷ t"]
    drawn = beams(OWN, "bar", "E", "G", "rho", "width", "height", kind=kind)
    assert invisible(drawn, drawn.zero()) == ()


def test_matrices_stay_along_what_is_invisible() -> None:
    """To second order in the step nothing moves, and a shorter step moves a quarter."""
    model = plate("thickness", "E", "rho", "nu", elements=(1,))
    (found,) = invisible(model, model.zero())
    moved = []
    for step in (1e-3, 5e-4):
        there, here = model.matrices(step * found.direction), model.matrices()
        moved.append(max(abs(there.K - here.K).max() / abs(here.K).max(), 0.0))
    assert moved[0] < 1e-4
    assert np.isclose(moved[0] / moved[1], 4.0, rtol=0.02)


def test_an_own_g_leaves_torsion_to_itself() -> None:
    """With a G of its own, E moves no torsion; without, G follows and nu is a parameter."""
    for material, moves in ((OWN, 0.0), (STEEL, 0.1)):
        model = build(lines("beam3d", [(0, 0, 0), (1, 0, 0)], [(1, 2)], SPACE, "bar", material))
        words = ("E", "G") if material is OWN else ("E",)
        model = model.with_parameters(select_parameters([Wanted(w, w) for w in words], model))
        bending, torsion = model.place["n1.z"], model.place["n1.rx"]
        before = model.matrices().K.diagonal()
        after = model.matrices(np.array([0.1, 0.0])[: len(words)]).K.diagonal()
        assert np.isclose(after[bending] / before[bending], 1.1)
        assert np.isclose(after[torsion] / before[torsion], 1.0 + moves)
        if material is OWN:
            both = model.matrices(np.array([0.1, 0.1])).K.diagonal()
            assert np.allclose(both / before, 1.1)


def test_polar_inertia_is_a_choice() -> None:
    """rho J against rho (Iy + Iz): the ratio of a strip 100 × 10 mm is 27 in J; that of a round bar
    is 1."""
    sections = {"strip": {"shape": "rectangle", "width": 0.01, "height": 0.1}, "round": "round"}
    ratio = {}
    for name, section in sections.items():
        model = build(lines("beam3d", [(0, 0, 0), (1, 0, 0)], [(1, 2)], SPACE, section))
        thesis = build(
            lines("beam3d", [(0, 0, 0), (1, 0, 0)], [(1, 2)], SPACE, section, polar_inertia="J")
        )
        at = model.place["n1.rx"]
        ratio[name] = model.matrices().M[at, at] / thesis.matrices().M[at, at]
    b, h = 0.01, 0.1
    J = h * b**3 * (1 / 3 - 0.21 * (b / h) * (1 - (b / h) ** 4 / 12))
    assert np.isclose(ratio["strip"], (b * h**3 + h * b**3) / 12 / J, rtol=1e-12)
    assert 26 < ratio["strip"] < 28
    assert np.isclose(ratio["round"], 1.0)


def test_what_is_open_is_named_before_what_is_mixed() -> None:
    """The invisible part of the null space in its own sentence, what is left of it beside."""
    model = plate("thickness", "E", "rho", "nu", elements=(1,))
    silent = invisible(model, model.zero())
    rng = np.random.default_rng(3)
    known = rng.standard_normal((9, 4))
    d = silent[0].direction / np.linalg.norm(silent[0].direction)
    A = known - np.outer(known @ d, d)
    extra = np.array([0.0, 0.0, 0.0, 1.0])
    A -= np.outer(A @ extra, extra)  # nu is not seen either, by these recordings
    parameters: tuple[Parameter, ...] = model.parameters
    s = LinearSystem(A, np.zeros(9), np.ones(9), tuple(p.name for p in parameters), ("r",) * 9)
    u = uncertainty(s, np.zeros(4), parameters, np.zeros((0, 4)), False, silent)
    first, second = u.undetermined[:2]
    assert first.says == silent[0].says and not np.isfinite(first.std)
    assert [name for name, _ in second.coefficients] == ["e1.nu"]
    assert "not determined by these recordings" in second.says

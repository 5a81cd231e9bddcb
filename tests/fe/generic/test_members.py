"""Members of families that a model already has: written, read again, used on another structure."""

from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.generic.members import member_rows
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from tests.cases.elements import build, grid
from tests.cases.structures import measured, structure
from tests.fe.generic.test_change import generic, plates, random_p


def rows_at(model: Model, p: np.ndarray) -> list[dict[str, Any]]:
    return member_rows(
        model.families, dict(zip((q.name for q in model.parameters), p, strict=True))
    )


def matrices(model: Model, p: np.ndarray | None = None) -> dict[str, np.ndarray]:
    m = model.matrices(p)
    return {name: getattr(m, name).toarray() for name in "KMD"}


@pytest.mark.parametrize(
    ("classes", "each"),
    [("symmetry", None), ("diagonal", None), ("none", None)]
    + [(c, "element") for c in ("symmetry", "diagonal", "own", "none")],
)
def test_what_is_written_is_what_was_found(classes: str, each: str | None) -> None:
    """K, M and D of a model at p, and of the file with its families as rows: of one family that
    unlike elements share, and of one for each."""
    text = {**plates(), "damping": {"kind": "structural", "eta": 0.02}}
    row: dict[str, Any] = {"family": {"classes": classes}}
    model = generic(text, row | ({} if each is None else {"each": each}))
    p = random_p(model, 0.05)
    again = build({**text, "families": rows_at(model, p)})
    for name, A in matrices(model, p).items():
        np.testing.assert_allclose(
            matrices(again)[name], A, rtol=1e-9, atol=1e-12 * np.abs(A).max()
        )
    assert again.total_mass() == pytest.approx(model.total_mass(p))


def test_rows_act_one_after_the_other_and_the_next_family_starts_there() -> None:
    """A second row changes the modes of what the first has left, and so does [update]."""
    first = generic(plates(), {})
    p = random_p(first, 0.05)
    text = {**plates(), "families": rows_at(first, p)}
    second = generic(text, {})
    assert second.families[0].families[0].values != pytest.approx(
        first.families[0].families[0].values, rel=1e-3
    )
    for name, A in matrices(second).items():
        np.testing.assert_allclose(A, matrices(first, p)[name], atol=1e-9 * np.abs(A).max())
    q = random_p(second, 0.05)[::-1].copy()
    rows = [*text["families"], *rows_at(second, q)]
    both = build({**text, "families": rows})
    for name, A in matrices(second, q).items():
        np.testing.assert_allclose(matrices(both)[name], A, atol=1e-9 * np.abs(A).max())


def test_a_member_goes_to_similar_elements_of_another_size_and_thickness() -> None:
    """Bending: frequencies scale by t / a², of the nominal plate and of the changed one."""
    found = generic(grid([0.0, 0.1, 0.2], [0.0, 0.1, 0.2]), {})
    rows = rows_at(found, random_p(found, 0.05))
    small, large = (
        build({**grid([0.0, a, 2 * a], [0.0, a, 2 * a]), "families": rows}) for a in (0.1, 0.25)
    )
    f, g = (model_modes(m, 7).flexible().frequencies[:4] for m in (small, large))
    np.testing.assert_allclose(g, f / 2.5**2, rtol=1e-8)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"K": [[3, 2, 0.1]]}, r"\[3, 2\] of K is none of 1 ≤ i ≤ j ≤ 9"),
        ({"K": [[1, 10, 0.1]]}, "the 9 modes once"),
        ({"M": [[1, 1, 0.0], [1, 1, 0.2]]}, "stands twice"),
        ({"K": [[2, 2, -1.5]]}, "no structure"),
    ],
)
def test_a_change_that_makes_no_structure_is_said(row: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=r"model\.families\[0\].*" + words):
        build({**plates(), "families": [{"elements": "all", **row}]})


def test_no_diagnosis_of_elements_that_a_family_changed() -> None:
    families = [{"elements": "all", "K": [[1, 1, 0.1]]}]
    spec, model = structure(
        {**plates(), "families": families}, [{"elements": "all", "of": "generic"}]
    )
    table = measured(model, model.zero(), range(1, 3))
    with pytest.raises(InputError, match=r"model\.families: diagnose works on elements"):
        gathered(spec, model, [table], lambda _: None)

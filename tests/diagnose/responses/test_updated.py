"""What a file has words for of the theory that a diagnosis fitted beside the groups."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.mesh import NONE
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.theory import GROUP
from cvxupdate.diagnose.nominal.written import sayable, solid_of
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.responses.updated import updated_model
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem
from cvxupdate.spec.write import to_toml
from tests.fe.analysis.test_corners import portal


@pytest.fixture
def fitted(tmp_path):
    """A portal's model with sizes of shear, rotary inertia and corners; what is written of it."""
    spec = portal(tmp_path, 0.0)
    model = with_nuisance(build_model(spec), theory=("shear", "rotary"))

    def at(**sizes):
        p = model.zero()
        for j, q in enumerate(model.parameters):
            if q.group == GROUP and q.of in sizes:
                p[j] = sizes[q.of]
        point = SimpleNamespace(
            p=p,
            setting=SimpleNamespace(model=model, faults=(), mesh=NONE, top=1e4),
            fault_values=(),
            damping=np.full(4, 0.01),
            modes=SimpleNamespace(rigid=0),
            loss=SimpleNamespace(hysteretic=0.0),
        )
        updated = updated_model(point)
        written = problem_file(spec, updated)
        path = tmp_path / "updated.toml"
        path.write_text(to_toml(written.tables, written.head), encoding="utf-8")
        again = build_model(load_problem(path))
        return updated, model_modes(model, 4, p).frequencies, model_modes(again, 4).frequencies

    return at


def test_shear_and_rotary_inertia_are_in_the_file(fitted):
    """Its frequencies are those of the diagnosis."""
    for sizes in ({"shear": 0.4}, {"rotary": -1.0}, {"shear": 0.8, "rotary": -1.0}):
        updated, wanted, found = fitted(**sizes)
        np.testing.assert_allclose(found, wanted, rtol=1e-9)
        assert updated.notes == ()
    assert abs(fitted()[1] / wanted - 1.0).max() > 1e-4, "they matter"


def test_what_the_file_has_no_word_for_is_said(fitted):
    (note,) = fitted(rotary=-0.4)[0].notes
    assert "0.60 of what sections have; this file has all of it" in note
    assert fitted(shear=0.01, rotary=-0.01)[0].notes == ()
    corner = SimpleNamespace(group=GROUP, of="corner")
    model = SimpleNamespace(parameters=(corner,), with_parameters=lambda kept: kept)
    kept, p, (note,) = sayable(model, np.array([0.7]))
    assert kept == () and p.size == 0
    assert note.startswith("Members were fitted as stiffer where they meet")
    assert sayable(model, np.array([0.01]))[2] == []


@pytest.mark.parametrize(
    ("lag", "turning", "wanted"),
    [(0.0, 0.0, True), (-0.97, -1.0, False), (-1.0, 0.0, "turning"), (-0.04, -0.98, "sheared")],
)
def test_sheets_are_written_with_the_parts_of_their_theory_that_were_fitted(lag, turning, wanted):
    def of(word, lower=-1.0):
        return SimpleNamespace(group=GROUP, of=word, lower=lower)

    model = SimpleNamespace(parameters=(of("lag"), of("clamp", 0.0), of("turning")))
    assert solid_of(model, np.array([lag, 0.3, turning])) == (wanted, [])
    half, (note,) = solid_of(model, np.array([lag, 0.3, -0.4]))
    assert half in (True, "turning")
    assert note.startswith("Rotary inertia of sheets was fitted as 0.60") and "has all" in note
    assert solid_of(SimpleNamespace(parameters=()), np.zeros(0)) == (True, [])

"""CONTRIBUTING's recipes, tried: a part from outside the package enters through its registry and is
used in a problem file from end to end. Each is one class in one file; nothing of the package is
touched."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import cvxupdate
from cvxupdate.convex import compare_solvers, solve_step
from cvxupdate.errors import InputError, ProblemFileError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.registry import CONSTRAINTS, ELEMENTS, READERS, REGULARISERS, Registry
from cvxupdate.spec import check_problem, load_problem, schema
from cvxupdate.update.parts import step_problem
from tests.cases import outside
from tests.cases.convex_cases import COLUMNS, system

TENSION, MU, LENGTH, COUNT = 90.0, 0.02, 1.5, 12
TEXT = f"""
[model]
dofs = ["y"]
nodes = [{", ".join(f"{{ id = {i}, x = {LENGTH * i / COUNT} }}" for i in range(COUNT + 1))}]
supports = [{{ nodes = [0, {COUNT}], dofs = ["y"] }}]
[[model.elements]]
type = "taut_string"
tension = {TENSION}
line_mass = {MU}
rows = [{
    ", ".join(
        f'{{ id = {i + 1}, nodes = [{i}, {i + 1}], group = "{"left" if i < 5 else "right"}" }}'
        for i in range(COUNT)
    )
}]
"""
FREQUENCY = np.sqrt(TENSION / MU) / (2.0 * LENGTH)
RUN = f"""
[[recordings]]
kind = "modes"
rows = [{{ frequency = {1.02 * FREQUENCY} }}, {{ frequency = {2.05 * FREQUENCY} }}]
[update]
method = "frequencies"
parameters = [{{ elements = "all", of = "tension", each = "group" }}]
"""
PARTS = (
    (ELEMENTS, outside.String),
    (CONSTRAINTS, outside.Balance),
    (REGULARISERS, outside.Quartic),
    (READERS, outside.WORDS),
)


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    for registry, part in PARTS:
        registry.register(part)
    yield
    for registry, part in PARTS:
        registry.unregister(part)


def problem(folder: Path, text: str) -> Path:
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("registry", "part"), PARTS, ids=[r.kind for r, _ in PARTS])
def test_a_part_is_one_file_and_one_line(registry: Registry, part: object) -> None:
    """One file defines it, one call lists it: no other file of the package or of the tests names
    it."""
    assert part in registry.members()
    with pytest.raises(InputError, match="another name"):
        registry.register(part)
    source = Path(inspect.getfile(outside.String))
    root = Path(cvxupdate.__file__).parent
    word = getattr(part, registry.label)
    names = [f'"{word}"', f"class {word}"]
    touched = [p for p in root.rglob("*.py") if any(n in p.read_text("utf-8") for n in names)]
    assert touched == [] and sum(n in source.read_text("utf-8") for n in names) >= 1


def test_a_registered_part_can_be_taken_out(tmp_path: Path) -> None:
    """The grammar follows the registry both ways, and says what it knows."""
    path = problem(tmp_path, TEXT)
    assert check_problem(path) == () and "StringBlock" in schema()["$defs"]
    ELEMENTS.unregister(outside.String)
    (fault,) = check_problem(path)
    assert "unknown type 'taut_string'" in fault.problem and "spring" in fault.remedy
    assert "StringBlock" not in schema()["$defs"]
    ELEMENTS.register(outside.String)


def test_an_element_from_outside_vibrates_and_is_updated(tmp_path: Path) -> None:
    """f_n = n / 2L √(T / μ) of a taut string; a run finds the tension that its frequencies ask
    for."""
    path = problem(tmp_path, TEXT + RUN)
    model = build_model(load_problem(path))
    found = model_modes(model, 3).frequencies
    np.testing.assert_allclose(found, FREQUENCY * np.arange(1, 4), rtol=0.03)
    assert np.all(np.diff(found / np.arange(1, 4)) > 0)  # a consistent mass is too stiff, the more
    updated = cvxupdate.run(path)
    assert updated.status == "converged"
    assert [p.name for p in updated.parameters] == ["left.tension", "right.tension"]
    assert {p.unit for p in updated.parameters} == {"N"}
    fit = updated.fit["fit"]["frequency_error_percent_mean"]
    assert fit["after"] < 0.1 * fit["before"]


def test_an_element_from_outside_is_checked_like_any_other(tmp_path: Path) -> None:
    faults = check_problem(
        problem(tmp_path, TEXT.replace("nodes = [0, 1]", "nodes = [0, 99]") + RUN)
    )
    assert any("node 99, which does not exist" in fault.problem for fault in faults)
    with pytest.raises(ProblemFileError, match="'tensoin'"):
        load_problem(problem(tmp_path, (TEXT + RUN).replace('of = "tension"', 'of = "tensoin"')))


def test_a_constraint_from_outside_holds(tmp_path: Path) -> None:
    path = problem(
        tmp_path,
        TEXT + RUN + '[constraints]\nbalance = [{ between = ["left.tension", "right.tension"] }]\n',
    )
    updated = cvxupdate.run(path)
    left, right = (p.p for p in updated.parameters)
    assert left + right == pytest.approx(0.0, abs=1e-9) and abs(left) > 1e-4
    with pytest.raises(InputError, match=r"constraints\.balance: no parameter is called x"):
        cvxupdate.run(problem(tmp_path, path.read_text().replace("left.tension", "x")))


def test_a_regulariser_from_outside_draws_in(tmp_path: Path) -> None:
    """The heavier the weight, the smaller the change; the certificate holds; its own key counts."""
    path = problem(
        tmp_path,
        TEXT + RUN + '[[regularisation]]\nkind = "quartic"\nweight = 3e9\nsize = 0.5\n',
    )
    spec = load_problem(path)
    made = step_problem(spec, build_model(spec), ())
    assert made.regularisers[0].value(np.array([0.5, 1.0]), made.columns) == pytest.approx(17.0)
    free, held = (cvxupdate.run(problem(tmp_path, text)) for text in (TEXT + RUN, path.read_text()))
    size = [np.linalg.norm([p.p for p in u.parameters]) for u in (free, held)]
    assert size[1] < 0.7 * size[0]
    (fault,) = check_problem(
        problem(tmp_path, path.read_text().replace('kind = "quartic"', 'kind = "l1"'))
    )
    assert "do not apply to kind 'l1'" in fault.problem


def test_the_parts_from_outside_keep_the_contract_of_the_convex_step() -> None:
    from cvxupdate.convex import StepProblem

    toy = StepProblem(
        regularisers=(outside.Quartic(30.0),),
        constraints=(outside.Balance(("a.E", "b.E")),),
        columns=COLUMNS,
    )
    rows = {row.solver: row for row in compare_solvers(toy, system())}
    assert rows["CLARABEL"].certificate.is_optimal(1e-7)
    assert rows["SCS"].objective == pytest.approx(rows["CLARABEL"].objective, rel=1e-7)
    step = solve_step(toy, system())
    assert step.p[0] + step.p[2] == pytest.approx(0.0, abs=1e-9)


def test_a_reader_from_outside_is_inspected_and_run(tmp_path: Path) -> None:
    """Known by its ending, by its first bytes and by its word; cut short it is said."""
    rng = np.random.default_rng(0)
    data = rng.normal(size=(4096, 2))
    path = tmp_path / "a.words"
    lines = [
        f"{name} = {' '.join(map(repr, col))}"
        for name, col in zip("fa", data.T.tolist(), strict=True)
    ]
    path.write_text("\n".join(["WORDS", *lines, "END"]))
    assert inspect_file(path) is not None
    from cvxupdate.recordings.load import load_recordings

    recording = (
        '[[recordings]]\nkind = "time"\nfile = "a.words"\nrate = 100.0\nchannels = ['
        '{ column = "f", quantity = "force", node = 3, dof = "y" }, '
        '{ column = "a", quantity = "acceleration", node = 4, dof = "y" }]\n'
    )
    (loaded,) = load_recordings(load_problem(problem(tmp_path, TEXT + recording)))
    assert loaded is not None and cvxupdate.check(tmp_path / "problem.toml") is not None
    path.rename(tmp_path / "b.dat")
    again = TEXT + recording.replace("a.words", "b.dat").replace("rate", 'format = "words"\nrate')
    (other,) = load_recordings(load_problem(problem(tmp_path, again)))
    assert type(other) is type(loaded)

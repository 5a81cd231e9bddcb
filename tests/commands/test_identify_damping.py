"""Damping to begin with from measured modes (3.44): the matrices have the ratios, a run finds them
again, and a table of modes is enough."""

import json
import re
import tomllib

import numpy as np
import pytest
import scipy.linalg as la

from cvxupdate.commands.identify import identify
from cvxupdate.errors import InputError
from cvxupdate.report.identify_files import identify_files
from cvxupdate.study import open_problem, run

N = 6
K_SPRINGS = np.array([9.0, 6.0, 8.0, 5.0, 7.0, 4.0]) * 1e5
MASSES = np.array([2.0, 1.5, 1.0, 1.7, 0.8, 1.2])
ZETA = np.array([0.01, 0.025, 0.015])


def chain():
    k = K_SPRINGS
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    return K, np.diag(MASSES)


def model():
    nodes = ", ".join(f"{{ id = {i + 1}, x = {i}.0 }}" for i in range(N))
    springs = ", ".join(
        f"{{ id = {i + 1}, nodes = {[1] if i == 0 else [i, i + 1]}, k = {k!r} }}"
        for i, k in enumerate(K_SPRINGS.tolist())
    )
    lumps = ", ".join(
        f"{{ id = {i + 11}, nodes = [{i + 1}], m = {m!r} }}" for i, m in enumerate(MASSES.tolist())
    )
    return (
        f'[model]\ndofs = ["x"]\nnodes = [{nodes}]\n\n[[model.elements]]\ntype = "spring"\n'
        f'dof = "x"\nrows = [{springs}]\n\n[[model.elements]]\ntype = "mass"\nrows = [{lumps}]\n'
    )


def table(channels=range(N), zeta=ZETA):
    values, X = la.eigh(*chain())
    rows = ", ".join(
        f"{{ frequency = {float(np.sqrt(values[r])) / (2 * np.pi)!r}, "
        + (f"damping = {float(z)!r}, " if z > 0 else "")
        + f"shape = {(3.0 * X[list(channels), r]).tolist()} }}"
        for r, z in enumerate(zeta)
    )
    names = ", ".join(
        f'{{ column = {i}, quantity = "displacement", node = {c + 1}, dof = "x" }}'
        for i, c in enumerate(channels)
    )
    return f'\n[[recordings]]\nkind = "modes"\nchannels = [{names}]\nrows = [{rows}]\n'


@pytest.mark.parametrize("places", [range(0), range(N)])
def test_a_table_that_fixes_its_pairs_keeps_them(tmp_path, places):
    """Beside columns of places a number of the mode only counts; pairs have a column of their own,
    and a mode without a partner stays without one."""
    pairs = (2, 0, 1)
    rows = table(places)
    if not places:
        rows = (
            '\n[[recordings]]\nkind = "modes"\nrows = ['
            + ", ".join(
                f"{{ frequency = {f}, damping = 0.01{f', mode = {p}' if p else ''} }}"
                for f, p in zip((30.0, 50.0, 70.0), pairs, strict=True)
            )
            + "]\n"
        )
    else:
        for k, p in reversed(list(enumerate(pairs))):
            at = [m.start() for m in re.finditer("shape = ", rows)][k]
            rows = rows[:at] + (f"mode = {p}, " if p else "") + rows[at:]
    path = tmp_path / "first.toml"
    path.write_text(model() + rows, encoding="utf-8")
    files, text = identify_files(identify(path))
    assert [m["pair"] for m in json.loads(text)["sets"][0]["modes"]] == [*pairs]
    for name, content in files.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    again = tmp_path / "second.toml"
    again.write_text(model() + files["recordings.toml"], encoding="utf-8")
    _, _, (read,) = open_problem(again)
    assert read.pairs.tolist() == [*pairs]


def written(folder, problem):
    """The files of `identify` on a problem's text, in ``folder``."""
    path = folder / "first.toml"
    path.write_text(problem, encoding="utf-8")
    files, _ = identify_files(identify(path))
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return files


@pytest.mark.parametrize("channels", [range(N), (0, 2, 3, 5)])
def test_the_matrices_have_the_measured_ratios(tmp_path, channels):
    """Of all eigenvalues of the damped chain the measured modes have their ratios, the others
    none."""
    files = written(tmp_path, model() + table(channels))
    second = tmp_path / "second.toml"
    second.write_text(model() + files["damping_measured.toml"], encoding="utf-8")
    m = open_problem(second)[1].matrices()
    K, M, C = (np.asarray(A.toarray()) for A in (m.K, m.M, m.C))
    state = np.block([[np.zeros((N, N)), np.eye(N)], [-la.solve(M, K), -la.solve(M, C)]])
    s = la.eigvals(state)
    s = s[s.imag > 0][np.argsort(s.imag[s.imag > 0])]
    wanted = np.append(ZETA, np.zeros(N - 3))
    exact = len(channels) == N
    assert -s.real / np.abs(s) == pytest.approx(wanted, abs=1e-9 if exact else 1e-5)
    assert json.loads(files["result.json"])["sets"][0]["measured_damping"]["coupling"] < 1e-6


def test_the_ratios_are_parameters_that_a_run_finds(tmp_path):
    """Ratios a third off: FRFs bring them back, and the file that is written has them."""
    files = written(tmp_path, model() + table())
    truth = np.array([0.3, -0.2, 0.15])
    values, X = la.eigh(*chain())
    K, M = chain()
    MX = M @ X[:, :3] * np.sqrt(2 * np.sqrt(values[:3]) * ZETA * (1 + truth))
    C = MX @ MX.T
    f = np.linspace(20.0, 220.0, 120)
    w = 2 * np.pi * f
    H = np.array([la.inv(K - v**2 * M + 1j * v * C)[:, [1, 4]] for v in w])
    np.savez(tmp_path / "frf.npz", frequency=f, H=H)
    names = ", ".join(
        f'{{ column = {i}, quantity = "displacement", node = {i + 1}, dof = "x" }}'
        for i in range(N)
    )
    problem = (
        model()
        + files["damping_measured.toml"]
        + f'\n[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nresponse = "displacement"\n'
        f"channels = [{names}]\n"
        'references = [{ node = 2, dof = "x" }, { node = 5, dof = "x" }]\n'
        '\n[update]\nmethod = "rfm"\nfrequency_points = "all"\n'
        'parameters = [{ group = "measured damping", of = "damping", each = "element" }]\n'
    )
    path = tmp_path / "problem.toml"
    path.write_text(problem, encoding="utf-8")
    found = run(path)
    assert [q.p for q in found.parameters] == pytest.approx(truth, abs=1e-6)
    rows = tomllib.loads(found.written.text)["model"]["elements"][-1]["rows"]
    assert [r["damping_factor"] for r in rows] == pytest.approx(1 + truth, abs=1e-6)


def test_a_table_gives_the_damping_of_the_whole_model_as_well(tmp_path):
    files = written(tmp_path, model() + table())
    values = np.sqrt(la.eigvalsh(*chain())[:3])
    damping = tomllib.loads(files["damping.toml"])["model"]["damping"]
    fitted = damping["alpha"] / (2 * values) + damping["beta"] * values / 2
    A = np.column_stack([1 / (2 * values), values / 2])
    # the least squares of (3.43): what is left is orthogonal to both columns, or one is at zero
    left = A.T @ (fitted - ZETA)
    free = np.array([damping["alpha"] > 0, damping["beta"] > 0])
    assert np.abs(left[free]).max() < 1e-4 * np.abs(A.T @ ZETA).max()
    assert "a table of modes" in files["report.html"]


def test_frequencies_and_ratios_alone_are_enough(tmp_path):
    """Without shapes no damping matrices of single modes, but the averages, and a page."""
    rows = ", ".join(f"{{ frequency = {30.0 * k}, damping = 0.0{k} }}" for k in (1, 2))
    text = f'\n[[recordings]]\nkind = "modes"\nrows = [{rows}]\n'
    files = written(tmp_path, model() + text)
    assert "damping_measured.toml" not in files and "frequency,damping" in files["modes.csv"]
    assert tomllib.loads(files["damping.toml"])["model"]["damping"]["kind"] == "rayleigh"
    assert "0.015" in files["damping.toml"] or "eta = 0.03" in files["damping.toml"]


def test_a_table_without_ratios_has_nothing_to_give(tmp_path):
    path = tmp_path / "problem.toml"
    path.write_text(model() + table(zeta=np.zeros(3)), encoding="utf-8")
    with pytest.raises(InputError, match="without damping ratios; there is nothing to identify"):
        identify(path)


@pytest.mark.parametrize("kind", ["spring", "dashpot"])
def test_a_factor_on_damping_is_written(tmp_path, kind):
    """What `run` changes of an element's damping stands in the file that it writes."""
    extra = (
        '\n[[model.elements]]\ntype = "dashpot"\ndof = "x"\n'
        "rows = [{ id = 31, nodes = [3], c = 40.0 }]\n"
        '\n[model.damping]\nkind = "structural"\neta = 0.01\n'
    )
    of = "31" if kind == "dashpot" else "2"
    K, M = chain()
    D = 0.01 * K
    C = np.zeros((N, N))
    C[2, 2] = 40.0 * (1.4 if kind == "dashpot" else 1.0)
    if kind == "spring":
        D[:2, :2] += 0.01 * 0.4 * K_SPRINGS[1] * np.array([[1, -1], [-1, 1]])
    f = np.linspace(20.0, 220.0, 60)
    H = np.array([la.inv(K + 1j * D - v**2 * M + 1j * v * C)[:, [1]] for v in 2 * np.pi * f])
    np.savez(tmp_path / "frf.npz", frequency=f, H=H)
    names = ", ".join(
        f'{{ column = {i}, quantity = "displacement", node = {i + 1}, dof = "x" }}'
        for i in range(N)
    )
    path = tmp_path / "problem.toml"
    path.write_text(
        model()
        + extra
        + f'\n[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nresponse = "displacement"\n'
        f'channels = [{names}]\nreferences = [{{ node = 2, dof = "x" }}]\n'
        '\n[update]\nmethod = "rfm"\nfrequency_points = "all"\n'
        f'parameters = [{{ elements = [{of}], of = "damping" }}]\n',
        encoding="utf-8",
    )
    found = run(path)
    assert found.parameters[0].p == pytest.approx(0.4, abs=1e-6)
    again = tmp_path / "again.toml"
    again.write_text(found.written.text_in(tmp_path), encoding="utf-8")
    m = open_problem(again)[1].matrices()
    assert m.C.toarray() == pytest.approx(C, abs=1e-4) and m.D.toarray() == pytest.approx(
        D, abs=1e-1
    )

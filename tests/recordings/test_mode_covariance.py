"""The covariance of a table of modes: its order through bands, sorting, channels and signs; every
way to name it; what is none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import ModeTable
from cvxupdate.recordings.uncorrelated import uncorrelated
from cvxupdate.spec import check_problem, load_problem
from cvxupdate.spec.write import Written, tables_of
from tests.recordings.test_load import CHAIN

ROWS = """rows = [
  { frequency = 8.2, shape = [1.0, -0.6] },
  { frequency = 3.1, shape = [0.6, 1.0] },
  { frequency = 19.0 } ]
channels = [
  { column = 1, quantity = "displacement", node = 2, dof = "x", sign = -1 },
  { column = 0, quantity = "displacement", node = 1, dof = "x" } ]
"""


def square(size: int = 7) -> np.ndarray:
    root = np.random.default_rng(2).standard_normal((size, size + 3))
    scale = np.array([0.02, 0.03, 0.05, *[0.01] * 4])[:size]
    return np.asarray(root @ root.T * np.outer(scale, scale))


def loaded(folder: Path, covariance: Any, more: str = "", rows: str = ROWS) -> ModeTable:
    if isinstance(covariance, np.ndarray):
        np.savetxt(folder / "V.csv", covariance, delimiter=",", fmt="%.17g")
        covariance = '"V.csv"'
    given = "" if covariance is None else f"covariance = {covariance}\n"
    text = f'{CHAIN}[[recordings]]\nkind = "modes"\n{rows}{given}{more}'
    (folder / "problem.toml").write_text(text, encoding="utf-8")
    (table,) = load_recordings(load_problem(folder / "problem.toml"))
    assert isinstance(table, ModeTable)
    return table


def test_rows_and_columns_go_with_their_modes_and_channels(tmp_path: Path) -> None:
    """In the file 8.2, 3.1, 19 Hz, then both entries of the first two; in the table by rising
    frequency and by channel, the turned one negative."""
    V = square()
    found = loaded(tmp_path, V)
    C = found.covariance
    assert C is not None and C.shape == (9, 9)
    at, sign = [1, 0, 2, 6, 5, 4, 3], np.array([1, 1, 1, -1, 1, -1, 1])
    np.testing.assert_allclose(C[:7, :7], V[np.ix_(at, at)] * np.outer(sign, sign), rtol=1e-12)
    assert np.isnan(C[7:]).all() and not found.relative_only
    np.testing.assert_allclose(found.frequency_std, np.sqrt(np.diag(V))[[1, 0, 2]])
    assert found.shape_std is not None
    np.testing.assert_allclose(found.shape_std[0], np.sqrt(np.diag(V))[[6, 5]])


def test_a_band_keeps_what_is_left(tmp_path: Path) -> None:
    V = square()
    found = loaded(tmp_path, V, "band = [5.0, 12.0]\n")
    assert found.covariance is not None
    sign = np.array([1, -1, 1])
    wanted = V[np.ix_([0, 4, 3], [0, 4, 3])] * np.outer(sign, sign)
    np.testing.assert_allclose(found.covariance, wanted, rtol=1e-12)


def test_a_gain_that_is_taken_out_goes_into_it(tmp_path: Path) -> None:
    V = square()
    plain = loaded(tmp_path, V)
    mended = loaded(tmp_path, V, "corrections = [{ node = 2, dof = 'x', gain = 4.0 }]\n")
    factor = np.array([1, 1, 1, 0.25, 1, 0.25, 1, 0.25, 1])
    assert plain.covariance is not None and mended.covariance is not None
    np.testing.assert_allclose(mended.covariance, plain.covariance * np.outer(factor, factor))


def test_inline_and_arrays_are_the_same(tmp_path: Path) -> None:
    V = square()
    inline = "[" + ", ".join(str(row.tolist()) for row in V) + "]"
    found = loaded(tmp_path, V).covariance
    np.savez(tmp_path / "V.npz", covariance=V, other=np.ones((2, 2)))
    for way in (inline, '"V.npz"'):
        np.testing.assert_array_equal(loaded(tmp_path, way).covariance, found)


def test_an_array_beside_the_modes(tmp_path: Path) -> None:
    """Of eigenvalues where the file has those: σ_f = σ_λ / (8π²f)."""
    f, V = np.array([3.1, 8.2]), square(2)
    rate = 8.0 * np.pi**2 * f
    np.savez(tmp_path / "f.npz", frequency=f, covariance=V)
    np.savez(
        tmp_path / "l.npz", eigenvalue=(2 * np.pi * f) ** 2, covariance=V * np.outer(rate, rate)
    )
    for name in ("f", "l"):
        found = loaded(tmp_path, None, rows=f'file = "{name}.npz"\n')
        np.testing.assert_allclose(found.covariance, V, rtol=1e-12)
        np.testing.assert_allclose(found.frequency_std, np.sqrt(np.diag(V)), rtol=1e-12)


def test_a_written_file_finds_it(tmp_path: Path) -> None:
    first = loaded(tmp_path, square())
    spec = load_problem(tmp_path / "problem.toml")
    (tmp_path / "sub").mkdir()
    text = Written(tables_of(spec), ()).text_in(tmp_path / "sub")
    assert '"../V.csv"' in text
    (tmp_path / "sub/again.toml").write_text(text, encoding="utf-8")
    (found,) = load_recordings(load_problem(tmp_path / "sub/again.toml"))
    assert isinstance(found, ModeTable)
    np.testing.assert_array_equal(found.covariance, first.covariance)


def test_what_takes_deviations_alone_says_so(tmp_path: Path) -> None:
    table = loaded(tmp_path, square())
    (bare,) = uncorrelated([table])
    assert isinstance(bare, ModeTable) and bare.covariance is None
    np.testing.assert_array_equal(bare.frequency_std, table.frequency_std)
    assert "its deviations alone" in bare.origin.remarks[0]


def spoilt(what: str) -> tuple[Any, str, str]:
    """A covariance, further keys, and what is said of it."""
    V = square()
    more, words = "", ""
    if what == "size":
        V, words = V[:5, :5], r"is 5 × 5; 3 frequencies need 3 × 3, or 7 × 7 with the 4 entries"
    elif what == "not square":
        V, words = V[:, :3], r"is 7 × 3; 3 frequencies need 3 × 3"
    elif what == "skew":
        V[1, 4] += 0.5 * np.sqrt(V[1, 1] * V[4, 4])
        words = r"V.csv: is not symmetric: entry \((2, 5|5, 2)\) is"
    elif what == "indefinite":
        V[0, 3] = V[3, 0] = 1.5 * np.sqrt(V[0, 0] * V[3, 3])
        words = r"not positive semidefinite: the least eigenvalue"
    elif what == "negative":
        V[5, 5], words = -1.0, r"the variance in row 6 is -1\."
    elif what == "certain":
        V[1], V[:, 1], words = 0.0, 0.0, r"the variance in row 2 is 0\. One of a frequency"
    elif what == "unit":  # of eigenvalues
        V[:3] *= 8e3
        V[:, :3] *= 8e3
        words = r"a deviation of .* Hz\. Its part of the frequencies is in Hz²"
    return V, more, words


@pytest.mark.parametrize(
    "what", ["size", "not square", "skew", "indefinite", "negative", "certain", "unit"]
)
def test_what_is_no_covariance_is_refused(what: str, tmp_path: Path) -> None:
    V, more, words = spoilt(what)
    with pytest.raises(RecordingError, match=words):
        loaded(tmp_path, V, more)


def test_deviations_that_contradict_it_are_refused(tmp_path: Path) -> None:
    V = np.diag([0.02, 0.03, 0.05]) ** 2
    first = "{ frequency = 8.2, frequency_std = 0.4 }"
    rows = f"rows = [{first}, {{ frequency = 3.1 }}, {{ frequency = 19.0 }}]\n"
    with pytest.raises(RecordingError, match=r"a deviation of 0\.02 Hz, its row 0\.4 Hz"):
        loaded(tmp_path, V, rows=rows)
    loaded(tmp_path, V, rows=rows.replace("0.4", "0.02"))
    text = (tmp_path / "problem.toml").read_text() + "frequency_std = 0.1\n"
    (tmp_path / "problem.toml").write_text(text)
    (fault,) = check_problem(tmp_path / "problem.toml")
    assert "together with `covariance`" in fault.problem


def test_complex_shapes_are_refused(tmp_path: Path) -> None:
    rows = ROWS.replace("[1.0, -0.6]", "[[1.0, 0.2], [-0.6, 0.1]]")
    with pytest.raises(RecordingError, match=r"real entries, but the shapes are complex.*3 × 3"):
        loaded(tmp_path, square(), rows=rows)
    assert loaded(tmp_path, square()[:3, :3], rows=rows).covariance is not None


def test_files_that_hold_none(tmp_path: Path) -> None:
    (tmp_path / "problem.toml").write_text(
        f'{CHAIN}[[recordings]]\nkind = "modes"\n{ROWS}covariance = "no.csv"\n', encoding="utf-8"
    )
    (fault,) = check_problem(tmp_path / "problem.toml")
    assert "covariance" in fault.key and "there is no file" in fault.problem
    np.savez(tmp_path / "V.npz", a=square(), b=square())
    with pytest.raises(RecordingError, match=r"no array 'covariance' of two axes among a, b"):
        loaded(tmp_path, '"V.npz"')
    with pytest.raises(RecordingError, match="its rows are not as long"):
        loaded(tmp_path, "[[1.0, 0.0], [0.0]]")

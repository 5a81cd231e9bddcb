"""Matrices of other programs: CalculiX's own files against the frequencies that it prints, the
others against what pyyeti and scipy write or what their manuals say; cut and wrong files."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.io import hb_write, mmwrite

from cvxupdate import Model
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.files import read_matrices
from cvxupdate.fe.files.dmig import _number

CALCULIX = Path(__file__).resolve().parents[2] / "cases" / "calculix"
PRINTED = (448.1552, 1925.245, 2265.075)  # Hz, of plate.inp by CalculiX 2.20 itself
RNG = np.random.default_rng(8)
AT = [(3, 0), (3, 2), (7, 4), (12, 5)]
LABELS = ["n3.x", "n3.z", "n7.ry", "n12.rz"]


def spd(n: int = 4) -> np.ndarray:
    A = RNG.standard_normal((n, n))
    return A @ A.T + n * np.eye(n)


def rows(**row: str) -> dict:
    return {"type": "matrix", "rows": [{"id": 1, **row}]}


def opened(folder: Path, dofs: tuple[str, ...] = ("x", "z", "ry", "rz"), **row: str) -> Model:
    files = {k: str(folder / v) if k != "labels" and "." in v else v for k, v in row.items()}
    return Model.from_problem({"model": {"dofs": dofs, "elements": [rows(**files)]}})


def test_calculix_has_the_frequencies_that_it_prints() -> None:
    model = opened(CALCULIX, ("x", "y", "z"), stiffness="plate.sti", mass="plate.mas")
    assert (
        model.labels[:3] == ("n2.x", "n2.y", "n2.z") and len(model.labels) == 42
    )  # with those of its incompatible modes
    assert model.modes(3).frequencies == pytest.approx(PRINTED, rel=1e-6)


def test_calculix_without_its_labels_or_cut_short(tmp_path: Path) -> None:
    shutil.copy(CALCULIX / "plate.sti", tmp_path)
    with pytest.raises(ModelError, match=r"plate\.dof, which says"):
        read_matrices(tmp_path / "plate.sti")
    (tmp_path / "plate.dof").write_text("2.1\n2.2\n")
    with pytest.raises(ModelError, match=r"42 rows, plate\.dof 2"):
        read_matrices(tmp_path / "plate.sti")
    (tmp_path / "plate.dof").write_text("2.1\n2.9\n")
    with pytest.raises(ModelError, match="line 2, '2.9'"):
        read_matrices(tmp_path / "plate.sti")
    shutil.copy(CALCULIX / "plate.dof", tmp_path)
    for text in ("", "1 2\n", "a b c\n", "1 1 1e5\n2 2"):
        (tmp_path / "plate.sti").write_text(text)
        with pytest.raises(ModelError, match="plate.sti"):
            read_matrices(tmp_path / "plate.sti")


def abaqus(A: np.ndarray, every: bool, comma: str) -> str:
    lines = ["** MATRIX", "*MATRIX INPUT, NAME=K"]
    for i, (a, p) in enumerate(AT):
        for j, (b, q) in enumerate(AT):
            if every or j <= i:
                lines.append(comma.join(map(str, (a, p + 1, b, q + 1, f"{A[i, j]:.17e}"))))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("every", [True, False])
@pytest.mark.parametrize("comma", [",  ", " "])
def test_abaqus_with_labels(tmp_path: Path, every: bool, comma: str) -> None:
    K, M = spd(), spd()
    (tmp_path / "k.mtx").write_text(abaqus(K, every, comma))
    (tmp_path / "m.mtx").write_text(abaqus(M, every, comma))
    model = opened(tmp_path, stiffness="k.mtx", mass="m.mtx")
    assert list(model.labels) == LABELS
    assert np.allclose(model.K.toarray(), K, rtol=1e-14)
    assert np.allclose(model.M.toarray(), M, rtol=1e-14)


def test_abaqus_holds_by_a_huge_number(tmp_path: Path) -> None:
    K, M = spd(), spd()
    K[1, 1] = 1e36
    (tmp_path / "k.mtx").write_text(abaqus(K, False, ","))
    (tmp_path / "m.mtx").write_text(abaqus(M, False, ","))
    model, keep = opened(tmp_path, stiffness="k.mtx", mass="m.mtx"), [0, 2, 3]
    assert model.labels == ("n3.x", "n7.ry", "n12.rz")
    assert np.allclose(model.M.toarray(), M[np.ix_(keep, keep)])


def test_abaqus_by_row_and_column_and_matrix_market(tmp_path: Path) -> None:
    K = spd(3)
    text = "".join(f"{i + 1} {j + 1} {K[i, j]:.17e}\n" for i in range(3) for j in range(i, 3))
    (tmp_path / "k.mtx").write_text(text)
    mmwrite(tmp_path / "m.mtx", sp.coo_matrix(spd(3)))
    model = opened(tmp_path, ("x",), stiffness="k.mtx", mass="m.mtx")
    assert model.labels == ("n1.x", "n2.x", "n3.x") and np.allclose(model.K.toarray(), K)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no matrix"),
        ("1,1,1,1\n", "3 or 5 columns"),
        ("1,8,1,8,2.0\n", "degree of freedom 8"),
        ("-1,1,-1,1,2.0\n", "negative numbers"),
        ("0 1 2.0\n", "counted from 1"),
        ("1,1,1,x,2.0\n", "cannot be read"),
        ("%%MatrixMarket nonsense\n", "cannot be read"),
    ],
)
def test_bad_mtx(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "k.mtx").write_text(text)
    with pytest.raises(ModelError, match=says):
        read_matrices(tmp_path / "k.mtx")


def large(name: str, A: np.ndarray, form: int = 6) -> str:
    lines = [f"DMIG    {name:8}{0:8}{form:8}{2:8}{0:8}{'':16}{len(A) if form == 9 else '':>8}"]
    for j, (b, q) in enumerate(AT):
        lines.append(f"{'DMIG*':8}{name:16}{b:16}{q + 1:16}{'':16}")
        for i, (a, p) in enumerate(AT):
            if form != 6 or i >= j:
                value = f"{A[i, j]:.9E}".replace("E", "D")
                lines.append(f"{'*':8}{a:16}{p + 1:16}{value:>16}")
    return "\n".join(lines) + "\n"


def test_dmig_of_a_punch_file(tmp_path: Path) -> None:
    K, M = spd(), spd()
    text = "$TITLE = X\n" + large("KAAX", K) + "GRID,1,,0.,0.,0.\n" + large("MAAX", M, 1)
    (tmp_path / "model.pch").write_text(text)
    model = opened(tmp_path, file="model.pch", stiffness="KAAX", mass="MAAX")
    assert list(model.labels) == LABELS
    assert np.allclose(model.K.toarray(), K, rtol=1e-9)
    assert np.allclose(model.M.toarray(), M, rtol=1e-9)
    with pytest.raises(InputError, match="no variable 'BAAX'. It holds KAAX, MAAX"):
        opened(tmp_path, file="model.pch", stiffness="BAAX", mass="MAAX")


def test_dmig_of_pyyeti(tmp_path: Path) -> None:
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    pandas = pytest.importorskip("pandas")
    index = pandas.MultiIndex.from_tuples([(a, p + 1) for a, p in AT], names=["id", "dof"])
    K, Z = spd(), spd() * (1 + 0.1j)
    frames = {"K": pandas.DataFrame(K, index, index), "Z": pandas.DataFrame(Z, index, index)}
    bulk.wtdmig(str(tmp_path / "k.dmig"), frames)
    found = read_matrices(tmp_path / "k.dmig")
    assert found.labels["K"] == tuple(AT)
    assert np.allclose(found.matrices["K"].toarray(), K, rtol=1e-8)
    assert np.allclose(found.matrices["Z_imag"].toarray(), Z.imag, rtol=1e-8)


def test_dmig_in_small_and_free_fields(tmp_path: Path) -> None:
    small = (
        f"{'DMIG':8}{'K':8}{0:8}{6:8}{1:8}{0:8}\n"
        f"{'DMIG':8}{'K':8}{3:8}{1:8}{'':8}{3:8}{1:8}{'2.5+3':>8}\n"
        f"{'*':8}{7:16}{5:16}{'-1.5D+2':>16}\n"
        f"{'DMIG':8}{'K':8}{7:8}{5:8}{'':8}{7:8}{5:8}{'40.':>8}\n"
    )
    (tmp_path / "a.dmig").write_text(small)
    free = "DMIG,K,0,6,1,0\nDMIG,K,3,1,,3,1,2.5+3\n,7,5,-1.5D+2\nDMIG,K,7,5,,7,5,40.\n"
    (tmp_path / "b.dmig").write_text(free)
    for name in ("a.dmig", "b.dmig"):
        found = read_matrices(tmp_path / name)
        assert found.labels["K"] == ((3, 0), (7, 4))
        assert np.array_equal(found.matrices["K"].toarray(), [[2500.0, -150.0], [-150.0, 40.0]])
    assert [_number(t) for t in ("", "1.5", "1.5-3", "-2.D+02", "3E-4", "1.+10")] == [
        0.0,
        1.5,
        1.5e-3,
        -200.0,
        3e-4,
        1e10,
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("GRID,1\n", "no DMIG card"),
        ("DMIG,K,3,1,,3,1,2.5\n", "line 1: is no DMIG"),
        ("DMIG,K,0,6,1,0\nDMIG,K,3,1,,3,1,two\n", "line 2: is no DMIG"),
        ("DMIG,K,0,9,1,0\nDMIG,K,3,1,,3,1,2.\n", "no square matrix among K"),
        ("DMIG,K,0,6,1,0\nDMIG,K,3,1,,3,9,2.\n", "degree of freedom 9"),
    ],
)
def test_bad_dmig(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "k.dmig").write_text(text)
    with pytest.raises(ModelError, match=says):
        read_matrices(tmp_path / "k.dmig")


def test_op4_of_pyyeti(tmp_path: Path) -> None:
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    K, M = spd(), spd()
    for number, binary in enumerate((True, False)):
        name = f"model{number}.op4"
        op4.write(str(tmp_path / name), {"KGG": K, "MGG": M}, binary=binary)
        model = Model.from_problem(
            {
                "model": {
                    "dofs": ["x", "z", "ry", "rz"],
                    "elements": [
                        {
                            "type": "matrix",
                            "file": tmp_path / name,
                            "labels": LABELS,
                            "rows": [{"id": 1, "stiffness": "KGG", "mass": "MGG"}],
                        }
                    ],
                }
            }
        )
        assert np.allclose(model.K.toarray(), K, rtol=1e-12)
        assert np.allclose(model.M.toarray(), M, rtol=1e-12)
    for blob in (b"", b"not an op4 file\n", (tmp_path / "model0.op4").read_bytes()[:200]):
        (tmp_path / "bad.op4").write_bytes(blob)
        with pytest.raises(ModelError, match=r"bad\.op4"):
            read_matrices(tmp_path / "bad.op4")


def rsa(A: np.ndarray) -> str:
    """A symmetric matrix as Ansys writes it: the lower triangle."""
    low = sp.csc_matrix(np.tril(A))
    n, nnz = A.shape[0], low.nnz

    def ints(values: np.ndarray) -> str:
        lines = (values[i : i + 10] for i in range(0, len(values), 10))
        return "\n".join("".join(f"{k + 1:8}" for k in line) for line in lines)

    reals = "\n".join("".join(f"{x:25.16E}" for x in low.data[i : i + 3]) for i in range(0, nnz, 3))
    return (
        f"{'Stiffness matrix from HBMAT':72}{'KEY':8}\n"
        f"{9:14}{1:14}{1:14}{4:14}{0:14}\n"
        f"{'RSA':14}{n:14}{n:14}{nnz:14}{0:14}\n"
        f"{'(10I8)':16}{'(10I8)':16}{'(1P3E25.16)':20}{'':20}\n"
        f"{ints(low.indptr)}\n{ints(low.indices)}\n{reals.replace('E+', 'D+')}\n"
    )


def test_harwell_boeing_of_ansys(tmp_path: Path) -> None:
    K, M = spd(), spd()
    (tmp_path / "k.hb").write_text(rsa(K))
    (tmp_path / "m.hb").write_text(rsa(M))
    names = ("UX", "UZ", "ROTY", "ROTZ")
    lines = [
        f"  {i}  {node}  {d}" for i, ((node, _), d) in enumerate(zip(AT, names, strict=True), 1)
    ]
    for name in ("k.mapping", "m.mapping"):
        (tmp_path / name).write_text(" Matrix Eqn  Node  DOF\n" + "\n".join(lines) + "\n")
    model = opened(tmp_path, stiffness="k.hb", mass="m.hb")
    assert list(model.labels) == LABELS
    assert np.allclose(model.K.toarray(), K, rtol=1e-14)
    (tmp_path / "k.mapping").write_text("\n".join(lines[:2]))
    with pytest.raises(ModelError, match="maps 2 equations of a matrix with 4"):
        read_matrices(tmp_path / "k.hb")


def test_harwell_boeing_of_scipy(tmp_path: Path) -> None:
    A = spd(5)
    hb_write(tmp_path / "a.rua", sp.csc_matrix(A))
    assert np.allclose(read_matrices(tmp_path / "a.rua").matrices["matrix"].toarray(), A)


@pytest.mark.parametrize("end", [40, 200, 300, 420, 600])
def test_harwell_boeing_cut_short(tmp_path: Path, end: int) -> None:
    (tmp_path / "k.hb").write_text(rsa(spd())[:end])
    with pytest.raises(ModelError, match=r"k\.hb"):
        read_matrices(tmp_path / "k.hb")


def test_other_types_of_harwell_boeing(tmp_path: Path) -> None:
    (tmp_path / "k.hb").write_text(rsa(spd()).replace("RSA", "CSA"))
    with pytest.raises(ModelError, match="type 'CSA'"):
        read_matrices(tmp_path / "k.hb")


def test_labels_of_the_file_need_their_directions(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="DOFs along z, which model.dofs"):
        opened(CALCULIX, ("x", "y"), stiffness="plate.sti", mass="plate.mas")

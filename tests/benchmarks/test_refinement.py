"""What a diagnosis costs against the refinement of the model that it works on: the same plate, the
same candidates, each edge of its elements in 4, 8, 16 and 32 parts: one, two, four and eight times
the coarsest mesh from which a limit can be had (processor seconds).

Making that model grows with the parts; all that comes after may not, for their matrices are
condensed to the file's nodes and to coordinates of edges, whose number is that of what the band
asks for.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import pytest  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.diagnose.nominal import refinement  # noqa: E402
from cvxupdate.diagnose.responses import worth  # noqa: E402
from cvxupdate.study import diagnose  # noqa: E402

PLATE = ROOT / "problems/concealed/o12/problem.toml"
PARTS = (4, 8, 16, 32)  # 8 is usual, 16 where that leaves too much
MOST = 1.5  # times the seconds on the coarsest


def test_diagnosis_against_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[float, int]] = []
    plain = worth.fine_enough

    def timed(*args: Any) -> refinement.Mesh:
        start = time.process_time()
        mesh = plain(*args)
        inner = 0 if mesh.analysis is None else len(mesh.analysis.inner)
        made.append((time.process_time() - start, inner))
        return mesh

    monkeypatch.setattr(worth, "fine_enough", timed)
    rest = {}
    print("\nparts of an edge   its making, s   all after it, s   inner DOFs")
    for parts in reversed(PARTS):  # the finest first: what is imported counts against it
        monkeypatch.setattr(refinement, "MESH_PARTS", (parts,))
        made.clear()
        start = time.process_time()
        diagnose(PLATE, thorough=True)
        making, inner = made[0]
        rest[parts] = time.process_time() - start - making
        print(f"{parts:16d} {making:15.2f} {rest[parts]:17.2f} {inner:12d}", flush=True)
    assert max(rest.values()) <= MOST * rest[PARTS[0]]

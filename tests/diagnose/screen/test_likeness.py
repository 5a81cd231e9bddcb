"""Which effects responses hardly tell from one another."""

from __future__ import annotations

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.screen.likeness import moving_as_one
from tests.cases.chain import CHAIN, load

STIFF = 1e4  # times: the two floors at the end of the chain move as one


def test_oscillators_on_what_moves_as_one_are_alike(tmp_path, lab, measure):
    """Nodes of the rail of a frame: one that swung along it at node 6 stood at node 22, with 99 %
    (the laboratory's 4814)."""
    spec, model = load(tmp_path, CHAIN.replace("k = 3.1e4", f"k = {STIFF * 3.1e4}"))
    recording = measure(lab(k=(1, 1, 1, STIFF)), 1)
    evidence = gathered(spec, model, [recording], lambda text: None)
    base, names = evidence.bases[-1], ("attached_resonator", "added_mass")
    for name in names:
        for node, others in ((4, {3}), (2, set())):
            found = evidence.candidates(evidence.model, (name,))
            own = next(e for e in found if e.place.nodes == (node,))
            near = moving_as_one(evidence, base, base, own)
            assert {e.place.nodes[0] for e in near} == others and len(near) == len(others), name

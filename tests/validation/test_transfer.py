"""The family that plate B finds, on other plates: docs/generic-elements.md."""

import numpy as np

from validation.transfer import PLATE_B, PLATES, errors, learnt


def test_a_family_found_beside_the_diagonals_holds_on_other_plates() -> None:
    """Twice better than the nominal element on another size and other edges; not on elements of
    another form."""
    rows = learnt(PLATE_B / "beside.toml")
    better = {}
    for plate in PLATES:
        if plate.name.startswith(("0.25 × 0.20 m, 5", "0.25 × 0.20 m, all", "elements of")):
            target = plate.model(2)
            was, now = (errors(plate, r, target) for r in ([], rows))
            better[plate.name[:16]] = (
                was.frequencies / now.frequencies,
                was.responses / now.responses,
            )
    other, clamped, form = better.values()
    assert min(other) > 3.0 and min(clamped) > 1.8 and max(form) < 1.0


def test_the_coarse_nodes_are_nodes_of_the_finer_mesh() -> None:
    for plate in PLATES:
        coarse, fine = plate.model(), plate.model(2)
        place = {int(n): xyz for n, xyz in zip(fine.node_ids, fine.xyz, strict=True)}
        for i, j in plate.free_nodes():
            at = coarse.xyz[coarse.node_ids.tolist().index(plate.node(i, j, 1))]
            np.testing.assert_allclose(place[plate.node(i, j, 2)], at, atol=1e-12)

"""A lump with a footprint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.added_mass import AddedMass
from cvxupdate.physics.place import DRIVE_POINT
from cvxupdate.physics.shaker import at_drive, goes, with_drive
from cvxupdate.physics.spread_lump import SpreadLump, spread
from tests.cases.effects import PLATE, context_of, problem
from tests.cases.elements import STEEL, grid

MASS = 0.4


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A cantilever plate in squares of 50 mm, and the same in 12.5 mm."""
    out = []
    for parts in (1, 4):
        x, y = (np.linspace(0.0, a, n * parts + 1).tolist() for a, n in ((0.4, 8), (0.3, 6)))
        text = {**grid(x, y, material=STEEL), "supports": []}
        held = [i * len(x) + 1 for i in range(len(y))]
        text["supports"] = [{"nodes": held, "dofs": ["z", "rx", "ry"]}]
        spec = problem(tmp_path_factory.mktemp(f"plate{parts}"), text)
        out.append((spec, build_model(spec)))
    return out


def node_at(model, x, y):
    return int(model.node_ids[np.argmin(np.hypot(model.xyz[:, 0] - x, model.xyz[:, 1] - y))])


def test_its_second_moment_is_that_of_the_body(plate) -> None:
    """A body of 50 by 50 mm, evenly over the nodes of a mesh of a quarter: between a point and the
    lump with its second moment frequencies go most of the way to those of the body."""
    (spec, model), (_, fine) = plate
    where, half = (0.2, 0.1), 0.025
    inside = [
        n for n, (x, y, _) in zip(fine.node_ids, fine.xyz, strict=True)
        if max(abs(x - where[0]), abs(y - where[1])) <= half + 1e-9
    ]  # fmt: skip
    true = _with(fine, inside, MASS)
    second = MASS * float(
        np.mean([np.sum((fine.xyz[fine.node_ids == n][0, :2] - where) ** 2) for n in inside])
    )
    bare, bare_fine = (model_modes(m, 8).frequencies for m in (model, fine))
    node = node_at(model, *where)
    effect = spread(context_of(spec, model, ()), node)
    assert effect is not None and effect.change is not None
    grown = effect.change.model
    sizes = np.zeros(len(grown.parameters))
    own = grown.parameters[-2:]
    around = effect.figures[1].value(grown, own[1], 1.0, 0.0)[0]
    sizes[-2:] = MASS / own[0].unit_size, second / around
    said = model_modes(grown, 8, p=sizes).frequencies
    sizes[-1] = 0.0
    point = model_modes(grown, 8, p=sizes).frequencies
    asked = (true / bare_fine) * bare  # of meshes alike
    off, left = np.abs(point / asked - 1.0), np.abs(said / asked - 1.0)
    assert off.max() > 4e-3 and left.max() < 0.4 * off.max()


def _with(model, nodes, mass):
    from dataclasses import replace

    from cvxupdate.physics.added_mass import lumps

    rows = [[model.place[f"n{n}.z"]] for n in nodes]
    block = lumps(model, rows)
    block = replace(
        block, properties={**block.properties, "m": np.full(len(rows), mass / len(rows))}
    )
    return model_modes(replace(model, blocks=(*model.blocks, block)), 8).frequencies


def test_it_stands_where_it_is_surrounded_and_is_told_from_a_point(tmp_path) -> None:
    spec = problem(tmp_path, PLATE)
    model = build_model(spec)
    context = context_of(spec, model, ())
    found = SpreadLump().candidates(context)
    inner = {6, 7}  # all others are at the edge: what lies around them lies on one side
    assert {e.place.nodes[0] for e in found} == inner
    (point,) = (e for e in AddedMass().candidates(context) if e.place == found[0].place)
    assert found[0].key != point.key and found[0].physics == point.physics
    assert found[0].on(context).key == found[0].key


def test_where_it_may_be_a_point_it_says_no_more_than_that() -> None:
    plainly = SpreadLump().plainly
    assert plainly({"m": 0.4, "J": 1e-4}, {"m": 0.01, "J": 6e-5})
    assert not plainly({"m": 0.4, "J": 1e-4}, {"m": 0.01, "J": 2e-5})


def test_at_the_drive_it_stays(plate) -> None:
    """It is no shaker, whose parts go from drive to drive."""
    spec, model = plate[0]
    there = replace(spread(context_of(spec, model, ()), node_at(model, 0.2, 0.1)), spot=DRIVE_POINT)
    assert at_drive(there) and with_drive(there) is there and not goes(there)

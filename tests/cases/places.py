"""A place of every kind."""

from __future__ import annotations

from cvxupdate.physics.place import Place

PLACES = [
    Place(nodes=(5,), dof="x"),
    Place(nodes=(2, 3), dof="x"),
    Place(nodes=(2, 3, 9)),
    Place(elements=(4,)),
    Place(elements=(3, 4, 5, 6, 12)),
    Place(elements=(1, 2), groups=("bar",)),
    Place(groups=("a", "b", "c")),
    Place(nodes=(7,), elements=(6,), dof="ry"),
    Place(),
]

"""The map of explained fractions."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.shown import places
from cvxupdate.physics import told
from cvxupdate.physics.effect import ChannelFault, Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place
from cvxupdate.physics.sensor_fault import ChannelGain


def test_the_map_takes_nodes_elements_and_no_channels() -> None:
    def candidate(fraction: float, **place: object) -> tuple[Effect, float]:
        return told("added_mass", Place(**place)), fraction  # type: ignore[arg-type]

    wrong = ChannelFault(Fault("n5.x", "gain"))

    nodes, elements = places(
        [
            candidate(0.2, nodes=(1,)),
            candidate(0.5, nodes=(1,)),
            candidate(0.4, nodes=(2, 3)),
            (Effect(ChannelGain(), Place(nodes=(5,)), wrong, ()), 0.9),
            candidate(0.3, elements=(7,)),
            candidate(0.8, elements=(7, 8)),
            candidate(np.nan, elements=(9,)),
            candidate(0.0, nodes=(4,)),
        ]
    )
    assert nodes == {1: 0.5, 2: 0.4, 3: 0.4} and elements == {7: 0.3}

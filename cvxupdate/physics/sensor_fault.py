"""``sensor_fault``: a channel with a wrong gain, sign or delay, or two channels exchanged: the
measurement, not the structure. Tell-tale: one or two channels are off at all frequencies, the
others are not.

A sign is a gain of −1. An exchange has no size of its own: its ``gain`` is the share of the other
channel's motion that each reads, 1 for a true exchange; a fit that drives it away from 1 says that
the channels were not exchanged (`EXCHANGED` is how near it must end).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import final

from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import EXCHANGED as EXCHANGED
from cvxupdate.physics.effect import RESPONSES, ChannelFault, Effect, EffectType
from cvxupdate.physics.fault import Fault as Fault
from cvxupdate.physics.place import Place, at, channel_place
from cvxupdate.physics.quantity import Quantity, delay, factor, inverse
from cvxupdate.physics.units import number, quantity

# of channels tried for an exchange; beyond, only those at one node and neighbours in the recording
MOST_PAIRS = 500
WRONG_SIGN = 0.1  # a gain that near −1 is a wrong sign
NOT = "The measurement, not the structure: "


def _alone(kind: EffectType, labels: Sequence[str], how: str, figure: Quantity) -> list[Effect]:
    """The same fault of each of these channels by itself."""
    return [Effect(kind, channel_place(c), ChannelFault(Fault(c, how)), (figure,)) for c in labels]


def _reads(channel: str, gain: float, wherever: str = "") -> str:
    """What a gain makes of a channel, or that the sign is wrong."""
    if abs(gain + 1.0) < WRONG_SIGN:
        return f"{NOT}{channel} has the wrong sign{wherever}."
    wrong = ", with the wrong sign" if gain < 0 else ""
    return f"{NOT}{channel} reads {number(gain)} times what it should{wrong}{wherever}."


@final
class ChannelGain(EffectType):
    """A gain, sign included."""

    name = "sensor_fault"
    noun = "a wrong gain of the channel"
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Of every channel."""
        return _alone(self, context.sensors, "gain", factor("gain"))

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The gain, or that the sign is wrong."""
        return _reads(f"the channel {at(effect.place)}", values["gain"])


@final
class ForceGain(EffectType):
    """The gain of the force transducer, or of the one number by which all responses are referred to
    the force: one instrument, a hammer or a shaker's load cell, goes from drive to drive."""

    name = "sensor_fault"
    noun = "a wrong gain of the force channel"
    rig = True
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Of all forces that act by themselves; it stands where those fitted do."""
        if not context.forces:
            return []
        first, *others = (*context.forces, *context.later)
        places = [channel_place(c) for c in context.forces]
        kinds = {p.dof for p in places}
        nodes = tuple(dict.fromkeys(n for p in places for n in p.nodes))
        place = Place(nodes=nodes, dof=kinds.pop() if len(kinds) == 1 else None)
        fault = Fault(first, "force", others=tuple(others))
        return [Effect(self, place, ChannelFault(fault), (inverse("gain"),))]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The gain, sign included."""
        wherever = ", wherever it drives" if effect.fault and effect.fault.others else ""
        return _reads(f"the force channel {at(effect.place)}", values["gain"], wherever)


@final
class DriveGain(EffectType):
    """The gain of one drive's own force transducer where there are several."""

    name = "sensor_fault"
    noun = "a wrong gain of that drive's own force channel"
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Of every force that acts by itself, where it is not the only one."""
        if len(context.forces) + len(context.later) < 2:
            return []
        return _alone(self, context.forces, "force", inverse("gain"))

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The gain, sign included."""
        return _reads(f"the force channel {at(effect.place)}", values["gain"])


@final
class RecordingGain(EffectType):
    """The gain of the force in each further recording that was driven from a place of its own,
    beside the one of all (`ForceGain`): an amplifier was set anew."""

    name = "sensor_fault"
    noun = DriveGain.noun
    rig = True
    sought = False  # by themselves those of drives are
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Of every drive but the first."""
        gains = DriveGain()
        return gains.candidates(context)[1:] if context.apart else []

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The gain, sign included."""
        return DriveGain().says(effect, values)


@final
class ChannelDelay(EffectType):
    """A delay."""

    name = "sensor_fault"
    noun = "a delay of the channel"
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Of every channel."""
        return _alone(self, context.sensors, "delay", delay("delay"))

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Late or early, by how much."""
        late = "lags" if values["delay"] >= 0 else "comes early"
        return (
            f"{NOT}the channel {at(effect.place)} {late} by {quantity(abs(values['delay']), 's')}."
        )


@final
class ExchangedChannels(EffectType):
    """Two channels exchanged."""

    name = "sensor_fault"
    noun = "an exchange of the channels"
    told_by = frozenset({RESPONSES})

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Every pair of channels."""
        labels = context.sensors
        places = [channel_place(c) for c in labels]
        pairs = list(itertools.combinations(range(len(labels)), 2))
        if len(pairs) > MOST_PAIRS:
            pairs = [(a, b) for a, b in pairs if b == a + 1 or places[a].nodes == places[b].nodes]
        out = []
        for a, b in pairs:
            one, two = places[a], places[b]
            nodes = one.nodes if one.nodes == two.nodes else one.nodes + two.nodes
            place = Place(nodes=nodes, dof=one.dof if one.dof == two.dof else None)
            action = ChannelFault(Fault(labels[a], "swap", other=labels[b]))
            spot = f"{at(one)} and {at(two)}"
            out.append(Effect(self, place, action, (factor("gain"),), spot=spot))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Which."""
        return f"{NOT}the channels {effect.spot} are exchanged."

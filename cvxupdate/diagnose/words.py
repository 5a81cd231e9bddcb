"""Physics, places and sizes in words that a technician uses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from cvxupdate.physics.base import Candidate, Place

ROTATIONS = ("rx", "ry", "rz")
MOST = 12
"""Names in a list before the rest is only counted."""
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))

WORDS = {
    "stiffness_change": "a change of stiffness",
    "mass_change": "a change of mass",
    "thickness_change": "a change of thickness",
    "orthotropy": "direction-dependent stiffness",
    "added_mass": "an added mass",
    "grounding_spring": "a spring to ground",
    "joint_flexibility": "a joint that gives way",
    "shear_deformation": "deformation in shear",
    "axial_preload": "an axial preload",
    "gyroscopic": "spin",
    "attached_resonator": "a hidden oscillator",
    "viscous_damper": "a damper",
    "structural_damping": "loss in the material",
    "mass_proportional_damping": "the same decay of all modes",
    "cubic_stiffness": "a stiffness that changes with the amplitude",
    "clearance": "a gap that closes",
    "dry_friction": "dry friction",
    "hysteresis": "stick and slip with memory",
    "quadratic_damping": "a drag that grows with the square of the speed",
    "sensor_fault": "a faulty channel",
}


def words_of(physics: str) -> str:
    """``added_mass`` as "an added mass"."""
    return WORDS.get(physics, physics.replace("_", " "))


def effect(physics: str, place: Place) -> str:
    """``added_mass`` at node 5 as "an added mass at node 5"."""
    return f"{words_of(physics)} {at(place)}"


def capital(text: str) -> str:
    """With a capital first."""
    return text[:1].upper() + text[1:]


def effect_of(c: Candidate) -> str:
    """`effect` of a candidate: it tells a support that gives way from a spring, and which channels
    are meant."""
    if c.physics == "grounding_spring" and c.offset > 0.0:
        return f"a support that gives way {at(c.place)}"
    if c.channel is not None:
        faults = {
            "gain": "a wrong gain of the channel",
            "delay": "a delay of the channel",
            "swap": "an exchange of the channels",
        }
        return (
            f"{faults.get(c.sensor or '', 'a fault of the channel')} {label_words(c.channel)}"
            + (f" and {label_words(c.other)}" if c.other else "")
        )
    return effect(c.physics, c.place)


def number(value: float, digits: int = 3) -> str:
    """Three significant digits without an exponent: 3.49, 0.0126, 12 300."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{digits - 1}e}")
    places = digits - 1 - math.floor(math.log10(abs(value)) + 1e-12)
    if -3 < places <= 8:
        return f"{round(value, places):.{max(places, 0)}f}".replace("-", "−")
    return f"{value:.{digits - 1}e}".replace("-", "−")


def quantity(value: float, unit: str) -> str:
    """With the prefix that suits it: "3.49 kN/m", "34.8 g", "1.2 ms"; units that have none stay as
    they are."""
    if unit == "kg":
        return f"{number(1e3 * value)} g" if 0.0 < abs(value) < 0.1 else f"{number(value)} kg"
    if (
        unit not in ("N/m", "N·m/rad", "N", "s", "N/m³", "m", "N·s/m", "N·m·s/rad")
        or value == 0.0
        or not math.isfinite(value)
    ):
        return f"{number(value)} {unit}".strip()
    fitting = [
        (f, letter) for f, letter in PREFIXES if (f <= 1.0 if unit in ("s", "m") else f >= 1.0)
    ]
    size = abs(float(f"{value:.2e}"))
    factor, letter = next(((f, letter) for f, letter in fitting if size >= f), fitting[-1])
    return f"{number(value / factor)} {letter}{unit}"


def listed(names: Sequence[object], most: int = MOST) -> str:
    """ "1, 2 and 5"; what is beyond ``most`` is counted."""
    shown = [str(n) for n in names[:most]]
    if len(names) > most:
        return ", ".join(shown) + f" and {len(names) - most} more"
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


def numbered(ids: Sequence[int]) -> str:
    """ "3, 5 to 9 and 12"."""
    runs: list[list[int]] = []
    for i in sorted(ids):
        if runs and i == runs[-1][-1] + 1:
            runs[-1].append(i)
        else:
            runs.append([i])
    parts = [
        item
        for run in runs
        for item in ([f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(i) for i in run])
    ]
    return listed(parts)


def where(place: Place) -> str:
    """A place as a thing: "node 5 (z)", "elements 3 to 6", "the joint of element 6 at node 7"."""
    along = f" ({place.dof})" if place.dof else ""
    if place.groups:
        return ("group " if len(place.groups) == 1 else "groups ") + listed(
            [f"'{g}'" for g in place.groups], 6
        )
    if place.elements and place.nodes:
        return f"the joint of element {place.elements[0]} at node {place.nodes[0]}"
    if place.elements:
        return (
            f"element {place.elements[0]}"
            if len(place.elements) == 1
            else f"elements {numbered(place.elements)}"
        )
    if place.nodes:
        return (
            f"node {place.nodes[0]}{along}"
            if len(place.nodes) == 1
            else f"nodes {listed(place.nodes)}{along}"
        )
    return "the whole structure"


def at(place: Place) -> str:
    """A place as an answer to "where?": "at node 5 (z)", "between nodes 2 and 3 (x)", "in group
    'bar'"."""
    if place.groups or (place.elements and not place.nodes) or not place.nodes:
        return f"in {where(place)}"
    return (
        f"between {where(place)}"
        if len(place.nodes) == 2 and not place.elements
        else f"at {where(place)}"
    )


def sentence_of(c: Candidate, v: Mapping[str, float]) -> str:
    """The sentence of a candidate with its figures: as `sentence`, and it tells a support that
    gives way from a spring, and what a channel suffers from."""
    if c.physics == "grounding_spring" and c.offset > 0.0:
        return (
            f"The support {at(c.place)} gives way: it holds with "
            f"{quantity(v['k'], _stiffness(c.place))}, while the model holds it rigidly."
        )
    if c.sensor == "swap":
        return (
            f"The measurement, not the structure: the channels {label_words(c.channel or '')} and "
            f"{label_words(c.other)} are exchanged."
        )
    return sentence(c.physics, c.place, v)


def label_words(label: str) -> str:
    """``n3.x`` as "at node 3 (x)"."""
    node, _, dof = label.partition(".")
    return f"at node {node[1:]} ({dof})"


def _stiffness(place: Place) -> str:
    return "N·m/rad" if place.dof in ROTATIONS else "N/m"


def sentence(physics: str, place: Place, v: Mapping[str, float]) -> str:
    """One sentence that a technician understands; ``v`` are the contract's parameters."""
    here = at(place)
    There = here[0].upper() + here[1:]
    if physics in CHANGES:
        change = 100.0 * (v["factor"] - 1.0)
        return (
            f"{There} the real structure is {number(abs(change), 2)} % "
            f"{CHANGES[physics][0 if change > 0 else 1]} than modelled."
        )
    if physics == "added_mass":
        much = quantity(abs(v["m"]), "kg")
        return (
            "The real structure "
            f"{'carries ' + much + ' more' if v['m'] >= 0 else 'is ' + much + ' lighter'} than "
            f"the model {here}."
        )
    if physics == "grounding_spring":
        return (
            f"{There} the structure is held by a spring of {quantity(v['k'], _stiffness(place))} "
            "that the model does not have."
        )
    if physics == "joint_flexibility":
        spring = quantity(
            v["k"], "N/m" if place.dof is not None and place.dof not in ROTATIONS else "N·m/rad"
        )
        return (
            f"{where(place)[0].upper()}{where(place)[1:]} gives way: it turns on a spring of "
            f"{spring}, while the model joins it rigidly."
        )
    if physics == "shear_deformation":
        return (
            f"The bars {here} are too stocky for the model: they also deform in shear (shear "
            f"coefficient {number(v['kappa'], 2)})."
        )
    if physics == "axial_preload":
        return (
            f"{There} there is {'a tension' if v['N'] > 0 else 'a compression'} of "
            f"{quantity(abs(v['N']), 'N')} that the model leaves out."
        )
    if physics == "gyroscopic":
        turns = number(abs(v["omega"]) * 30.0 / math.pi)
        return (
            f"{There} something spins at {number(abs(v['omega']))} rad/s ({turns} turns a "
            "minute), while it stands still in the model."
        )
    if physics == "attached_resonator":
        f = math.sqrt(v["k"] / v["m"]) / (2.0 * math.pi) if v["m"] > 0 and v["k"] > 0 else math.nan
        return (
            f"Something of {quantity(v['m'], 'kg')} swings on its own {here}, at {number(f)} "
            f"Hz (on a spring of {quantity(v['k'], _stiffness(place))}), that the model does "
            "not know."
        )
    if physics == "viscous_damper":
        unit = "N·m·s/rad" if place.dof in ROTATIONS else "N·s/m"
        return (
            f"{There} a damper of {quantity(v['c'], unit)} takes out energy; the model does not "
            "have it."
        )
    if physics == "structural_damping":
        return (
            f"The material {here} loses energy (loss factor {number(v['eta'], 2)}) beyond the "
            "rest of the structure."
        )
    if physics == "mass_proportional_damping":
        return (
            f"Every mode dies away at the same rate ({number(v['alpha'] / 2, 2)} a second) "
            "beside its own damping: air, suspension, or an exponential window in the "
            "measurement."
        )
    if physics == "orthotropy":
        stiff = ", ".join(
            f"{name} {number(v[name])}" for name in ("Dx", "Dy", "D1", "Dxy") if name in v
        )
        return (
            f"The plate {here} is not equally stiff in all directions (times the modelled: "
            f"{stiff})."
        )
    if physics == "sensor_fault":
        return f"The measurement, not the structure: {_channel(place, v)}"
    return f"{words_of(physics).capitalize()} {here}."


CHANGES = {
    "stiffness_change": ("stiffer", "softer"),
    "mass_change": ("heavier", "lighter"),
    "thickness_change": ("thicker", "thinner"),
}


def _channel(place: Place, v: Mapping[str, float]) -> str:
    if len(place.nodes) > 1:
        return f"the channels at {where(place)} are exchanged."
    if "delay" in v:
        return (
            f"the channel {at(place)} {'lags' if v['delay'] >= 0 else 'comes early'} by "
            f"{quantity(abs(v['delay']), 's')}."
        )
    gain = v["gain"]
    if abs(gain + 1.0) < 0.1:
        return f"the channel {at(place)} has the wrong sign."
    return f"the channel {at(place)} reads {number(gain)} times what it should" + (
        ", with the wrong sign." if gain < 0 else "."
    )

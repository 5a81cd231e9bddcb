"""The effects that a model may lack: each a file with all that is particular to it. One list."""

from __future__ import annotations

from collections.abc import Collection

from cvxupdate import registry
from cvxupdate.errors import ModelError
from cvxupdate.fe.bases import base_labels
from cvxupdate.fe.model import Model
from cvxupdate.physics.absent_member import AbsentMember
from cvxupdate.physics.added_mass import AddedMass
from cvxupdate.physics.attached_resonator import AttachedResonator
from cvxupdate.physics.axial_preload import AxialPreload
from cvxupdate.physics.clearance import Clearance
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.cords import Cords
from cvxupdate.physics.cubic_stiffness import CubicStiffness
from cvxupdate.physics.draft import Writer
from cvxupdate.physics.dry_friction import DryFriction
from cvxupdate.physics.effect import (
    MOTION,
    RESPONSES,
    ChannelFault,
    Effect,
    EffectType,
    ModelChange,
)
from cvxupdate.physics.equal_joints import EqualJoints
from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.physics.flexible_support import FlexibleSupport
from cvxupdate.physics.grounding_spring import GroundingSpring
from cvxupdate.physics.gyroscopic import Spin
from cvxupdate.physics.held_edges import HeldEdges
from cvxupdate.physics.hysteresis import Hysteresis
from cvxupdate.physics.joint_flexibility import JointFlexibility
from cvxupdate.physics.loose_span import LooseSpan
from cvxupdate.physics.looser_support import LooserSupport
from cvxupdate.physics.mass_change import MassChange
from cvxupdate.physics.mass_proportional_damping import MassProportionalDamping
from cvxupdate.physics.moving_fixture import MovingFixture
from cvxupdate.physics.orthotropy import Orthotropy
from cvxupdate.physics.place import Place
from cvxupdate.physics.quadratic_damping import QuadraticDamping
from cvxupdate.physics.sensor_fault import (
    ChannelDelay,
    ChannelGain,
    DriveGain,
    ExchangedChannels,
    ForceGain,
    RecordingGain,
)
from cvxupdate.physics.sensor_mass import SensorMass
from cvxupdate.physics.shaker import DriveMass, ShakerAttachment
from cvxupdate.physics.shear_deformation import ShearDeformation
from cvxupdate.physics.soft_mounts import SoftMounts
from cvxupdate.physics.soft_support import SoftSupport
from cvxupdate.physics.spread_lump import SpreadLump
from cvxupdate.physics.stiffness_change import StiffnessChange
from cvxupdate.physics.structural_damping import StructuralDamping
from cvxupdate.physics.thickness_change import ThicknessChange
from cvxupdate.physics.viscous_damper import ViscousDamper
from cvxupdate.physics.zone import SoftZone

EFFECTS: tuple[EffectType, ...] = (
    StiffnessChange(),
    SoftZone(),
    AbsentMember(),
    MassChange(),
    ThicknessChange(),
    Orthotropy(),
    AddedMass(),
    SpreadLump(),
    SensorMass(),
    GroundingSpring(),
    Cords(),
    HeldEdges(),
    SoftSupport(),
    EqualSupports(),
    LooseSpan(),
    LooserSupport(),
    SoftMounts(),
    FlexibleSupport(),
    MovingFixture(),
    ShakerAttachment(),
    DriveMass(),
    JointFlexibility(),
    EqualJoints(),
    ShearDeformation(),
    AxialPreload(),
    Spin(),
    AttachedResonator(),
    ViscousDamper(),
    StructuralDamping(),
    MassProportionalDamping(),
    ChannelGain(),
    ForceGain(),
    DriveGain(),
    RecordingGain(),
    ChannelDelay(),
    ExchangedChannels(),
    CubicStiffness(),
    Clearance(),
    DryFriction(),
    Hysteresis(),
    QuadraticDamping(),
)


def effect_types() -> tuple[EffectType, ...]:
    """The effects of this folder, then those that were registered from outside."""
    return registry.EFFECTS.members()


def effect_names(told_by: str = RESPONSES) -> tuple[str, ...]:
    """The contract's names of the effects that recordings of a kind can tell, each once."""
    return tuple(dict.fromkeys(t.name for t in effect_types() if told_by in t.told_by))


def candidates_of(
    context: SearchContext, names: Collection[str] | None = None, told_by: str = RESPONSES
) -> list[Effect]:
    """Every effect (None: all; else those of these names) at every place, that recordings of a kind
    can tell; none between ground and a base, whose motion is given."""
    found = [
        effect
        for t in effect_types()
        if t.sought and told_by in t.told_by and (names is None or t.name in names)
        for effect in t.candidates(context)
    ]
    moved = base_labels(context.model)
    return [e for e in found if not _against(e, moved)] if moved else found


def _against(effect: Effect, moved: frozenset[str]) -> bool:
    """Whether an effect would hold or load a DOF whose motion is given."""
    place = effect.place
    if isinstance(effect.action, ChannelFault) or place.elements or len(place.nodes) != 1:
        return False
    return f"n{place.nodes[0]}.{place.dof}" in moved


def told(name: str, place: Place) -> Effect:
    """An effect that is only to be told of: nothing of it can be fitted.

    Raises
    ------
    ModelError
        For a name that no effect has.
    """
    for t in effect_types():
        if t.name == name:
            return Effect(t, place, ModelChange(_nothing, ()), ())
    raise ModelError(f"no effect is called {name!r}. Known: {', '.join(effect_names())}.")


def _nothing() -> Model:
    raise ModelError("this effect is only to be told of: it has no model.")


def writers() -> dict[str, Writer]:
    """How every element that an effect may add is written, by its kind."""
    return {kind: write for t in effect_types() for kind, write in t.writers}


__all__ = [
    "EFFECTS",
    "MOTION",
    "Effect",
    "EffectType",
    "candidates_of",
    "effect_names",
    "effect_types",
    "told",
    "writers",
]

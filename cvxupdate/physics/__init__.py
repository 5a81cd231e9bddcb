"""The catalogue: what the model gains by each physics word, where it can stand, its signs and its
tell-tale. One list."""

from cvxupdate.physics import (
    added_mass,
    attached_resonator,
    changes,
    grounding_spring,
    gyroscopic,
    joint_flexibility,
    sensor_fault,
    viscous_damper,
)

CATALOGUE = {
    "stiffness_change": changes.stiffness_change,
    "mass_change": changes.mass_change,
    "thickness_change": changes.thickness_change,
    "orthotropy": changes.orthotropy,
    "added_mass": added_mass.candidates,
    "grounding_spring": grounding_spring.candidates,
    "joint_flexibility": joint_flexibility.candidates,
    "shear_deformation": changes.shear_deformation,
    "axial_preload": changes.axial_preload,
    "gyroscopic": gyroscopic.candidates,
    "attached_resonator": attached_resonator.candidates,
    "viscous_damper": viscous_damper.candidates,
    "structural_damping": changes.structural_damping,
    "mass_proportional_damping": changes.mass_proportional_damping,
    "sensor_fault": sensor_fault.candidates,
}

__all__ = ["CATALOGUE"]

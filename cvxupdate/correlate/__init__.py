"""Model against measurement: pure functions of arrays (section 2.2)."""

from cvxupdate.correlate.balance import (
    ElementBalance,
    balance_map,
    element_balance,
    force_balance,
    static_balance,
    static_difference,
)
from cvxupdate.correlate.compare import compare
from cvxupdate.correlate.elements import ElementBatch, element_energies
from cvxupdate.correlate.energy import (
    EnergyComparison,
    element_energy_fractions,
    energy_comparison,
    energy_map,
)
from cvxupdate.correlate.frequency import frequency_errors, frequency_scatter
from cvxupdate.correlate.frf import (
    FrfCorrelation,
    fdac,
    frac,
    frf_correlation,
    frf_error,
    frf_errors,
)
from cvxupdate.correlate.groups import GroupMatrices, element_batches, group_balance, group_matrices
from cvxupdate.correlate.mac import comac, mac, mac_error, modal_scale_factor, paired_mac
from cvxupdate.correlate.orthogonality import (
    ImprovedMass,
    PseudoOrthogonality,
    cross_orthogonality,
    improved_mass,
    mass_normalised,
    mass_orthogonality,
    off_diagonal,
    pseudo_orthogonality,
    reduced_pseudo_orthogonality,
    weighted_mac,
)
from cvxupdate.correlate.pairing import Pairing, pair_frequencies, pair_modes
from cvxupdate.correlate.reciprocal import ReciprocalVectors, reciprocal_vectors
from cvxupdate.correlate.response_error import response_errors
from cvxupdate.correlate.result import (
    Compared,
    FrfComparison,
    Geometry,
    ModePair,
    Part,
    SensorReport,
    ShapeComparison,
)
from cvxupdate.correlate.summary import Correlation, correlation

__all__ = [
    "Compared",
    "Correlation",
    "ElementBalance",
    "ElementBatch",
    "EnergyComparison",
    "FrfComparison",
    "FrfCorrelation",
    "Geometry",
    "GroupMatrices",
    "ImprovedMass",
    "ModePair",
    "Pairing",
    "Part",
    "PseudoOrthogonality",
    "ReciprocalVectors",
    "SensorReport",
    "ShapeComparison",
    "balance_map",
    "comac",
    "compare",
    "correlation",
    "cross_orthogonality",
    "element_balance",
    "element_batches",
    "element_energies",
    "element_energy_fractions",
    "energy_comparison",
    "energy_map",
    "fdac",
    "force_balance",
    "frac",
    "frequency_errors",
    "frequency_scatter",
    "frf_correlation",
    "frf_error",
    "frf_errors",
    "group_balance",
    "group_matrices",
    "improved_mass",
    "mac",
    "mac_error",
    "mass_normalised",
    "mass_orthogonality",
    "modal_scale_factor",
    "off_diagonal",
    "pair_frequencies",
    "pair_modes",
    "paired_mac",
    "pseudo_orthogonality",
    "reciprocal_vectors",
    "reduced_pseudo_orthogonality",
    "response_errors",
    "static_balance",
    "static_difference",
    "weighted_mac",
]

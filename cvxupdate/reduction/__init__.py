"""Reduction and expansion: one transformation for both (sections 2.4, 2.5), and the choice of
sensor places."""

from cvxupdate.reduction.dynamic import dynamic, gysin, kidder, petersmann
from cvxupdate.reduction.modal import hybrid_tam, serep, serepa, tam
from cvxupdate.reduction.sensors import Visibility, effective_independence, qr_places, visibility
from cvxupdate.reduction.split import Partition, partition
from cvxupdate.reduction.static import craig_bampton, guyan, irs, iterated_irs
from cvxupdate.reduction.transformation import Transformation, expand_each, reduced_modes

__all__ = [
    "Partition",
    "Transformation",
    "Visibility",
    "craig_bampton",
    "dynamic",
    "effective_independence",
    "expand_each",
    "guyan",
    "gysin",
    "hybrid_tam",
    "irs",
    "iterated_irs",
    "kidder",
    "partition",
    "petersmann",
    "qr_places",
    "reduced_modes",
    "serep",
    "serepa",
    "tam",
    "visibility",
]

"""Regularisers of the convex step, one small file each."""

from .common import RULES, Regulariser
from .entropy import Entropy
from .group_l1 import GroupL1, groups_by_carrier
from .l1 import L1
from .prior import Prior
from .robust import Robust
from .tikhonov import Tikhonov
from .total_variation import TotalVariation

REGULARISERS = (Tikhonov, L1, GroupL1, TotalVariation, Entropy, Robust, Prior)

__all__ = [
    "L1",
    "REGULARISERS",
    "RULES",
    "Entropy",
    "GroupL1",
    "Prior",
    "Regulariser",
    "Robust",
    "Tikhonov",
    "TotalVariation",
    "groups_by_carrier",
]

"""Regularisers of the convex step, one small file each."""

from .common import RULES, Regulariser
from .group_l1 import GroupL1, groups_by_carrier
from .l1 import L1
from .tikhonov import Tikhonov

REGULARISERS = (Tikhonov, L1, GroupL1)

__all__ = ["L1", "REGULARISERS", "RULES", "GroupL1", "Regulariser", "Tikhonov", "groups_by_carrier"]

"""Model against measurement: pure functions of arrays (thesis 2.2)."""

from cvxupdate.correlate.mac import comac, mac, mac_error, modal_scale_factor, paired_mac
from cvxupdate.correlate.pairing import Pairing, pair_frequencies, pair_modes

__all__ = ["Pairing", "comac", "mac", "mac_error", "modal_scale_factor", "pair_frequencies", "pair_modes", "paired_mac"]

"""The kinds of laws, by number."""

from __future__ import annotations

LINEAR, CUBIC, CLEARANCE, FRICTION, JENKINS, BOUC_WEN, QUADRATIC = range(7)
BOTH = 0.0  # third parameter of a clearance with contact on both sides; else the sign of its side

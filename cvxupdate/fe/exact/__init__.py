"""Exact members: dynamic stiffness from the differential equation, without a mesh (thesis 8.6)."""

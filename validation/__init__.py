"""What validates cvxupdate on problems with a known answer, and makes those problems; not part of
the package."""

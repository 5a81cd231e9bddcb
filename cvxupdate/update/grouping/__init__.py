"""Macro elements that the recordings choose (thesis 8.3, 8.5): which single parameters become
one."""

from cvxupdate.update.grouping.choose import grouped

__all__ = ["grouped"]

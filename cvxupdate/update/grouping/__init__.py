"""Macro elements that the recordings choose (thesis 8.3, 8.5): which single parameters become
one."""

from cvxupdate.update.grouping.choose import Grouping, grouped

__all__ = ["Grouping", "grouped"]

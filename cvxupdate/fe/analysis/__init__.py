"""The analysis model: the structure of a problem file on a mesh fine enough, on the DOFs of the
file and a few inner ones.

Every element of the file keeps its number, its nodes and its properties, and gets the matrices of
its refined parts, reduced to the DOFs of its nodes, coordinates of its edges and of its inside
(component modes: Craig and Bampton 1968; edges by polynomials). Whatever places effects,
parameters, sensors or supports on the file's model does so on this one, and nothing that is
computed with it grows with the refinement.
"""

from cvxupdate.fe.analysis.model import DIVIDED, Analysis, analysis_of, as_stated

__all__ = ["DIVIDED", "Analysis", "analysis_of", "as_stated"]

"""cvxupdate: update structural dynamics models by convex programs, and say what physics they leave out."""

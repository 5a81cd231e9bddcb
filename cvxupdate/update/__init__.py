"""The loops: linearise, solve the convex step, repeat."""

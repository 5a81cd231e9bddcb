"""Tables and figures of the thesis again, and what became of its claims. ``python -m
validation.studies`` lists the studies; problems/bay/noise.md and problems/structure_a/source.md
quote them. None is about a user's task: those are in `examples/`."""

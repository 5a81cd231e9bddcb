"""Shell elements in parts: outline and shape functions, frames, bending, membrane, inertia."""

"""The finite-element layer: elements, assembly, parameters, natural modes."""

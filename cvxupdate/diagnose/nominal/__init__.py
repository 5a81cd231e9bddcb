"""The nominal model: its nuisance parameters and their scatter, damping, supports, mesh error."""

"""How model and recordings become a linear system ``A p ≈ b``."""

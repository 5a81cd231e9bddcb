"""Evidence from tables of modes."""

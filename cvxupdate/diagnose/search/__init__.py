"""Hypotheses sought: one effect, several, the nuisance parameters let go far."""

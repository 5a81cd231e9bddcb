"""Judgement on hypotheses, the same for every kind of evidence: acceptance, alternatives,
confidence, placebo."""

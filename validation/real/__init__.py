"""The public data sets of problems/real: their problem files, their table, their diagnoses."""

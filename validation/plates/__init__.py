"""Plates and frames whose truth CalculiX computes: a laboratory that is nobody's relative."""

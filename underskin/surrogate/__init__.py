"""Readers of the finite-element tables."""

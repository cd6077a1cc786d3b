"""Mechanisms that a lab declares in files (`mechanism/1`): a law as an expression, read and never executed."""

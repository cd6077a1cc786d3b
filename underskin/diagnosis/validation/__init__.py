"""Checks of the answer: held-out groups, and what the design cannot tell."""

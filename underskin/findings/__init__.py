"""Findings: what looks wrong in data, or limits an answer, as codes with arguments, and their sentences."""

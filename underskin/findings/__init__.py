"""Findings: what looks wrong in data, or limits an answer, as codes with arguments; `english` makes the sentences."""

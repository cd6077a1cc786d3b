"""Where recordings and model differ, and what physics was left out.

Data flow one way, one folder a step: data and noise → slips → inference → selection → validation and planning →
localisation → reporting; `pipeline` calls them. docs/how-it-works.md describes them.
"""

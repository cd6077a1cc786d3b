"""Where recordings and model differ, and what physics was left out.

Data flow one way, one file a step: lines (with line_noise) → likelihood → fit → search → report → plan.
"""

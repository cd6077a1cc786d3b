"""The forward model for given conditions, and what is said of its answers."""

"""The forward model for given conditions, and checks and messages on its answers."""

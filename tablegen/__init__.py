"""Makes the tables by finite elements."""

"""Which sets are compared, and how probable each is."""

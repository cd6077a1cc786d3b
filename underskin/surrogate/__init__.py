"""What reads the finite-element tables."""

"""The recordings as a diagnosis uses them."""

"""Tables of the skin by finite elements: the only place of the project that solves."""

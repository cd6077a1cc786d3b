"""The servers that ours is measured against; each answers from the same spline."""

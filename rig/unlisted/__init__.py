"""Virtual measurement campaigns of an electronic skin, each with one hidden law that is in no catalogue."""

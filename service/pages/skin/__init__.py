"""The page of a skin."""

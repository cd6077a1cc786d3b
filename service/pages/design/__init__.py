"""The page of a skin before it is built."""

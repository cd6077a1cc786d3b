"""The page of the catalogue of mechanisms."""

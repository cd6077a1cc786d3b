"""The page of mechanisms, made from the catalogue: `make mechanisms`."""

"""The page of single measured values of the FRF."""

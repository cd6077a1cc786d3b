"""FRFs from time series, their flat zone, and checks of signals."""

"""Several loads, or a map of pressure, on an array of sensors."""

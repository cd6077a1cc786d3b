"""Where mains put charge on the leads of a sensor: at their frequency and its harmonics."""

import numpy as np

MAINS_HZ = (50.0, 60.0)
HARMONICS = np.arange(1, 6)  # 1: the fundamental
HARMONIC_WIDTH_HZ = 3.0  # from a harmonic: windows and the drift of mains make lines that wide

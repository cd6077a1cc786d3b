"""Priors of the scatter of gains and positions of a usual rig, before any recording.

The mixed model of d33 and the likelihood of a diagnosis use these.
"""

GAIN_RANGE = (0.01, 0.05)  # relative standard deviation of a recording's gain: a good rig and a poor one
USUAL_GAIN = 0.022  # about the geometric mean of that range
POSITION_RANGE = (0.05e-3, 0.3e-3)  # standard deviation of the sphere's position in x and in y [m], where it scatters
NO_POSITION_SCATTER = 0.7  # probability that a rig's positions do not scatter: most stages repeat to some µm

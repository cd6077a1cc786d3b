"""The noise of lines, curves, gains and positions, and its priors."""

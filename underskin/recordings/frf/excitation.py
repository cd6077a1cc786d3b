"""Which lines of FRFs the force excited: those at which the charge follows it, as the coherence tells.

Lines are gathered in bins of equal width in log f. Those of a bin whose median coherence is low were not excited, but
for the few among them whose own is high: a force of a few sines excites one line in many.
"""

from collections.abc import Sequence

import numpy as np

from underskin.recordings.frf.stacks import Stack
from underskin.units import Floats, Indices, Mask

_BINS_PER_DECADE = 12
_LEAST_COHERENCE = 0.5  # of bins whose lines count as excited
_CLEAR_COHERENCE = 0.9  # of a line that does among others that do not: noise alone hardly reaches it


def excited_lines(stacks: Sequence[Stack], frequencies: Floats) -> Mask:
    """At which lines the charge follows the force.

    Parameters
    ----------
    stacks : sequence of Stack
        The FRFs, with their coherence γ², NaN where it is not known.
    frequencies : (lines,) array
        [Hz] all that the stacks have, rising and above 0.

    Returns
    -------
    (lines,) mask
        By the median γ² of a line's bin, or clearly by that of its own; also where none is known, and at all lines
        where it follows at none. Of an even number of γ² the lower middle one counts: a bin of which half was excited
        is judged line by line.
    """
    line = np.concatenate(
        [np.broadcast_to(np.searchsorted(frequencies, one.frequency), one.coherence.shape).ravel() for one in stacks]
    )
    coherence = np.concatenate([one.coherence.ravel() for one in stacks])
    line, coherence = line[np.isfinite(coherence)], coherence[np.isfinite(coherence)]
    edges = edges_over(frequencies)
    bins = bin_of(frequencies, edges)
    of_bins = _lower_medians(bins[line], coherence, len(edges) - 1)
    of_lines = _lower_medians(line, coherence, len(frequencies))
    follows = ~(of_bins[bins] < _LEAST_COHERENCE) | (of_lines >= _CLEAR_COHERENCE)
    return follows if follows.any() else np.ones_like(follows)


def edges_over(frequencies: Floats) -> Floats:
    """The edges [Hz] (bins + 1,) of bins of equal width in log f from the first of the frequencies to the last."""
    decades = float(np.log10(frequencies[-1] / frequencies[0]))
    return np.geomspace(frequencies[0], frequencies[-1], max(1, round(_BINS_PER_DECADE * decades)) + 1)


def bin_of(frequency: Floats, edges: Floats) -> Indices:
    """The number of each frequency's bin, of the same shape."""
    return np.asarray(np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, len(edges) - 2))


def _lower_medians(group: Indices, values: Floats, groups: int) -> Floats:
    """The lower median of the values of each group (groups,); NaN of those without any."""
    medians = np.full(groups, np.nan)
    order = np.argsort(group, kind="stable")
    known, first = np.unique(group[order], return_index=True)
    parts = np.split(values[order], first[1:])
    medians[known] = [np.sort(part)[(len(part) - 1) // 2] for part in parts] if len(known) else []
    return medians

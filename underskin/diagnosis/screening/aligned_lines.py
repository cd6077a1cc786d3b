"""The lines of recordings as FRFs in phase with the force: without a delay of the chain, which turns them."""

from collections.abc import Sequence

from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.delay import advanced, common_delay
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.stacks import stacked
from underskin.units import Complexes


def aligned_lines(entries: Sequence[FrfRecording]) -> list[Complexes]:
    """The values [C/N] of each recording's lines without the delay that all of them share."""
    measured = [lines_of(entry) for entry in entries]
    delay = common_delay(stacked(measured))
    return [advanced(own.values, own.frequency, delay) if delay else own.values for own in measured]

"""Stiffening that only the beginning of compression curves tells: a platen that seats, tilted or on an uneven end.

While a wedge closes the force rises too slowly, and from full contact on linearly, shifted by half the wedge: as a
whole the curve looks stiffer at its end than at its beginning. Stiffening goes on, seating does not: what only the
first tenth of the displacement tells is seating. Samples that are pulled are gripped, and seat on nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.selection.priors import SHOWS
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, CompressionRecording, Recording, samples_of
from underskin.surrogate.sigma_table import SigmaTable

_BEGINNING = 0.1  # of each curve's displacement


def without_seating(
    campaign: Campaign, names: Sequence[str], table: SigmaTable
) -> tuple[FittingProblem, Finding] | None:
    """The rest of the curves and the finding, where the rest speaks no more for the stiffening among `names`.

    A law that needs a curve's whole history, such as relaxation, cannot be fitted to the rest: nothing is tried.
    """
    imitated = [name for name in names if name in CATALOGUE and CATALOGUE[name].imitated_by_seating]
    if not imitated or any(CATALOGUE[name].needs_history for name in names):
        return None
    if not all(_is_pressed(entry) for entry in campaign.recordings):
        return None
    rows = curve_lines(_without_beginning(campaign), "compression")
    if rows.recordings < len(campaign.recordings):
        return None
    problem = FittingProblem(rows, table)
    (stiffer,) = problem.explain([Request(tuple(names))])
    (plain,) = problem.explain([Request(tuple(name for name in names if name not in imitated))])
    assert stiffer is not None
    assert plain is not None
    if stiffer.log_evidence - plain.log_evidence > SHOWS:
        return None
    arguments = {"percent": 100 * _BEGINNING, "mechanisms": " and ".join(imitated)}
    return problem, Finding(Reason.SEATING, "", "displacement_mm", arguments)


def _is_pressed(entry: Recording) -> bool:
    """Whether it is pressed, and no farther pulled."""
    assert isinstance(entry, CompressionRecording)
    moved = entry.displacement_mm - entry.displacement_mm[0]
    return float(moved.max()) > -float(moved.min())


def _without_beginning(campaign: Campaign) -> Campaign:
    kept = []
    for entry in campaign.recordings:
        assert isinstance(entry, CompressionRecording)
        moved = np.abs(entry.displacement_mm - entry.displacement_mm[0])
        kept.append(samples_of(entry, moved > _BEGINNING * np.nanmax(moved)))
    return replace(campaign, recordings=tuple(kept))

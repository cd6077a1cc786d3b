"""The figure of a campaign's FRFs: of all its recordings, of a sensor's, or of one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.parse import quote

from service.pages.shared.figures import Drawn, drawn
from service.store import AnyRow
from service.usecases.figure_data import MOST_SINGLE, measured, spreads, spreads_of
from underskin.recordings.campaign import Campaign, FrfRecording


def drawn_frf(
    row: AnyRow,
    loaded: Callable[[], Campaign],
    answer: Mapping[str, Any],
    stored_spreads: Sequence[Mapping[str, Any]] | None,
    show: str,
) -> list[Drawn]:
    """Empty where no recording is shown. `loaded`: the campaign with all numbers; `answer`: its d33; `stored_spreads`:
    those of its conditions, if stored; `show`: a sensor or a recording, empty for all."""
    from underskin.figures.frf import frf_overview, frf_recordings
    from underskin.recordings.frf import thinned_lines

    band = answer["band"]
    zone = None if band is None else (band["low_hz"], band["high_hz"])
    page = f"/campaigns/{row.id}/frf.csv?show={quote(show, safe='')}"
    if show or stored_spreads is None:
        chosen = measured(loaded(), show)
        if not chosen:
            return []
        if len(chosen) <= MOST_SINGLE:
            lines = [thinned_lines.lines_of(_title(recording, show), frf) for recording, frf in chosen]
            conditions = _conditions([recording for recording, _ in chosen])
            about = "Magnitude, phase and coherence of each recording; R is the sphere's radius."
            about += " Colours tell preloads apart, marks along the lines spheres." if conditions else ""
            return [drawn("frf", frf_recordings(lines, zone, conditions), about, page)]
        summaries = spreads_of(chosen)
    else:
        summaries = spreads(stored_spreads)
    count = sum(spread.recordings for spread in summaries)
    about = (
        f"{count} recordings: for each sphere and preload the median magnitude "
        "and phase and the lowest coherence; as a band, the magnitudes of all its recordings. R is the sphere's radius."
    )
    return [drawn("frf", frf_overview(summaries, zone), about, page)]


def _conditions(recordings: Sequence[FrfRecording]) -> list[tuple[float, float]]:
    """Sphere [mm] and preload [N] of each recording, where these are of one sensor under several loads."""
    conditions = [(recording.indenter_radius_mm, recording.preload_n) for recording in recordings]
    of_one_sensor = len({recording.sensor for recording in recordings}) == 1
    return conditions if of_one_sensor and len(set(conditions)) > 1 else []


def _title(recording: FrfRecording, show: str) -> str:
    where = "" if show == recording.sensor else f"{recording.sensor}, "
    return f"{where}R {recording.indenter_radius_mm:.3g} mm, {recording.preload_n:.3g} N"

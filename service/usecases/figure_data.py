"""The numbers of a campaign's figures, of almost constant size: stored with its d33, so that figures need not read
its recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from underskin import InvalidInput
from underskin.figures.campaign_figures import model_frf
from underskin.inversion.invert import Inversion
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf import thinned_lines
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.spectra import Frf
from underskin.recordings.frf.thinned_lines import FrfSpread
from underskin.units import to_lab

MOST_SINGLE = 48  # recordings whose lines are drawn one by one, from the recordings
_RANGES = ("magnitude_pc_per_n", "phase_deg", "coherence")


def numbers(
    campaign: Campaign, inversion: Inversion | None, known_spreads: list[dict[str, Any]] | None = None
) -> dict[str, Any]:
    """`recordings`: columns of FRF against preload; `spreads`: FRFs of equal recordings over all lines, independent
    of the band and therefore possibly `known_spreads`; None if they are few."""
    few = len(campaign.of(FrfRecording)) <= MOST_SINGLE
    lines = [] if known_spreads or few else measured(campaign)
    alike = [_plain(spread) for spread in spreads_of(lines)] if len(lines) > MOST_SINGLE else None
    return {
        "recordings": {} if inversion is None else _preload_columns(campaign, inversion),
        "spreads": known_spreads or alike,
    }


def measured(campaign: Campaign, show: str = "") -> list[tuple[FrfRecording, Frf]]:
    """The FRF recordings that have an FRF, optionally only the one called `show` or those of the sensor of that
    name."""
    pairs = []
    for recording in campaign.of(FrfRecording):
        if show in ("", recording.sensor, recording.id):
            try:
                pairs.append((recording, lines_of(recording)))
            except InvalidInput:
                continue
    return pairs


def frf_columns(campaign: Campaign, show: str = "") -> dict[str, list[Any]]:
    """Every line of the recordings, or of those of `show`."""
    names = ("recording", "sensor", "frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence")
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for recording, frf in measured(campaign, show):
        count = len(frf.values)
        columns["recording"] += [recording.id] * count
        columns["sensor"] += [recording.sensor] * count
        columns["frequency_hz"] += frf.frequency.tolist()
        columns["frf_re_pc_per_n"] += to_lab("frf_pc_per_n", frf.values.real).tolist()
        columns["frf_im_pc_per_n"] += to_lab("frf_pc_per_n", frf.values.imag).tolist()
        columns["coherence"] += [None] * count if frf.coherence is None else frf.coherence.tolist()
    return columns


def spreads(cached: Sequence[Mapping[str, Any]]) -> list[FrfSpread]:
    """Those of `numbers` again."""
    return [
        FrfSpread(
            **{
                **cached_answer,
                "frequency_hz": np.array(cached_answer["frequency_hz"], dtype=float),
                **{name: tuple(np.array(values, dtype=float) for values in cached_answer[name]) for name in _RANGES},
            }
        )
        for cached_answer in cached
    ]


def _preload_columns(campaign: Campaign, inversion: Inversion) -> dict[str, list[Any]]:
    """FRF in the flat zone against preload, a row a recording."""
    rows = inversion.recordings
    return {
        "recording": list(rows.ids),
        "sensor": [inversion.sensor_ids[number] for number in rows.sensor.tolist()],
        "indenter_radius_mm": to_lab("indenter_radius_mm", rows.indenter_radius).tolist(),
        "preload_n": rows.preload.tolist(),
        "frf_pc_per_n": to_lab("frf_pc_per_n", rows.frf).tolist(),
        "frf_uncertainty_pc_per_n": to_lab("frf_pc_per_n", rows.frf_uncertainty).tolist(),
        "model_frf_pc_per_n": to_lab("frf_pc_per_n", model_frf(campaign, inversion)).tolist(),
    }


def spreads_of(measured_frfs: Sequence[tuple[FrfRecording, Frf]]) -> list[FrfSpread]:
    """FRFs of recordings alike."""
    conditions = [(recording.indenter_radius_mm, recording.preload_n) for recording, _ in measured_frfs]
    return thinned_lines.spreads([frf for _, frf in measured_frfs], conditions)


def _plain(spread: FrfSpread) -> dict[str, Any]:
    ranges = {name: [values.tolist() for values in getattr(spread, name)] for name in _RANGES}
    return {**asdict(spread), "frequency_hz": spread.frequency_hz.tolist(), **ranges}

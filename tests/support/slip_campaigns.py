"""Campaigns with a slip of a lab, recording by recording, and what a report names in them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import pytest

from tests.support.diagnosis_campaigns import Made
from tests.support.lean_reports import beside, whole_report
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.surrogate.sigma_table import SigmaTable

MADE = Made(sensors=3, repeats=2, lines=20)
SLIPS = {"conjugated", "sensors_exchanged", "gain_steps", "warm_up", "weak", "strong", "sign_flipped"}
Change = Callable[[FrfRecording, int], FrfRecording]


def times(entry: FrfRecording, real: float, imaginary: float | None = None) -> FrfRecording:
    """The recording with its lines times a factor, their imaginary parts times another one."""
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    other = real if imaginary is None else imaginary
    return replace(entry, frf_re_pc_per_n=real * entry.frf_re_pc_per_n, frf_im_pc_per_n=other * entry.frf_im_pc_per_n)


def changed(made: Campaign, change: Change) -> Campaign:
    """The campaign with each recording changed, by its number too."""
    entries = frf_recordings(made)
    return replace(made, recordings=tuple(change(entry, number) for number, entry in enumerate(entries)))


def looked_at(campaign: Campaign, table: SigmaTable, *known: str) -> dict[str, Any]:
    """The report of a search among the known mechanisms alone: what is wrong with recordings is found before any."""
    return whole_report(campaign, table, *beside(*known))


@lru_cache(maxsize=8)
def right(campaign: Campaign, table: SigmaTable, *known: str) -> dict[str, Any]:
    """The same of a campaign without a slip, made once for several tests, which change nothing in it."""
    return looked_at(campaign, table, *known)


def slips(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Code and statement of each slip that a report names."""
    return [(entry["code"], entry["statement"]) for entry in report["findings"] if entry["code"] in SLIPS]


def named(campaign: Campaign, table: SigmaTable, *known: str) -> list[str]:
    """The codes of the slips that a report on the campaign names."""
    return [code for code, _ in slips(looked_at(campaign, table, *known))]


def put_right(report: Mapping[str, Any], good: Mapping[str, Any]) -> bool:
    """Whether the report comes to the numbers of another one, as that on the same recordings without a slip."""
    fit, expected = report["fit"]["before"], good["fit"]["before"]
    return report["verdict"] == good["verdict"] and all(
        ours == pytest.approx(theirs, rel=1e-6)
        for ours, theirs in (
            (report["d33"]["value"], good["d33"]["value"]),
            (report["d33"]["high"], good["d33"]["high"]),
            (fit["rmse_percent"], expected["rmse_percent"]),
        )
    )

"""Campaigns of time series that a quiet rig records, and what is found in them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from rig.description import parse
from rig.output import campaign_of_series
from rig.time_domain import record_series
from tests.support.rig_experiments import described
from underskin.recordings.campaign import Campaign, from_dict


def recorded(**changes: Any) -> Campaign:
    """A quiet rig's campaign of time series, 8 recordings."""
    drive = {"kind": "random", "sample_rate_hz": 512.0, "duration_s": 4.0, "charge_noise_pc": 0.02}
    drive |= changes.pop("drive", {})
    design = {"preloads_n": [0.5, 1.0, 2.0, 3.0], "indenters_mm": [4.0], "offsets_mm": [[0.0, 0.0]]}
    skin = {"array": {"columns": 2, "rows": 1, "pitch_mm": 4.0}}
    experiment = parse(described(drive=drive, lines=None, design=design, skin=skin, noise={"gain": 0.02}, **changes))
    campaign, refused = from_dict(campaign_of_series(*record_series(experiment)))
    assert not refused
    return campaign


def codes(report: Mapping[str, Any]) -> set[tuple[str, str, str]]:
    """Those that say that something is wrong: all of these have one preload axis only, and lines beside the band."""
    told = [entry for entry in report["findings"] if entry["code"] not in ("constant_axis", "lines_left_out")]
    return {(entry["code"], entry["recording"], entry["field"]) for entry in told}


def forces(campaign: Campaign, **changes: Any) -> Campaign:
    """Each recording with other fields; those that are functions, of the recording."""
    return replace(
        campaign,
        recordings=tuple(
            replace(entry, **{name: new(entry) if callable(new) else new for name, new in changes.items()})
            for entry in campaign.recordings
        ),
    )

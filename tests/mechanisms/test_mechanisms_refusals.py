"""What a campaign cannot support, and requests that make no model, are refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.mechanism_campaigns import (
    SKIN,
    campaign,
    compression_campaign,
    frf_campaign,
    frf_recording,
    indentation_campaign,
    table,
)
from underskin.errors import InvalidInput
from underskin.mechanisms import Unsupported, compose
from underskin.recordings.campaign import Campaign, CompressionRecording, FrfRecording

REFUSALS: list[tuple[str, Campaign, str]] = [
    ("contact_creep", campaign([frf_recording()]), "recording 'r' has no dwell_s"),
    ("contact_creep", campaign([frf_recording(dwell_s=3.0)]), "dwell_s is the same"),
    ("ageing", campaign([frf_recording()]), "recording 'r' has no load_cycles"),
    ("ageing", campaign([frf_recording(load_cycles=3)]), "load_cycles is the same"),
    ("sensor_spread", campaign([frf_recording()]), "one sensor"),
    ("crosstalk", campaign([frf_recording()], replace(SKIN, sensors=SKIN.sensors[:1])), "no neighbours"),
    ("crosstalk", campaign([frf_recording()], replace(SKIN, thickness_mm=1.0)), "position_mm"),
    ("compressible_layer", campaign([frf_recording()], replace(SKIN, poisson_ratio=0.45)), "poisson_ratio 0.45"),
    (
        "mains_pickup",
        campaign([frf_recording(frequency_hz=FREQUENCIES) for FREQUENCIES in [np.geomspace(1, 30, 13)]]),
        "50 or 60 Hz",
    ),
    ("modulus_error", replace(indentation_campaign(), skin=replace(SKIN, youngs_modulus_mpa=None)), "not declared"),
    ("platen_friction", frf_campaign(), "does not act on recordings of kind frf"),
]


@pytest.mark.parametrize(("name", "recorded", "reason"), REFUSALS)
def test_a_campaign_that_cannot_support_it_is_told_why(name: str, recorded: Campaign, reason: str) -> None:
    with pytest.raises(Unsupported, match=reason) as refusal:
        compose([name], recorded, table())
    assert refusal.value.mechanism == name
    assert name in str(refusal.value)


def test_curves_without_times_cannot_support_creep() -> None:
    for timed in (indentation_campaign(), compression_campaign()):
        curves = [entry for entry in timed.recordings if not isinstance(entry, FrfRecording)]
        untimed = replace(timed, recordings=tuple(replace(entry, time_s=None) for entry in curves))
        with pytest.raises(Unsupported, match="has no time_s"):
            compose(["contact_creep"], untimed, table())


def test_bad_requests_are_named() -> None:
    both = replace(frf_campaign(), recordings=frf_campaign().recordings + compression_campaign().recordings)
    with pytest.raises(InvalidInput, match="several kinds"):
        compose([], both, table())
    assert compose([], both, table(), "compression").sensor is None
    for kind in ("indentation", "compression"):
        with pytest.raises(InvalidInput, match=f"kind = '{kind}': must be that of at least one"):
            compose([], frf_campaign(), table(), kind)
    with pytest.raises(InvalidInput, match="must be one of"):
        compose(["gravity"], frf_campaign(), table())
    with pytest.raises(InvalidInput, match="named once"):
        compose(["ageing", "ageing"], frf_campaign(), table())
    with pytest.raises(InvalidInput, match="must hold 3 coordinates"):
        compose([], frf_campaign(), table()).predict(np.zeros(2))


def one_way(speed_mm_per_s: float, hold_s: float = 0.0) -> CompressionRecording:
    displacement = np.append(np.linspace(0.0, 3.0, 40), np.full(10 if hold_s else 0, 3.0))
    held = hold_s * np.linspace(0.1, 1.0, 10) if hold_s else np.zeros(0)
    time = np.append(np.linspace(0.0, 3.0, 40), 3.0 + held * speed_mm_per_s) / speed_mm_per_s
    return CompressionRecording(f"{speed_mm_per_s}", 30.0, 30.0, displacement, 20 * displacement, time_s=time)


def test_creep_needs_times_that_displacements_do_not_tell() -> None:
    slow, fast, held = one_way(0.1), one_way(1.0), one_way(0.1, hold_s=60.0)
    for recordings in ((slow,), (slow, replace(slow, id="again"))):
        with pytest.raises(Unsupported, match="one way at one speed"):
            compose(["contact_creep"], Campaign("ramps", SKIN, recordings), table())
    for recordings in ((slow, fast), (held,)):
        assert compose(["contact_creep"], Campaign("ramps", SKIN, recordings), table()).names == ("contact_creep",)

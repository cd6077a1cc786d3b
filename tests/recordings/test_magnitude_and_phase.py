"""FRFs that an instrument wrote as magnitude and phase."""

from typing import Any

import numpy as np
import pytest

from tests.support.campaign_documents import SKIN
from underskin.errors import FileError, InvalidInput
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording

RIG: dict[str, Any] = {
    "schema": "rig/1",
    "skin": SKIN,
    "recording": {"sensor": "s01", "indenter_radius_mm": 4, "preload_n": 1, "dynamic_force_n": 0.09},
    "channels": {
        "frequency_hz": {"channel": "Frequency [Hz]"},
        "frf_magnitude_pc_per_n": {"channel": "Magnitude [nC/N]"},
        "frf_phase_deg": {"channel": "Phase"},
    },
}


def read(phase: str, values: tuple[float, ...], unit: str | None = None) -> Any:
    rows = "".join(f"{f},{m},{p:.6f}\n" for f, m, p in zip((10, 20, 40), (0.007, 0.008, 0.02), values, strict=True))
    channels = {**RIG["channels"], "frf_phase_deg": {"channel": phase, **({"unit": unit} if unit else {})}}
    rig = rig_description.from_dict({**RIG, "channels": channels})
    return read_file(f"Frequency [Hz],Magnitude [nC/N],{phase}\n{rows}".encode(), "bode.csv", rig)


@pytest.mark.parametrize(("phase", "unit"), [("Phase [deg]", None), ("Phase [rad]", None), ("Phase", "°")])
def test_magnitude_and_phase_are_both_parts_of_the_frf(phase: str, unit: str | None) -> None:
    degrees = np.array([-1, -5, -90])
    reading = read(phase, tuple(np.radians(degrees) if "rad" in phase else degrees), unit)
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    frf = np.asarray(recording.frf_re_pc_per_n) + 1j * np.asarray(recording.frf_im_pc_per_n)
    np.testing.assert_allclose(frf, np.array([7, 8, 20]) * np.exp(1j * np.radians(degrees)), rtol=1e-5, atol=1e-5)


def test_a_phase_without_a_unit_or_with_another_is_refused() -> None:
    with pytest.raises(FileError, match="has no unit in the file"):
        read("Phase", (-1, -5, -90))
    with pytest.raises(FileError, match="a phase is in deg or rad"):
        read("Phase [s]", (-1, -5, -90))


@pytest.mark.parametrize("missing", ["frf_magnitude_pc_per_n", "frf_phase_deg"])
def test_one_without_the_other_is_refused(missing: str) -> None:
    channels = {name: how for name, how in RIG["channels"].items() if name != missing}
    with pytest.raises(InvalidInput) as refused:
        rig_description.from_dict({**RIG, "channels": channels})
    assert missing in refused.value.field

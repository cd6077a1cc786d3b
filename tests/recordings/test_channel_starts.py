"""Channels that a file says were started at different times, or that have their own abscissae: TDMS and LVM."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from tests.recordings.contents_of_files import contents
from tests.support.campaign_documents import FRF, document
from tests.support.instrument_files import COMMON
from underskin.errors import FileError
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.reading import Reading

pytestmark = pytest.mark.slow

STEP = 1e-3
FORCE = np.random.default_rng(1).normal(1.0, 0.1, 200).round(6)
CHARGE = (7.4 * FORCE).round(6)
BEGAN = np.datetime64("2026-03-02T10:00:00.000000")
CHANNELS = {"force_n": {"channel": "Force"}, "charge_pc": {"channel": "Charge"}}


def read(data: bytes, name: str, channels: dict[str, Any] = CHANNELS, **recording: Any) -> Reading:
    described = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": {**COMMON, **recording}}
    return read_file(data, name, rig_description.from_dict({**described, "channels": channels}))


def the_series(reading: Reading) -> FrfRecording:
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    return recording


def tdms(late_us: int, offset_s: float = 0.0, step: float = STEP) -> bytes:
    """Charge begins so much later than force; a slow channel that nobody asks for beside them."""
    samples = round((late_us * 1e-6 + offset_s) / STEP)
    parts: Sequence[tuple[str, Any, dict[str, Any]]] = (
        ("Force", FORCE, {"unit_string": "N", "wf_start_time": BEGAN}),
        (
            "Charge",
            CHARGE[samples:],
            {"unit_string": "pC", "wf_start_time": BEGAN + np.timedelta64(late_us, "us"), "wf_start_offset": offset_s},
        ),
    )
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        slow = {"wf_increment": 1.0, "wf_start_time": BEGAN + np.timedelta64(9, "s")}
        channels = [ChannelObject("b", name, of, {"wf_increment": step, **about}) for name, of, about in parts]
        channels[0].properties["wf_increment"] = STEP
        writer.write_segment([*channels, ChannelObject("b", "Room", np.array([20.0, 21.0]), slow)])
    return buffer.getvalue()


@pytest.mark.parametrize(("late_us", "offset_s"), [(40_000, 0.0), (15_000, 0.025), (0, 0.007)])
def test_channels_are_aligned_by_their_starts(late_us: int, offset_s: float) -> None:
    reading = read(tdms(late_us, offset_s), "late.tdms")
    series = the_series(reading)
    assert series.force_n is not None
    assert series.charge_pc is not None
    np.testing.assert_allclose(series.charge_pc, 7.4 * series.force_n, atol=1e-5)
    assert series.sample_rate_hz == pytest.approx(1000)
    assert len(series.force_n) == len(FORCE) - round(1000 * (late_us * 1e-6 + offset_s))
    assert any(
        "'Force' starts at 2026-03-02T10:00:00Z, 'Charge' at 2026-03-02T10:00:00.0" in one for one in reading.warnings
    )


def test_starts_that_cannot_be_aligned_are_refused_with_both_times() -> None:
    with pytest.raises(
        FileError, match=r"'Force' starts at .*T10:00:00Z, 'Charge' at .*T10:00:00\.003400Z: .*3\.4 samples"
    ):
        read(tdms(3400), "late.tdms")
    with pytest.raises(FileError, match=r"'Force' starts at .*'Charge' at .*: they have no samples in common"):
        read(_disjoint(), "late.tdms")
    with pytest.raises(FileError, match="'Force' has 1000 samples a second, 'Charge' 2000: they must have one rate"):
        read(tdms(0, step=STEP / 2), "late.tdms", sample_rate_hz=1000)


def _disjoint() -> bytes:
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        later = BEGAN + np.timedelta64(5, "s")
        about = ({"unit_string": "N", "wf_start_time": BEGAN}, {"unit_string": "pC", "wf_start_time": later})
        both = zip(("Force", "Charge"), (FORCE, CHARGE), about, strict=True)
        writer.write_segment([ChannelObject("b", name, of, {"wf_increment": STEP, **one}) for name, of, one in both])
    return buffer.getvalue()


def lvm(
    units: Sequence[str], starts: Sequence[float], *, gaps: bool, names: Sequence[str] = ("Force", "Monitor", "Charge")
) -> bytes:
    """Three channels, each with a column of times; `gaps`: the header has empty cells above these."""
    between = "\t\t" if gaps else "\t"

    def row(name: str, values: Sequence[str]) -> str:
        return f"{name}\t{between.join(values)}\t\n"

    head = "LabVIEW Measurement\nSeparator\tTab\nX_Columns\tMulti\n***End_of_Header***\n\nChannels\t3\n"
    head += row("Samples", ["100"] * 3) + row("Y_Unit_Label", units) + row("X_Dimension", ["Time"] * 3)
    head += row("X0", [f"{start}" for start in starts]) + row("Delta_X", [f"{STEP}"] * 3) + "***End_of_Header***\n"
    head += "\t".join(f"X_Value\t{name}" for name in names) + "\tComment\n"
    first = [round(start / STEP) for start in starts]
    lines = []
    for sample in range(100):
        values = (FORCE[first[0] + sample], 2 * FORCE[first[1] + sample], 1e-2 * CHARGE[first[2] + sample])
        cells = [f"{start + sample * STEP:.6f}\t{value:.8f}" for start, value in zip(starts, values, strict=True)]
        lines.append("\t".join(cells))
    return (head + "\n".join(lines) + "\n").encode()


@pytest.mark.parametrize("gaps", [True, False])
@pytest.mark.parametrize("charge_unit", ["V", "mV"])
def test_each_lvm_channel_has_its_own_unit_and_start(charge_unit: str, gaps: bool) -> None:
    """The third channel is in its own unit; the rate is 1/Delta_X; the channels are aligned by X0."""
    amplifier = {"channel": "Charge", "sensitivity": 10, "sensitivity_unit": "mV/pC"}
    data = lvm(["N", "uV", charge_unit], [0.0, 0.0, 0.02], gaps=gaps)
    assert [one.unit for one in contents(data, "m.lvm").blocks[0].channels] == ["N", "uV", charge_unit]
    series = the_series(read(data, "m.lvm", {**CHANNELS, "charge_pc": amplifier}))
    assert series.sample_rate_hz == pytest.approx(1000)
    assert series.force_n is not None
    assert series.charge_pc is not None
    scale = 1.0 if charge_unit == "V" else 1e-3
    np.testing.assert_allclose(series.charge_pc, scale * 7.4 * series.force_n, atol=1e-4)
    assert len(series.force_n) == 80

"""Spectra are sorted and averaged, lines without a number left out, and clocks with few digits or jitter understood."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.recordings.test_magnitude_and_phase import RIG
from underskin.errors import FileError
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import FrfRecording, IndentationRecording
from underskin.recordings.regular_samples import even_rate, evenly_sampled
from underskin.units import Floats

FREQUENCIES = np.array([10.0, 20.0, 40.0, 80.0, 160.0])
FRF = np.array([7 - 0.1j, 7.1 - 0.2j, 7.2 - 0.4j, 7.3 - 0.8j, 7.5 - 1.6j])
PARTS = {"frequency_hz": {"channel": "f"}, "frf_re_pc_per_n": {"channel": "re"}, "frf_im_pc_per_n": {"channel": "im"}}


def frf(order: list[int], cells: dict[int, str] | None = None, values: Any = FRF) -> Reading:
    """The reading of a table whose rows are these lines of the FRF; `cells` replace the real part of rows."""
    rows = [
        f"{FREQUENCIES[line]},{(cells or {}).get(row, repr(float(values[line].real)))},{values[line].imag}"
        for row, line in enumerate(order)
    ]
    text = "\n".join(["f [Hz],re [pC/N],im [pC/N]", *rows])
    return read_file(text.encode(), "frf.csv", rig_description.from_dict({**RIG, "channels": PARTS}))


def frf_of_readings(gains: tuple[float, ...]) -> Reading:
    """As `frf`, each line read once with each of these gains, with 0.1 % of noise."""
    noise = np.random.default_rng(1).normal(scale=0.007, size=(len(FRF), len(gains)))
    order = np.repeat(np.arange(len(FRF)), len(gains)).tolist()
    readings = np.outer(FRF.real, gains) + noise
    return frf(order, {row: repr(float(cell)) for row, cell in enumerate(readings.ravel())}, FRF.real + 0j)


def assert_is_the_frf(reading: Reading, lines: slice = slice(None)) -> None:
    assert reading.problems == []
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.frequency_hz == pytest.approx(FREQUENCIES[lines])
    assert recording.frf_re_pc_per_n == pytest.approx(FRF.real[lines])
    assert recording.frf_im_pc_per_n == pytest.approx(FRF.imag[lines])


@given(st.permutations(range(len(FREQUENCIES))))
def test_lines_in_any_order_are_sorted(order: list[int]) -> None:
    reading = frf(order)
    assert_is_the_frf(reading)
    assert [note for note in reading.warnings if "sorted" in note] == reading.warnings
    assert bool(reading.warnings) == (order != sorted(order))


@given(st.lists(st.integers(1, 4), min_size=5, max_size=5), st.booleans(), st.booleans())
def test_readings_of_a_frequency_are_averaged(counts: list[int], down: bool, there_and_back: bool) -> None:
    order = [line for line, count in enumerate(counts) for _ in range(count)]
    order = order[::-1] if down else order
    order = [*order, *order[::-1]] if there_and_back else order
    reading = frf(order)
    assert_is_the_frf(reading)
    assert any("averaged" in note for note in reading.warnings) == (len(set(order)) < len(order))


@pytest.mark.parametrize(("gains", "word"), [((1.0, 1.0), "scatter by 0"), ((1.0, 0.97, 0.97), "0.97")])
def test_scatter_of_readings(gains: tuple[float, ...], word: str) -> None:
    """The note on an average says how far its readings lie apart, and whether they do so alike at all frequencies."""
    (note,) = frf_of_readings(gains).warnings
    assert word in note


def test_scatter_is_told_of_finite_readings() -> None:
    (note,) = frf([0, 0, 1, 1, 2, 3, 4], {1: "inf"}).warnings
    assert "averaged, all equal" in note


@pytest.mark.parametrize("gains", [(1.0, 0.7), (1.0, 0.9, 1.1, 0.5), (1.0, -1.0)])
def test_readings_of_several_recordings_are_no_average(gains: tuple[float, ...]) -> None:
    """Readings that differ alike at all frequencies, by a factor or in sign, are refused: which is right shows not."""
    with pytest.raises(FileError, match=rf"frequency_hz: .* number {len(gains)} is .* times the first; these may be"):
        frf_of_readings(gains)


@pytest.mark.parametrize("order", [[*range(5), *range(5)], [0, 1, 2, 0, 1, 2, 3, 4], [*range(5)] * 8])
def test_several_sweeps_are_no_average(order: list[int]) -> None:
    """Sweeps that start again may be of several sensors, and are refused."""
    with pytest.raises(FileError, match=r"frf\.csv: frequency_hz: the frequencies start again at 10 Hz and repeat"):
        frf(order)


@pytest.mark.parametrize("cell", ["nan", "NaN", "∞", "OVERLOAD"])
def test_lines_without_a_number_are_left_out(cell: str) -> None:
    reading = frf([0, 1, 2, 3, 4], {4: cell})
    assert_is_the_frf(reading, slice(4))
    assert any("1 of 5 lines without a number in frf_re_pc_per_n are left out" in note for note in reading.warnings)


def clock(rate: float, count: int = 3000) -> Floats:
    return np.asarray(0.25 + np.arange(count) / rate)


@given(st.floats(100, 40_000), st.integers(1, 3))
def test_a_clock_with_few_digits(rate: float, digits: int) -> None:
    """A clock's rate follows from all its times, however few digits they have, where each step still shows."""
    time = np.round(clock(rate), int(np.ceil(np.log10(rate))) + digits)
    found = even_rate(time)
    if found is not None:
        assert found == pytest.approx(rate, rel=2e-5)
    assert found is not None or digits < 2
    lost = np.delete(time, 1500)
    assert even_rate(lost) is None


@given(st.floats(200, 40_000), st.sampled_from(["{:.3g}", "{:.2E}", "{:.4g}", "{:.6g}", "{:.3f}", "{:.4f}"]))
def test_a_clock_printed_coarser_than_a_step(rate: float, form: str) -> None:
    """Times of few significant digits, or decimals, repeat: the rate is that of the line through all of them."""
    even = np.arange(4000) / rate
    time = np.array([float(form.format(moment)) for moment in even])
    force = np.sin(2 * np.pi * rate / 40 * even)
    try:
        columns, found, note = evenly_sampled({"force_n": force}, time)
    except ValueError:
        assert 0.4 < np.diff(time).max() * rate < 2.5  # a tick is about a step: it may hide a lost sample
        return
    assert found == pytest.approx(rate, rel=2e-4)
    assert columns["force_n"].tolist() == force.tolist() or "interpolated" in note
    assert bool(note) or np.unique(time).size == time.size


@pytest.mark.slow
@given(st.floats(0.01, 0.06), st.integers(0, 2**32))
def test_a_clock_with_jitter_is_resampled(jitter: float, seed: int) -> None:
    """Samples of a slow signal at times that vary are those of even times."""
    random = np.random.default_rng(seed)
    time = clock(1000.0)
    time = time + 1e-3 * jitter * random.uniform(-1.7, 1.7, size=len(time))

    def signal(at: Floats) -> Floats:
        return np.asarray(np.sin(2 * np.pi * 60 * at) + 0.5 * np.cos(2 * np.pi * 130 * at))

    columns, rate, note = evenly_sampled({"force_n": signal(time)}, time)
    assert rate == pytest.approx(1000.0, rel=1e-5)
    if note:
        assert "interpolated" in note
        start = (time - np.arange(len(time)) / rate).mean()
        even = start + np.arange(len(time)) / rate
        even = even[(even >= time[0]) & (even <= time[-1])]
        assert columns["force_n"][20:-20] == pytest.approx(signal(even)[20:-20], abs=5e-3)


@pytest.mark.parametrize("lost", [[700], [2000, 2001, 2002, 2500]])
def test_of_a_clock_with_gaps_the_longest_part_is_used(lost: list[int]) -> None:
    """Lost samples end a part; several gaps that leave less than half are refused by number and place."""
    time = clock(1000.0)
    kept = np.delete(np.arange(len(time)), lost)
    columns, rate, note = evenly_sampled({"force_n": kept.astype(float)}, time[kept])
    assert (np.diff(columns["force_n"]) == 1).all()
    assert len(columns["force_n"]) >= len(time) / 2
    assert rate == pytest.approx(1000.0, rel=1e-6)
    samples = "1 sample" if len(lost) == 1 else f"{len(lost)} samples"
    assert f"the clock misses {samples}, the first after {time[lost[0] - 1]:.6g} s" in note
    many = np.delete(time, [100, 600, 700, 1400, 1500, 2500])
    with pytest.raises(ValueError, match=r"the clock misses .* less than half: record again"):
        evenly_sampled({"force_n": np.ones(len(many))}, many)


@pytest.mark.parametrize("rate", [600.0, 700.0, 800.0, 950.0, 990.0, 997.0, 999.0, 1300.0])
def test_a_clock_as_coarse_as_a_step_is_not_accused_of_gaps(rate: float) -> None:
    """Of even times printed in milliseconds none is missing: more digits, or the rate, are asked for."""
    time = np.round(np.arange(3000) / rate, 3)
    with pytest.raises(ValueError, match=r"as coarse as a step.* more digits, or state sample_rate_hz"):
        evenly_sampled({"force_n": np.ones(len(time))}, time)


@pytest.mark.parametrize("change", ["a time comes twice", "two clocks", "backwards"])
def test_an_uneven_clock_is_refused(change: str) -> None:
    time = clock(1000.0)
    wrong = {
        "a time comes twice": np.concatenate([time[:700], time[699:]]),
        "two clocks": np.concatenate([time[:1500], time[1499] + np.arange(1, 1500) * 1.4e-3]),
        "backwards": time[::-1],
    }[change]
    with pytest.raises(ValueError, match="samples are not evenly spaced"):
        evenly_sampled({"force_n": np.ones(len(wrong))}, wrong)


def series(cells: dict[int, str]) -> Reading:
    channels = {"time_s": {"channel": "t"}, "force_n": {"channel": "F"}, "charge_pc": {"channel": "Q"}}
    rows = [f"{row / 1000},{1 + 0.1 * np.sin(row)},{cells.get(row, 0.7 * np.sin(row))}" for row in range(200)]
    text = "\n".join(["t [s],F [N],Q [pC]", *rows])
    return read_file(text.encode(), "run.csv", rig_description.from_dict({**RIG, "channels": channels}))


def test_the_longest_part_without_overload_is_used() -> None:
    reading = series(dict.fromkeys((40, 41, 42), "∞"))
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.charge_pc == pytest.approx(0.7 * np.sin(np.arange(43, 200)))
    assert recording.sample_rate_hz == pytest.approx(1000)
    assert "3 cells of column 'Q [pC]' hold '∞', the first on line 42" in reading.warnings[0]
    assert (
        "3 of 200 samples hold no number in charge_pc: the longest part without such samples has 157"
        in (reading.warnings[1])
    )
    with pytest.raises(FileError, match="less than half: record again within the range"):
        series(dict.fromkeys(range(10, 200, 40), "∞"))


DECIBELS = [
    ("Magnitude [dB re 1 pC/N]", None, 1.0),
    ("Magnitude (dB re. 1 nC/N)", None, 1000.0),
    ("Magnitude [dB]", "dB re 1 pC/N", 1.0),
    ("Magnitude [dB]", "dB (pC/N)", 1.0),
]


@pytest.mark.parametrize(("heading", "unit", "factor"), DECIBELS)
@pytest.mark.parametrize("phase", ["Phase [deg]", "Phase [rad]"])
def test_decibels_with_their_reference(heading: str, unit: str | None, factor: float, phase: str) -> None:
    angle = np.angle(FRF, deg="deg" in phase)
    rows = [
        f"{f},{20 * math.log10(abs(value) / factor)!r},{turn!r}"
        for f, value, turn in zip(FREQUENCIES.tolist(), FRF.tolist(), angle.tolist(), strict=True)
    ]
    channels: dict[str, Any] = {
        "frequency_hz": {"channel": "f"},
        "frf_magnitude_pc_per_n": {"channel": heading, **({"unit": unit} if unit else {})},
        "frf_phase_deg": {"channel": phase},
    }
    text = "\n".join([f"f [Hz],{heading},{phase}", *rows]).encode()
    assert_is_the_frf(read_file(text, "frf.csv", rig_description.from_dict({**RIG, "channels": channels})))


@pytest.mark.parametrize(
    ("heading", "unit"),
    [("M [dB]", None), ("M [dB]", "dB"), ("M [dB re 1 nC/N]", "dB re 1 pC/N"), ("M [dB re 1 V]", None)],
)
def test_decibels_without_their_reference_are_refused(heading: str, unit: str | None) -> None:
    channels: dict[str, Any] = {
        "frequency_hz": {"channel": "f"},
        "frf_magnitude_pc_per_n": {"channel": heading, **({"unit": unit} if unit else {})},
        "frf_phase_deg": {"channel": "p [deg]"},
    }
    text = f"f [Hz],{heading},p [deg]\n10,17,0\n20,17,0\n".encode()
    with pytest.raises(FileError, match="M "):
        read_file(text, "frf.csv", rig_description.from_dict({**RIG, "channels": channels}))


CURVE: dict[str, Any] = {
    "schema": "rig/1",
    "kind": "indentation",
    "skin": {"thickness_mm": {"property": "Thickness"}, "poisson_ratio": 0.5},
    "recording": {"indenter_radius_mm": {"property": "Radius"}},
    "channels": {
        "displacement_mm": {"channel": ["Extend Z [um]", "Retract Z [um]"]},
        "force_n": {"channel": ["Extend F [mN]", "Retract F [mN]"]},
    },
}
SIDE_BY_SIDE = "Extend Z [um],Extend F [mN],Retract Z [um],Retract F [mN]"


def curve(
    above: str, headings: str = SIDE_BY_SIDE, rows: str = "0,0,20,4\n10,1,15,2\n20,4,5,0\n", **changes: Any
) -> Reading:
    rig = rig_description.from_dict({**CURVE, **changes})
    return read_file(f"{above}\n{headings}\n{rows}".encode(), "curve.csv", rig)


def test_columns_side_by_side_are_one_curve() -> None:
    skin = {"thickness_mm": {"property": "Thickness (um)"}, "poisson_ratio": 0.5}
    recording_of = {"indenter_radius_mm": {"property": "Radius (mm)"}}
    reading = curve("Thickness (um): 2500\nRadius: 4 mm\n", skin=skin, recording=recording_of)
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.displacement_mm == pytest.approx([0, 0.01, 0.02, 0.02, 0.015, 0.005])
    assert recording.force_n == pytest.approx([0, 1e-3, 4e-3, 4e-3, 2e-3, 0])
    assert (reading.campaign.skin.thickness_mm, recording.indenter_radius_mm) == (2.5, 4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"headings": SIDE_BY_SIDE.replace("Retract F [mN]", "Retract F [uN]")}, "lacks"),
        ({"skin": {"thickness_mm": {"property": "Height"}}}, "property 'Height': is not in the file"),
        ({"kind": "frf"}, "is for curves"),
    ],
)
def test_what_cannot_be_joined_is_refused(changes: dict[str, Any], message: str) -> None:
    above = "Thickness: 2.5\nRadius: 4\n"
    with pytest.raises(Exception, match=message):
        curve(above, **changes)


WIDE: dict[str, Any] = {
    **RIG,
    "skin": {**RIG["skin"], "sensors": [{"id": "s01", "x_mm": 0, "y_mm": 0}, {"id": "s02", "x_mm": 8, "y_mm": 0}]},
    "recording": {name: value for name, value in RIG["recording"].items() if name != "sensor"},
    "channels": {"frequency_hz": {"channel": "f"}},
    "recordings": [
        {
            "sensor": sensor,
            "channels": {
                "frf_magnitude_pc_per_n": {"channel": f"{sensor} |H|"},
                "frf_phase_deg": {"channel": f"{sensor} phase"},
            },
        }
        for sensor in ("s01", "s02")
    ],
}


def test_a_pair_of_columns_for_each_sensor() -> None:
    headings = "f [Hz],s01 |H| [pC/N],s01 phase [deg],s02 |H| [pC/N],s02 phase [deg]"
    text = f"{headings}\n10,7,0,8,90\n20,7.5,0,8.5,90\n".encode()
    reading = read_file(text, "wide.csv", rig_description.from_dict(WIDE))
    assert reading.problems == []
    found = [recording for recording in reading.campaign.recordings if isinstance(recording, FrfRecording)]
    assert [(recording.id, recording.sensor) for recording in found] == [("wide s01", "s01"), ("wide s02", "s02")]
    assert found[0].frf_re_pc_per_n == pytest.approx([7, 7.5])
    assert found[1].frf_im_pc_per_n == pytest.approx([8, 8.5])
    with pytest.raises(FileError, match=r"lacks s02 \|H\|, s02 phase"):
        read_file(text.replace(b"s02", b"s03"), "wide.csv", rig_description.from_dict(WIDE))

"""Recordings given as time series: slips of units in what they hold, and lines that say nothing."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.experiment import parse
from rig.output import campaign_of_series
from rig.time_domain import record_series
from tests.rig_experiments import described
from underskin.diagnosis.diagnose import diagnosis_report
from underskin.diagnosis.findings import inspect
from underskin.recordings.campaign import Campaign, FrfRecording, from_dict
from underskin.surrogate import SigmaTable, load_table


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


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


@pytest.fixture(scope="module")
def quiet() -> Campaign:
    return recorded()


def times(campaign: Campaign, field: str, factor: float, *names: str) -> Campaign:
    """A field of some recordings, or of all, times a factor."""
    return replace(
        campaign,
        recordings=tuple(
            replace(entry, **{field: factor * getattr(entry, field)}) if entry.id in names or not names else entry
            for entry in campaign.recordings
        ),
    )


def codes(found: Any) -> set[tuple[str, str, str]]:
    """Those that say that something is wrong: all of these have one preload axis only, and lines beside the band."""
    usual = {"constant_axis", "lines_left_out"}
    return {(entry.code, entry.recording, entry.field) for entry in found if entry.code not in usual}


FIELDS = ("sample_rate_hz", "force_n", "charge_pc", "preload_n", "dynamic_force_n")


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("field", FIELDS)
def test_a_slip_of_one_recording_is_named_and_left_out(
    field: str, factor: float, quiet: Campaign, table: SigmaTable
) -> None:
    found = inspect(times(quiet, field, factor, "r003"), table)
    assert codes(found.found) == {("units_off_by_1000", "r003", field)}
    assert [entry.id for entry in found.campaign.recordings] == [
        entry.id for entry in quiet.recordings if entry.id != "r003"
    ]
    assert found.lacking == ""


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("field", FIELDS)
def test_a_slip_of_all_is_named(field: str, factor: float, quiet: Campaign, table: SigmaTable) -> None:
    """A charge in other units only scales d33; on other fields nothing is concluded."""
    found = inspect(times(quiet, field, factor), table)
    assert codes(found.found) == {("units_off_by_1000", "", field)}
    assert (found.lacking == "") == (field == "charge_pc")


def test_a_force_without_its_mean_is_told_by_its_oscillation(quiet: Campaign, table: SigmaTable) -> None:
    """A piezoelectric force cell shows no preload."""
    entries = []
    for entry in quiet.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.force_n is not None
        entries.append(replace(entry, force_n=entry.force_n - entry.force_n.mean()))
    coupled = replace(quiet, recordings=tuple(entries))
    assert codes(inspect(coupled, table).found) == set()
    found = inspect(times(coupled, "force_n", 1e3), table)
    assert codes(found.found) == {("units_off_by_1000", "", "force_n")}
    assert found.lacking


@pytest.mark.parametrize("sample_rate_hz", [512.0, 2048.0])
def test_lines_without_force_are_no_misfit(sample_rate_hz: float, table: SigmaTable) -> None:
    """Beside the excited band a line's noise is unlike the others'; mains were found there."""
    campaign = recorded(drive={"kind": "sweep", "sample_rate_hz": sample_rate_hz, "duration_s": 8.0})
    report = diagnosis_report(campaign, table)
    assert report["verdict"] == "no_mismatch"
    assert {entry["code"] for entry in report["findings"]} <= {"constant_axis", "damaged_samples", "lines_left_out"}
    (said,) = [entry["statement"] for entry in report["findings"] if entry["code"] == "lines_left_out"]
    assert "the force has little power" in said


def forces(campaign: Campaign, **changes: Any) -> Campaign:
    """Each recording with other fields; those that are functions, of the recording."""
    return replace(
        campaign,
        recordings=tuple(
            replace(entry, **{name: new(entry) if callable(new) else new for name, new in changes.items()})
            for entry in campaign.recordings
        ),
    )


def struck(quiet: Campaign) -> Campaign:
    """Blows of 2 ms in 4 s, seen by a force cell without the preload, their peak declared."""
    time = np.arange(4 * 4096) / 4096.0
    blow = np.where((time > 0.1) & (time < 0.102), 0.09 * np.sin(np.pi * (time - 0.1) / 0.002), 0.0)
    random = np.random.default_rng(4)
    return forces(
        quiet,
        sample_rate_hz=4096.0,
        dynamic_force_n=0.09,
        force_n=lambda _: blow - blow.mean() + 1e-5 * random.normal(size=len(time)),
        charge_pc=lambda _: 7.0 * blow + 1e-4 * random.normal(size=len(time)),
    )


def relaxing(quiet: Campaign) -> Campaign:
    """2 mN of noise about a preload that falls by 30 % in two minutes."""
    time = np.arange(120 * 64) / 64.0
    random = np.random.default_rng(4)
    fall = 0.3 * (1 - np.exp(-time / 40.0))
    shaken = {entry.id: 0.002 / np.sqrt(2) * random.normal(size=len(time)) for entry in quiet.recordings}
    return forces(
        quiet,
        sample_rate_hz=64.0,
        dynamic_force_n=0.002,
        force_n=lambda entry: entry.preload_n * (1 - fall) + shaken[entry.id],
        charge_pc=lambda entry: (
            7.0 * (shaken[entry.id] - entry.preload_n * fall) + 1e-4 * random.normal(size=len(time))
        ),
    )


@pytest.mark.parametrize("excited", [struck, relaxing])
def test_neither_a_blow_nor_drift_of_the_force_is_a_slip(excited: Any, quiet: Campaign, table: SigmaTable) -> None:
    right = excited(quiet)
    assert "units_off_by_1000" not in {entry.code for entry in inspect(right, table).found}
    found = inspect(times(right, "force_n", 1e-3), table)
    assert codes(found.found) == {("units_off_by_1000", "", "force_n")}
    assert found.lacking


def test_a_force_said_to_be_right_is_used_all_the_same(quiet: Campaign, table: SigmaTable) -> None:
    slipped = times(quiet, "dynamic_force_n", 1e-3)
    assert not inspect(slipped, table).campaign.recordings
    found = inspect(replace(slipped, units_checked=True), table)
    assert ("units_off_by_1000", "", "dynamic_force_n") in codes(found.found)
    assert len(found.campaign.recordings) == len(quiet.recordings)
    assert found.lacking == ""


def test_slips_of_different_fields_are_each_told(quiet: Campaign, table: SigmaTable) -> None:
    slipped = times(times(quiet, "force_n", 1e3, "r001", "r002"), "preload_n", 1e-3, "r003", "r004")
    found = inspect(slipped, table)
    assert codes(found.found) == {
        ("units_off_by_1000", name, field)
        for name, field in (("r001", "force_n"), ("r002", "force_n"), ("r003", "preload_n"), ("r004", "preload_n"))
    }
    assert found.lacking


@pytest.mark.parametrize("drive", [
    {"kind": "sweep", "duration_s": 8.0},  # in step: the charge follows the force there all the same
    {"duration_s": 8.0},
    {"sample_rate_hz": 2048.0, "duration_s": 16.0},
])  # fmt: skip
def test_mains_are_told_and_their_lines_left_out(drive: dict[str, Any], table: SigmaTable) -> None:
    pickup = {"mains_pickup": {"charge_pc": 0.05, "mains_hz": 50.0}}
    report = diagnosis_report(recorded(effects=pickup, drive=drive), table)
    assert report["verdict"] == "no_mismatch"
    (said,) = [entry for entry in report["findings"] if entry["code"] == "mains_in_charge"]
    assert said["field"] == "charge_pc"
    assert "8 of 8 recordings" in said["statement"]
    assert "50 Hz" in said["statement"]
    charge = float(re.search("about ([0-9.]+) pC", said["statement"])[1])  # type: ignore[index]
    assert charge == pytest.approx(0.05, rel=0.15)


@pytest.mark.parametrize("kind", ["random", "sweep"])
def test_mains_beside_the_excited_band_are_said(kind: str, table: SigmaTable) -> None:
    drive = {"kind": kind, "low_hz": 70.0, "high_hz": 140.0, "duration_s": 8.0}
    campaign = recorded(effects={"mains_pickup": {"charge_pc": 0.1, "mains_hz": 60.0}}, drive=drive)
    assert ("mains_in_charge", "", "charge_pc") in codes(inspect(campaign, table).found)
    assert "mains_in_charge" not in {entry.code for entry in inspect(recorded(drive=drive), table).found}


def shaken(quiet: Campaign, table: SigmaTable, rate: float, made: Any) -> Campaign:
    """The campaign with each recording's force about its preload and charge as `made` of its level [pC/N] and of a
    generator of random numbers."""
    entries = []
    for number, entry in enumerate(inspect(quiet, table).campaign.recordings):
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        force, charge = made(float(np.median(entry.frf_re_pc_per_n)), np.random.default_rng(number))
        entries.append(
            replace(entry, sample_rate_hz=rate, dynamic_force_n=float(np.abs(force).max()), charge_pc=charge,
                    force_n=entry.preload_n + force, frequency_hz=None, frf_re_pc_per_n=None, frf_im_pc_per_n=None,
                    coherence=None)
        )  # fmt: skip
    return replace(quiet, recordings=tuple(entries))


def sixteen_times(spectrum: Any) -> Any:
    """A periodic signal of these amplitudes at the multiples of 1/T."""
    return np.tile(np.fft.irfft(np.append(0, spectrum)) * len(spectrum), 16)


def test_a_resonance_on_a_multiple_of_the_mains_is_none(quiet: Campaign, table: SigmaTable) -> None:
    """Its top is off the course of the lines around it, as mains are."""
    line = 4.0 * np.arange(1, 257)
    response = 1.0 / (1 - (line / 300.0) ** 2 + 0.06j * line / 300.0)

    def made(level: float, random: np.random.Generator) -> Any:
        force = 0.002 * np.exp(2j * np.pi * random.random(256)) * (line < 800)
        charge = sixteen_times(level * response * force)
        return sixteen_times(force), charge + 1e-3 * random.normal(size=len(charge))

    found = inspect(shaken(quiet, table, 2048.0, made), table)
    assert "mains_in_charge" not in {entry.code for entry in found.found}
    assert all(300.0 in list(entry.frequency_hz) for entry in found.campaign.recordings)  # type: ignore[union-attr, arg-type]


def test_lines_of_uneven_power_are_no_mains(quiet: Campaign, table: SigmaTable) -> None:
    """A periodic force has more power at one line than at the next, the same in all recordings; at 60 Hz little."""
    line = 2.0 * np.arange(1, 257)
    size = np.where(line < 200, np.where(line == 60.0, 0.0008, 0.003), 0.0)
    force = sixteen_times(size * np.exp(2j * np.pi * np.random.default_rng(7).random(256)))
    uneven = shaken(
        quiet, table, 1024.0, lambda level, random: (force, level * force + 0.02 * random.normal(size=len(force)))
    )
    report = diagnosis_report(uneven, table)
    assert report["verdict"] == "no_mismatch"
    assert "mains_in_charge" not in {entry["code"] for entry in report["findings"]}


def test_blows_too_weak_for_their_highest_lines_hide_nothing(quiet: Campaign, table: SigmaTable) -> None:
    """Of lines chosen by how certain each came out the larger would be kept."""
    time = np.arange(8 * 4096) / 4096.0

    def made(level: float, random: np.random.Generator) -> Any:
        starts = np.arange(8) + 0.1 + 0.2 * random.random(8)
        since = time - starts[np.clip(np.searchsorted(starts, time) - 1, 0, 7)]
        blows = np.where((since >= 0) & (since < 0.002), 0.09 * np.sin(np.pi * since / 0.002), 0.0)
        return blows + 1e-5 * random.normal(size=len(time)), level * blows + 0.04 * random.normal(size=len(time))

    assert diagnosis_report(shaken(quiet, table, 4096.0, made), table)["verdict"] == "no_mismatch"


@pytest.mark.parametrize(
    ("kind", "sample_rate_hz"), [("random", 512.0), ("random", 2048.0), ("sweep", 512.0), ("sweep", 2048.0)]
)
def test_what_a_time_series_hides_is_still_found(kind: str, sample_rate_hz: float, table: SigmaTable) -> None:
    """The lines next to 0 Hz of blocks would say more than a high-pass."""
    drive = {"kind": kind, "sample_rate_hz": sample_rate_hz, "duration_s": 8.0}
    report = diagnosis_report(recorded(effects={"amplifier_high_pass": {"corner_hz": 1.0}}, drive=drive), table)
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == (
        "explained",
        ["amplifier_high_pass"],
    )
    (corner,) = report["mechanisms"][0]["parameters"]
    assert corner["value"] == pytest.approx(1.0, rel=0.02)
    assert corner["low"] < 1.0 < corner["high"]


def test_exchanged_channels_are_told(quiet: Campaign, table: SigmaTable) -> None:
    """The charge has the preload for its mean and the dynamic force for its size, and the force has neither."""
    exchanged = tuple(
        replace(entry, force_n=entry.charge_pc, charge_pc=entry.force_n)  # type: ignore[union-attr, arg-type]
        for entry in quiet.recordings
    )
    found = inspect(replace(quiet, recordings=exchanged), table)
    assert codes(found.found) == {("channels_swapped", "", "force_n")}
    assert found.lacking
    one = inspect(replace(quiet, recordings=(*quiet.recordings[:3], exchanged[3], *quiet.recordings[4:])), table)
    assert codes(one.found) == {("channels_swapped", "r004", "force_n")}
    assert len(one.campaign.recordings) == len(quiet.recordings) - 1
    assert one.lacking == ""


def test_an_overload_of_the_charge_is_told_of_the_charge(quiet: Campaign, table: SigmaTable) -> None:
    clipped = forces(quiet, charge_pc=lambda entry: np.clip(entry.charge_pc, -0.1, 0.1))
    found = inspect(clipped, table)
    assert {entry.code for entry in found.found} == {"series_not_usable"}
    assert {entry.field for entry in found.found} == {"charge_pc"}
    assert "overload" in found.found[0].statement
    assert found.lacking


def test_recordings_of_different_drives_rates_and_lengths_go_together(table: SigmaTable) -> None:
    """And FRFs with time series."""
    effects = {"amplifier_high_pass": {"corner_hz": 1.0}}
    drives = [
        {"kind": "sweep", "sample_rate_hz": 1024.0, "duration_s": 8.0},
        {"kind": "random", "sample_rate_hz": 512.0, "duration_s": 16.0},
        {"kind": "stepped_sine", "sample_rate_hz": 2048.0, "duration_s": 6.0, "steps": 12},
    ]
    campaigns = [recorded(effects=effects, drive=drive) for drive in drives]
    campaigns.append(inspect(campaigns[0], table).campaign)
    mixed = tuple(campaigns[number % 4].recordings[number] for number in range(8))
    report = diagnosis_report(replace(campaigns[0], recordings=mixed), table)
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == (
        "explained",
        ["amplifier_high_pass"],
    )
    assert report["mechanisms"][0]["parameters"][0]["value"] == pytest.approx(1.0, rel=0.02)


def test_series_that_make_no_frf_are_left_out(quiet: Campaign, table: SigmaTable) -> None:
    first, second, *others = quiet.recordings
    assert isinstance(first, FrfRecording)
    assert isinstance(second, FrfRecording)
    assert first.force_n is not None
    assert first.charge_pc is not None
    short = replace(first, force_n=first.force_n[:5], charge_pc=first.charge_pc[:5])
    silent = replace(second, charge_pc=0.02 * np.random.default_rng(3).normal(size=len(first.force_n)))
    found = inspect(replace(quiet, recordings=(short, silent, *others)), table)
    assert codes(found.found) == {("series_not_usable", "r001", "force_n"), ("no_response", "r002", "charge_pc")}
    assert len(found.campaign.recordings) == len(others)

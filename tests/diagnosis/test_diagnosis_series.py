"""Recordings given as time series: slips in what they hold, which of their lines say something, what is found."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnosis.series_campaigns import codes, forces, recorded
from tests.support.cases import first
from tests.support.lean_reports import lean_report
from tests.support.slip_campaigns import looked_at
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

LEVEL_PC_PER_N = 7.0  # of a recording, about
BESIDE_SERIES = ("contact_creep", "compressible_layer", "layered_contact", "adhesion", "contact_resonance", "crosstalk")
Made = Callable[[float, np.random.Generator], tuple[Any, Any]]


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


FIELDS = ("sample_rate_hz", "charge_pc", "preload_n", "force_n", "dynamic_force_n")


@pytest.mark.parametrize("field", first(3, FIELDS))
def test_a_slip_of_one_recording_and_of_all_is_named(field: str, quiet: Campaign, table: SigmaTable) -> None:
    """One is left out. A charge of all in other units only scales d33; of other fields nothing is concluded."""
    factor = 1e-3 if field == "preload_n" else 1e3
    one = looked_at(times(quiet, field, factor, "r003"), table)
    assert codes(one) == {("units_off_by_1000", "r003", field)}
    assert one["verdict"] == "no_mismatch"
    every = looked_at(times(quiet, field, factor), table)
    assert codes(every) - {("implausible_d33", "", "d33_pc_per_n")} >= {("units_off_by_1000", "", field)}
    assert (every["verdict"] == "insufficient_data") == (field != "charge_pc")


def test_a_force_without_its_mean_is_told_by_its_oscillation(quiet: Campaign, table: SigmaTable) -> None:
    """A piezoelectric force cell shows no preload."""
    coupled = forces(quiet, force_n=lambda entry: entry.force_n - entry.force_n.mean())
    assert codes(looked_at(coupled, table)) == set()
    report = looked_at(times(coupled, "force_n", 1e3), table)
    assert codes(report) == {("units_off_by_1000", "", "force_n")}
    assert report["verdict"] == "insufficient_data"


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
        charge_pc=lambda _: LEVEL_PC_PER_N * blow + 1e-4 * random.normal(size=len(time)),
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
            LEVEL_PC_PER_N * (shaken[entry.id] - entry.preload_n * fall) + 1e-4 * random.normal(size=len(time))
        ),
    )


@pytest.mark.parametrize("excited", [struck, relaxing])
def test_neither_a_blow_nor_drift_of_the_force_is_a_slip(
    excited: Callable[[Campaign], Campaign], quiet: Campaign, table: SigmaTable
) -> None:
    right = excited(quiet)
    assert "units_off_by_1000" not in {code for code, _, _ in codes(looked_at(right, table))}
    report = looked_at(times(right, "force_n", 1e-3), table)
    assert codes(report) == {("units_off_by_1000", "", "force_n")}
    assert report["verdict"] == "insufficient_data"


def test_a_force_said_to_be_right_is_used_all_the_same(quiet: Campaign, table: SigmaTable) -> None:
    slipped = times(quiet, "dynamic_force_n", 1e-3)
    assert looked_at(slipped, table)["verdict"] == "insufficient_data"
    meant = looked_at(replace(slipped, units_checked=True), table)
    assert ("units_off_by_1000", "", "dynamic_force_n") in codes(meant)
    assert meant["verdict"] == "no_mismatch"


def test_exchanged_channels_are_told(quiet: Campaign, table: SigmaTable) -> None:
    """The charge has the preload for its mean and the dynamic force for its size, and the force has neither."""
    exchanged = forces(quiet, force_n=lambda entry: entry.charge_pc, charge_pc=lambda entry: entry.force_n)
    report = looked_at(exchanged, table)
    assert codes(report) == {("channels_swapped", "", "force_n")}
    assert report["verdict"] == "insufficient_data"
    fourth = exchanged.recordings[3]
    one = looked_at(replace(quiet, recordings=(*quiet.recordings[:3], fourth, *quiet.recordings[4:])), table)
    assert codes(one) == {("channels_swapped", "r004", "force_n")}
    assert one["verdict"] == "no_mismatch"


def test_series_that_make_no_frf_are_left_out(quiet: Campaign, table: SigmaTable) -> None:
    """A short one and a silent one; and all, where the charge is at its overload."""
    first, second, *others = frf_recordings(quiet)
    assert first.force_n is not None
    assert first.charge_pc is not None
    short = replace(first, force_n=first.force_n[:5], charge_pc=first.charge_pc[:5])
    silent = replace(second, charge_pc=0.02 * np.random.default_rng(3).normal(size=len(first.force_n)))
    report = looked_at(replace(quiet, recordings=(short, silent, *others)), table)
    assert codes(report) == {("series_not_usable", "r001", "force_n"), ("no_response", "r002", "charge_pc")}
    assert report["verdict"] == "no_mismatch"
    clipped = looked_at(forces(quiet, charge_pc=lambda entry: np.clip(entry.charge_pc, -0.1, 0.1)), table)
    assert {(code, field) for code, _, field in codes(clipped)} == {("series_not_usable", "charge_pc")}
    assert "overload" in clipped["findings"][0]["statement"]
    assert clipped["verdict"] == "insufficient_data"


def test_lines_without_force_are_no_misfit(table: SigmaTable) -> None:
    """Beside the excited band a line's noise is unlike the others'; mains were found there."""
    campaign = recorded(drive={"kind": "sweep", "sample_rate_hz": 2048.0, "duration_s": 8.0})
    report = lean_report(campaign, table, *BESIDE_SERIES)
    assert report["verdict"] == "no_mismatch"
    assert {entry["code"] for entry in report["findings"]} <= {"constant_axis", "damaged_samples", "lines_left_out"}
    (said,) = [entry["statement"] for entry in report["findings"] if entry["code"] == "lines_left_out"]
    assert "the force has little power" in said


DRIVES: list[dict[str, Any]] = [
    {"kind": "sweep", "duration_s": 8.0},  # in step: the charge follows the force there all the same
    {"duration_s": 8.0},
    {"sample_rate_hz": 2048.0, "duration_s": 16.0},
]


@pytest.mark.parametrize("drive", first(1, DRIVES))
def test_mains_are_told_and_their_lines_left_out(drive: dict[str, Any], table: SigmaTable) -> None:
    pickup = {"mains_pickup": {"charge_pc": 0.05, "mains_hz": 50.0}}
    report = lean_report(recorded(effects=pickup, drive=drive), table, *BESIDE_SERIES)
    assert report["verdict"] == "no_mismatch"
    (said,) = [entry for entry in report["findings"] if entry["code"] == "mains_in_charge"]
    assert "50 Hz" in report["statement"]
    assert said["field"] == "charge_pc"
    assert "8 of 8 recordings" in said["statement"]
    measured = re.search("about ([0-9.]+) pC", said["statement"])
    assert measured is not None
    assert float(measured[1]) == pytest.approx(0.05, rel=0.15)


def test_mains_beside_the_excited_band_are_said(table: SigmaTable) -> None:
    drive = {"kind": "random", "low_hz": 70.0, "high_hz": 140.0, "duration_s": 8.0}
    campaign = recorded(effects={"mains_pickup": {"charge_pc": 0.1, "mains_hz": 60.0}}, drive=drive)
    assert ("mains_in_charge", "", "charge_pc") in codes(looked_at(campaign, table))
    assert "mains_in_charge" not in {code for code, _, _ in codes(looked_at(recorded(drive=drive), table))}


def shaken(quiet: Campaign, rate: float, made: Made) -> Campaign:
    """The campaign with each recording's force about its preload and charge as `made` of its level [pC/N] and of a
    generator of random numbers."""
    entries = []
    for number, entry in enumerate(frf_recordings(quiet)):
        assert entry.force_n is not None
        assert entry.charge_pc is not None
        away = entry.force_n - entry.force_n.mean()
        force, charge = made(float(away @ entry.charge_pc / (away @ away)), np.random.default_rng(number))
        entries.append(
            replace(
                entry, sample_rate_hz=rate, dynamic_force_n=float(np.abs(force).max()), charge_pc=charge,
                force_n=entry.preload_n + force,
            )
        )  # fmt: skip
    return replace(quiet, recordings=tuple(entries))


def sixteen_times(spectrum: Any) -> Floats:
    """A periodic signal of these amplitudes at the multiples of 1/T."""
    return np.tile(np.fft.irfft(np.append(0, spectrum)) * len(spectrum), 16)


def test_a_resonance_on_a_multiple_of_the_mains_is_none(quiet: Campaign, table: SigmaTable) -> None:
    """Its top is off the course of the lines around it, as mains are."""
    line = 4.0 * np.arange(1, 257)
    response = 1.0 / (1 - (line / 300.0) ** 2 + 0.06j * line / 300.0)

    def resonant(level: float, random: np.random.Generator) -> Any:
        force = 0.002 * np.exp(2j * np.pi * random.random(256)) * (line < 800)
        charge = sixteen_times(level * response * force)
        return sixteen_times(force), charge + 1e-3 * random.normal(size=len(charge))

    report = looked_at(shaken(quiet, 2048.0, resonant), table, "contact_resonance", "mains_pickup")
    assert "mains_in_charge" not in {code for code, _, _ in codes(report)}


def require_high_pass(campaign: Campaign, table: SigmaTable, within: float) -> dict[str, Any]:
    """The report, which names a high pass of 1 Hz and one pole."""
    report = lean_report(campaign, table, *BESIDE_SERIES)
    assert report["verdict"] == "explained"
    (mechanism,) = report["mechanisms"]
    corner, order = mechanism["parameters"]
    assert mechanism["name"] == "amplifier_high_pass"
    assert corner["value"] == pytest.approx(1.0, rel=within)
    assert order["low"] < 1.1
    return report


HIGH_PASS = {"amplifier_high_pass": {"corner_hz": 1.0}}


def test_recordings_of_different_drives_rates_and_lengths_go_together(table: SigmaTable) -> None:
    """And FRFs with time series."""
    drives = [
        {"kind": "sweep", "sample_rate_hz": 1024.0, "duration_s": 8.0},
        {"kind": "random", "sample_rate_hz": 512.0, "duration_s": 16.0},
        {"kind": "stepped_sine", "sample_rate_hz": 2048.0, "duration_s": 6.0, "steps": 12},
    ]
    campaigns = [recorded(effects=HIGH_PASS, drive=drive) for drive in drives]
    estimated = [(entry, lines_of(entry)) for entry in frf_recordings(campaigns[0])]
    frfs = [FrfRecording.of_lines(entry, frf.frequency, frf.values, frf.coherence) for entry, frf in estimated]
    of_each = [*(frf_recordings(one) for one in campaigns), frfs]
    mixed = tuple(of_each[number % 4][number] for number in range(8))
    require_high_pass(replace(campaigns[0], recordings=mixed), table, 0.02)


def test_of_a_single_sweep_a_high_pass_is_still_found(quiet: Campaign, table: SigmaTable) -> None:
    """It has each line in one block alone, whose ends cut it: the lowest lines would say more than a high-pass."""
    time = np.arange(16 * 1024) / 1024.0
    force = 0.09 * np.sin(2 * np.pi * (1.0 + 0.5 * 129.0 / 16.0 * time) * time)
    decay = np.exp(-2 * np.pi / 1024.0)
    answer = lfilter(np.array([1.0, -1.0]) * (1 + decay) / 2, [1.0, -decay], force)

    def made(level: float, random: np.random.Generator) -> Any:
        return force, level * answer + 0.02 * random.normal(size=len(force))

    report = require_high_pass(shaken(quiet, 1024.0, made), table, 0.03)
    assert "force_acts_once" in {entry["code"] for entry in report["findings"]}

"""Recordings given as time series: which of their lines say something, and what a diagnosis makes of them."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnosis.series_campaigns import codes, recorded
from tests.support.cases import first
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.sentences import clause
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.screening.select_lines import choose_lines
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.frf.estimation import Frf, lines_of
from underskin.surrogate.sigma_table import SigmaTable


@pytest.fixture(scope="module")
def quiet() -> Campaign:
    return recorded()


@pytest.mark.slow
@pytest.mark.parametrize("sample_rate_hz", [512.0, 2048.0])
def test_lines_without_force_are_no_misfit(sample_rate_hz: float, table: SigmaTable) -> None:
    """Beside the excited band a line's noise is unlike the others'; mains were found there."""
    campaign = recorded(drive={"kind": "sweep", "sample_rate_hz": sample_rate_hz, "duration_s": 8.0})
    report = diagnosis_report(campaign, table)
    assert report["verdict"] == "no_mismatch"
    assert {entry["code"] for entry in report["findings"]} <= {"constant_axis", "damaged_samples", "lines_left_out"}
    (said,) = [entry["statement"] for entry in report["findings"] if entry["code"] == "lines_left_out"]
    assert "the force has little power" in said


@pytest.mark.slow
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
    assert clause(said["statement"])[1:] in report["statement"]
    assert said["field"] == "charge_pc"
    assert "8 of 8 recordings" in said["statement"]
    assert "50 Hz" in said["statement"]
    measured = re.search("about ([0-9.]+) pC", said["statement"])
    assert measured is not None
    charge = float(measured[1])
    assert charge == pytest.approx(0.05, rel=0.15)


@pytest.mark.parametrize("kind", ["random", "sweep"])
def test_mains_beside_the_excited_band_are_said(kind: str, table: SigmaTable) -> None:
    drive = {"kind": kind, "low_hz": 70.0, "high_hz": 140.0, "duration_s": 8.0}
    campaign = recorded(effects={"mains_pickup": {"charge_pc": 0.1, "mains_hz": 60.0}}, drive=drive)
    assert ("mains_in_charge", "", "charge_pc") in codes(inspect(campaign, table).findings)
    assert "mains_in_charge" not in {entry.code for entry in inspect(recorded(drive=drive), table).findings}


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
    assert "mains_in_charge" not in {entry.code for entry in found.findings}
    assert all(300.0 in lines_of(entry).frequency for entry in frf_recordings(found.campaign))


@pytest.mark.slow
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


@pytest.mark.slow
def test_blows_too_weak_for_their_highest_lines_hide_nothing(quiet: Campaign, table: SigmaTable) -> None:
    """Of lines chosen by how certain each came out the larger would be kept."""
    time = np.arange(8 * 4096) / 4096.0

    def made(level: float, random: np.random.Generator) -> Any:
        starts = np.arange(8) + 0.1 + 0.2 * random.random(8)
        since = time - starts[np.clip(np.searchsorted(starts, time) - 1, 0, 7)]
        blows = np.where((since >= 0) & (since < 0.002), 0.09 * np.sin(np.pi * since / 0.002), 0.0)
        return blows + 1e-5 * random.normal(size=len(time)), level * blows + 0.04 * random.normal(size=len(time))

    assert diagnosis_report(shaken(quiet, table, 4096.0, made), table)["verdict"] == "no_mismatch"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "sample_rate_hz"),
    first(2, [("random", 512.0), ("sweep", 2048.0), ("random", 2048.0), ("sweep", 512.0)]),
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_of_a_single_sweep_a_high_pass_is_still_found(quiet: Campaign, table: SigmaTable) -> None:
    """It has each line in one block alone, whose ends cut it: the lowest lines would say more than a high-pass."""
    time = np.arange(16 * 1024) / 1024.0
    force = 0.09 * np.sin(2 * np.pi * (1.0 + 0.5 * 129.0 / 16.0 * time) * time)
    decay = np.exp(-2 * np.pi / 1024.0)
    answer = lfilter(np.array([1.0, -1.0]) * (1 + decay) / 2, [1.0, -decay], force)

    def made(level: float, random: np.random.Generator) -> Any:
        return force, level * answer + 0.02 * random.normal(size=len(force))

    report = diagnosis_report(shaken(quiet, table, 1024.0, made), table)
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == (
        "explained",
        ["amplifier_high_pass"],
    )
    assert report["mechanisms"][0]["parameters"][0]["value"] == pytest.approx(1.0, rel=0.03)
    assert "force_acts_once" in {entry["code"] for entry in report["findings"]}


def test_mains_that_spoil_every_line_are_said() -> None:
    """Lines 10 Hz apart: three to each side of every multiple are all that the force has."""
    frequency = 10.0 * np.arange(1.0, 28.0)
    force = np.where(frequency > 10, 1.0, 1e-6)
    at_mains = frequency == 50
    charge = np.where(at_mains, 2.0, 1.0) * force
    coherence = np.where(at_mains, 0.5, np.where(frequency > 10, 0.9999, 0.1))
    averages = np.full(len(frequency), 14.0)
    measured = Frf(frequency, np.ones(27, complex), coherence, averages, (), force, charge, independent=False)
    choice = choose_lines(measured)
    assert choice.lines == []
    assert choice.mains is not None
    assert choice.mains.mains_hz == 50

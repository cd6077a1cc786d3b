"""Recordings given as time series: slips of units in what they hold, and those that cannot be used."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.series_campaigns import codes, forces, recorded
from underskin.diagnosis.screening.inspection import inspect
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable


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


FIELDS = ("sample_rate_hz", "force_n", "charge_pc", "preload_n", "dynamic_force_n")


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("field", FIELDS)
def test_a_slip_of_one_recording_is_named_and_left_out(
    field: str, factor: float, quiet: Campaign, table: SigmaTable
) -> None:
    found = inspect(times(quiet, field, factor, "r003"), table)
    assert codes(found.findings) == {("units_off_by_1000", "r003", field)}
    assert [entry.id for entry in found.campaign.recordings] == [
        entry.id for entry in quiet.recordings if entry.id != "r003"
    ]
    assert found.lacking is None


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("field", FIELDS)
def test_a_slip_of_all_is_named(field: str, factor: float, quiet: Campaign, table: SigmaTable) -> None:
    """A charge in other units only scales d33; on other fields nothing is concluded."""
    found = inspect(times(quiet, field, factor), table)
    assert codes(found.findings) == {("units_off_by_1000", "", field)}
    assert (found.lacking is None) == (field == "charge_pc")


def test_a_force_without_its_mean_is_told_by_its_oscillation(quiet: Campaign, table: SigmaTable) -> None:
    """A piezoelectric force cell shows no preload."""
    entries = []
    for entry in quiet.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.force_n is not None
        entries.append(replace(entry, force_n=entry.force_n - entry.force_n.mean()))
    coupled = replace(quiet, recordings=tuple(entries))
    assert codes(inspect(coupled, table).findings) == set()
    found = inspect(times(coupled, "force_n", 1e3), table)
    assert codes(found.findings) == {("units_off_by_1000", "", "force_n")}
    assert found.lacking


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
    assert "units_off_by_1000" not in {entry.code for entry in inspect(right, table).findings}
    found = inspect(times(right, "force_n", 1e-3), table)
    assert codes(found.findings) == {("units_off_by_1000", "", "force_n")}
    assert found.lacking


def test_a_force_said_to_be_right_is_used_all_the_same(quiet: Campaign, table: SigmaTable) -> None:
    slipped = times(quiet, "dynamic_force_n", 1e-3)
    assert not inspect(slipped, table).campaign.recordings
    found = inspect(replace(slipped, units_checked=True), table)
    assert ("units_off_by_1000", "", "dynamic_force_n") in codes(found.findings)
    assert len(found.campaign.recordings) == len(quiet.recordings)
    assert found.lacking is None


def test_slips_of_different_fields_are_each_told(quiet: Campaign, table: SigmaTable) -> None:
    slipped = times(times(quiet, "force_n", 1e3, "r001", "r002"), "preload_n", 1e-3, "r003", "r004")
    found = inspect(slipped, table)
    assert codes(found.findings) == {
        ("units_off_by_1000", name, field)
        for name, field in (("r001", "force_n"), ("r002", "force_n"), ("r003", "preload_n"), ("r004", "preload_n"))
    }
    assert found.lacking


def test_exchanged_channels_are_told(quiet: Campaign, table: SigmaTable) -> None:
    """The charge has the preload for its mean and the dynamic force for its size, and the force has neither."""
    exchanged = forces(quiet, force_n=lambda entry: entry.charge_pc, charge_pc=lambda entry: entry.force_n)
    fourth = exchanged.recordings[3]
    found = inspect(exchanged, table)
    assert codes(found.findings) == {("channels_swapped", "", "force_n")}
    assert found.lacking
    one = inspect(replace(quiet, recordings=(*quiet.recordings[:3], fourth, *quiet.recordings[4:])), table)
    assert codes(one.findings) == {("channels_swapped", "r004", "force_n")}
    assert len(one.campaign.recordings) == len(quiet.recordings) - 1
    assert one.lacking is None


def test_an_overload_of_the_charge_is_told_of_the_charge(quiet: Campaign, table: SigmaTable) -> None:
    clipped = forces(quiet, charge_pc=lambda entry: np.clip(entry.charge_pc, -0.1, 0.1))
    found = inspect(clipped, table)
    assert {entry.code for entry in found.findings} == {"series_not_usable"}
    assert {entry.field for entry in found.findings} == {"charge_pc"}
    assert "overload" in found.findings[0].statement
    assert found.lacking


def test_series_that_make_no_frf_are_left_out(quiet: Campaign, table: SigmaTable) -> None:
    first, second, *others = quiet.recordings
    assert isinstance(first, FrfRecording)
    assert isinstance(second, FrfRecording)
    assert first.force_n is not None
    assert first.charge_pc is not None
    short = replace(first, force_n=first.force_n[:5], charge_pc=first.charge_pc[:5])
    silent = replace(second, charge_pc=0.02 * np.random.default_rng(3).normal(size=len(first.force_n)))
    found = inspect(replace(quiet, recordings=(short, silent, *others)), table)
    assert codes(found.findings) == {("series_not_usable", "r001", "force_n"), ("no_response", "r002", "charge_pc")}
    assert len(found.campaign.recordings) == len(others)

"""The rig's recordings: the two routes agree, the library reads the files, d33 comes back, same seed same numbers."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom
from typer.testing import CliRunner

import underskin
from rig.commands import rig as command
from rig.description import parse
from rig.output import carry_out
from rig.recorded import line_noise, record_lines
from rig.time_domain import record_series
from tests.rig.rig_d33 import covered
from tests.support.repository import ROOT
from tests.support.rig_experiments import PARAMETERS, described
from underskin.recordings import campaign as campaigns
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import broadband, estimate
from underskin.recordings.frf.spectra import Frf

EXAMPLES = ROOT / "examples" / "rig"
SOAK = "UNDERSKIN_SOAK" in os.environ
RATE = 2048.0
DRIVE: dict[str, Any] = {
    "kind": "random", "low_hz": 2.0, "high_hz": 600.0, "sample_rate_hz": RATE, "duration_s": 10.0,
    "charge_noise_pc": 0.005, "flicker_corner_hz": 5.0,
}  # fmt: skip


def series_of(drive: dict[str, Any], on: dict[str, Any], dynamic_n: float = 0.2) -> tuple[Any, list[Any]]:
    """Two recordings of one sensor, without scatter."""
    design = {
        "indenters_mm": [4.0], "preloads_n": [1.0, 3.0], "sensors": ["s01"], "offsets_mm": [[0.5, 0.0]],
        "dynamic_forces_n": [dynamic_n],
    }  # fmt: skip
    description = described(lines=None, drive={**DRIVE, **drive}, effects=on, noise={"gain": 0.0}, design=design)
    return record_series(parse(description))


IN_TIME = [
    {},
    *(
        {name: PARAMETERS[name]}
        for name in ("contact_resonance", "amplifier_high_pass", "sensor_relaxation", "timing_delay", "crosstalk",
                     "preload_dependent_d33", "rattle", "cable_motion")
    ),
    {"contact_resonance": {"tip_mass_g": 3.0, "damping": 0.1}, "amplifier_high_pass": {"corner_hz": 0.5}},
]  # fmt: skip


@pytest.mark.parametrize("on", IN_TIME, ids=lambda on: "+".join(on) or "base")
def test_time_series_have_the_frf_of_the_other_route(on: dict[str, Any]) -> None:
    response, series = series_of({}, on)
    for row, recorded in enumerate(series):
        frf = broadband(recorded.force_n, recorded.charge_pc, RATE)
        assert_agrees(frf, response.lines(frf.frequency)[row], (10.0, 550.0))


def assert_agrees(frf: Frf, expected: np.ndarray, band: tuple[float, float]) -> None:
    """The estimate's error is as large as it says, and not larger: about 2500 lines, each with two parts."""
    inside = (frf.frequency > band[0]) & (frf.frequency < band[1])
    assert frf.relative_uncertainty is not None
    off = (frf.values / expected - 1)[inside] / frf.relative_uncertainty[inside]
    assert np.sqrt(np.mean(np.abs(off) ** 2) / 2) < 1.25  # over 8 averages the coherence itself errs
    assert np.abs(off.mean()) < 0.3


def test_a_sweep_has_the_frf_of_the_other_route() -> None:
    response, series = series_of({"kind": "sweep", "duration_s": 16.0}, {"amplifier_high_pass": {"corner_hz": 1.0}})
    frf = broadband(series[0].force_n, series[0].charge_pc, RATE, block_samples=2048)  # two sweeps a block
    inside = (frf.frequency > 20) & (frf.frequency < 550)
    assert np.abs(frf.values / response.lines(frf.frequency)[0] - 1)[inside].max() < 0.01


def test_where_a_sweep_begins_anew_nothing_folds_back() -> None:
    """The force jumps there: without the converter's filter the lowest lines are off by a percent."""
    drive = {"kind": "sweep", "duration_s": 8.0, "sample_rate_hz": 512.0, "low_hz": 1.0, "high_hz": 130.0}
    response, series = series_of(drive | {"charge_noise_pc": 0.0}, {"amplifier_high_pass": {"corner_hz": 1.0}})
    frf = estimate(series[0].force_n, series[0].charge_pc, 512.0)
    inside = frf.frequency < 130
    assert np.abs(frf.values / response.lines(frf.frequency)[0] - 1)[inside].max() < 2e-3


def test_stepped_sine_has_the_frf_of_the_other_route() -> None:
    on = {"contact_resonance": {"tip_mass_g": 3.0, "damping": 0.1}, "timing_delay": {"delay_us": 100.0}}
    response, series = series_of({"kind": "stepped_sine", "steps": 12}, on)
    frf = estimate(series[0].force_n, series[0].charge_pc, RATE)
    assert len(frf.frequency) == 12
    assert np.abs(frf.values / response.lines(frf.frequency)[0] - 1).max() < 3e-4


def test_a_large_amplitude_shows_in_time_as_its_first_harmonic() -> None:
    """The edge moves with the cycle: Fσ(F) at each instant has the first harmonic of the other route."""
    on = {"amplitude_nonlinearity": {"mobility": 1.0}}
    drive = {"kind": "stepped_sine", "steps": 6, "charge_noise_pc": 0.0002}
    response, series = series_of(drive, on, dynamic_n=0.8)
    frf = estimate(series[0].force_n, series[0].charge_pc, RATE)
    assert frf.values == pytest.approx(response.lines(frf.frequency)[0], rel=1e-3)
    still, _ = series_of(drive, {}, dynamic_n=0.8)
    assert np.abs(frf.values[0] / still.lines(frf.frequency)[0, 0] - 1) > 0.005


def test_mains_shows_at_its_frequency_and_nowhere_else() -> None:
    _, series = series_of({"duration_s": 16.0}, {"mains_pickup": {"charge_pc": 0.5, "mains_hz": 50.0}})
    frf = broadband(series[0].force_n, series[0].charge_pc, RATE, block_samples=2048)
    assert frf.coherence is not None
    low = frf.frequency[(frf.coherence < 0.9) & (frf.frequency < 590)]
    assert 50.0 in low
    assert np.isin(low[low > 10], [49.0, 50.0, 51.0, 149.0, 150.0, 151.0]).all()


def test_converter_rounds_and_stops_at_its_range() -> None:
    _, series = series_of({"converter_bits": 12, "charge_range_pc": 0.5}, {})
    step = 2 * 0.5 / 2**12
    assert series[0].charge_pc == pytest.approx(np.round(series[0].charge_pc / step) * step)
    assert series[0].charge_pc.max() == 0.5 - step
    assert series[0].charge_pc.min() == -0.5


def test_line_noise_and_coherence_are_as_described() -> None:
    design = {"preloads_n": [1.0], "indenters_mm": [4.0], "repeats": 50}
    noise = {"gain": 0.03, "line": 0.02, "floor_pc_per_n": 0.05, "averages": 8.0}
    planned = parse(described(design=design, noise=noise, effects={}))
    recorded = record_lines(planned)
    size = np.abs(recorded.exact)
    gain = np.median(recorded.measured.real / recorded.exact.real, axis=1)
    assert np.log(gain).std() == pytest.approx(0.03, rel=0.15)
    rest = recorded.measured - gain[:, None] * recorded.exact
    expected = np.hypot(line_noise(planned.noise, recorded.frequency_hz) * size, 0.05)
    for part in (rest.real, rest.imag):
        assert np.std(part / expected) == pytest.approx(1, abs=0.04)
    assert recorded.coherence is not None
    stated = (1 - recorded.coherence) / (2 * 8 * recorded.coherence)
    assert np.sqrt(stated) * size == pytest.approx(expected, rel=0.15)


@pytest.mark.slow
def test_d33_comes_back_within_the_stated_uncertainty() -> None:
    runs = 200 if SOAK else 8
    table = underskin.load_table()
    inside, off = np.array([covered(number, table) for number in range(runs)]).T
    assert inside.sum() >= (0.95 * runs if SOAK else binom.ppf(0.001, runs, 0.95))
    assert abs(off.mean()) < 4 / np.sqrt(runs)  # no bias


@pytest.mark.slow
def test_raw_recordings_are_read_with_the_description_written_beside_them(tmp_path: Path) -> None:
    description = described(
        lines=None, drive={**DRIVE, "duration_s": 1.0}, design={"offsets_mm": [[0.0, 0.0]], "preloads_n": [1.0]}
    )
    carry_out(parse(description), tmp_path, tdms=True)
    described_rig = rig_description.parse((tmp_path / "rig.yaml").read_bytes(), "rig.yaml")
    reading = read_file(tmp_path / "recordings.tdms", "recordings.tdms", described_rig)
    assert (reading.problems, reading.warnings) == ([], [])
    written = campaigns.parse(json.loads((tmp_path / "campaign.json").read_text()))
    assert len(reading.campaign.recordings) == len(written.recordings) == 8
    for read, kept in zip(reading.campaign.recordings, written.recordings, strict=True):
        assert isinstance(read, FrfRecording)
        assert isinstance(kept, FrfRecording)
        for name in ("id", "sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "dwell_s", "load_cycles",
                     "recorded_at", "sample_rate_hz"):  # fmt: skip
            assert getattr(read, name) == getattr(kept, name)
        assert read.force_n == pytest.approx(kept.force_n, abs=1e-12)
        assert read.charge_pc == pytest.approx(kept.charge_pc, abs=1e-9)


def test_same_seed_same_files_other_seed_other_noise(tmp_path: Path) -> None:
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        carry_out(parse(described(seed=seed)), tmp_path / name)
    first, again, other = ((tmp_path / name / "campaign.json").read_bytes() for name in "abc")
    assert first == again
    assert first != other


def test_campaign_tells_nothing_of_the_truth(tmp_path: Path) -> None:
    on = {name: PARAMETERS[name] for name in ("misalignment", "sensor_spread", "modulus_error")}
    carry_out(parse(described(effects=on)), tmp_path)
    document, truth = (json.loads((tmp_path / name).read_text()) for name in ("campaign.json", "truth.json"))
    assert set(document) == {"schema", "name", "skin", "recordings"}
    assert document["skin"]["d33_pc_per_n"] is None
    assert document["skin"]["youngs_modulus_mpa"] == 16.0
    assert truth["youngs_modulus_mpa"] == pytest.approx(20.8)
    assert set(truth["effects"]) == set(on)
    assert truth["identifiable"] is True
    assert len(truth["sensor_gains"]) == 4
    campaigns.parse(document)


def test_visibility_is_noise_without_an_effect_and_grows_with_one(tmp_path: Path) -> None:
    gains = []
    for number, rate in enumerate((0.0, 0.05, 0.3)):
        carry_out(parse(described(effects={"ageing": {"rate": rate, "cycles": 200.0}})), tmp_path / str(number))
        gains.append(json.loads((tmp_path / str(number) / "truth.json").read_text())["chi2_gain_of_truth"])
    assert abs(gains[0]) < 1e-6
    assert gains[0] < gains[1] < gains[2]
    assert gains[2] > 20


@pytest.mark.slow
@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_examples_run(example: Path, tmp_path: Path) -> None:
    raw = ["--tdms"] if example.stem == "time_series" else []
    answer = CliRunner().invoke(command, ["run", str(example), "--output-dir", str(tmp_path), *raw])
    assert answer.exit_code == 0, answer.output
    campaigns.parse(json.loads((tmp_path / "campaign.json").read_text()))
    assert (tmp_path / "truth.json").exists()
    assert (tmp_path / "recordings.tdms").exists() == bool(raw)


@pytest.mark.slow
def test_draws_are_campaigns_with_their_truth_beside_them(tmp_path: Path) -> None:
    arguments = ["draw", "--output-dir", str(tmp_path), "--count", "3", "--seed", "4", "--what", "pair"]
    assert CliRunner().invoke(command, arguments).exit_code == 0
    truths = json.loads((tmp_path / "truth.json").read_text())
    files = sorted((tmp_path / "campaigns").glob("*.json"))
    assert [file.stem for file in files] == list(truths) == [f"{number:04d}" for number in range(3)]
    for file in files:
        campaigns.parse(json.loads(file.read_text()))
        assert len(truths[file.stem]["effects"]) == 2

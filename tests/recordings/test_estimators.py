"""H1, H2 and Hv on a known system: biases as predicted; a lab says which in every format, and whoever reads a file."""

import functools
import io
from typing import Any

import numpy as np
import pytest

from bench.soak import SOAK
from tests.recordings.known_signals import GAIN, RATE, answer_to, dwelling, known_frf
from tests.support.campaign_documents import document
from tests.support.instrument_files import rig
from underskin.errors import InvalidInput
from underskin.recordings import read_file
from underskin.recordings.campaign import FrfRecording, from_dict, to_dict
from underskin.recordings.frf.estimation import broadband, lines_of, stepped_sine
from underskin.recordings.frf.estimators import ESTIMATORS, Estimator
from underskin.recordings.readers import hdf5_file
from underskin.units import Floats

pytestmark = pytest.mark.slow

NOISE = 0.3  # of each channel's own standard deviation
SAMPLES = 200_000


@functools.cache
def noisy(in_force: float, in_charge: float, seed: int = 900_001) -> tuple[Floats, Floats]:
    """White force on the known system, with noise of these shares of each signal's standard deviation."""
    random = np.random.default_rng(seed)
    force = random.standard_normal(SAMPLES)
    charge = answer_to(force)
    disturbed = [
        signal + share * np.std(signal) * random.standard_normal(SAMPLES)
        for signal, share in ((force, in_force), (charge, in_charge))
    ]
    return disturbed[0], disturbed[1]


def factor(in_force: float, in_charge: float, estimator: Estimator) -> Floats:
    """What the estimate of each line below 100 Hz, where the system's answer is strong, is of the truth."""
    frf = broadband(*noisy(in_force, in_charge), RATE, block_samples=1000, estimator=estimator)
    low = frf.frequency < 100
    return np.abs(frf.values[low] / known_frf(frf.frequency[low]))


def test_noise_in_the_charge_makes_h2_too_large_and_h1_not() -> None:
    assert np.mean(factor(0, NOISE, "H1")) == pytest.approx(1, abs=0.005)
    frequency = (RATE * np.fft.rfftfreq(1000)[1:]).astype(np.float64)
    power = np.abs(known_frf(frequency)) ** 2
    share = NOISE**2 * power.mean() / power[frequency < 100]  # white noise beside a charge that is strong here
    assert np.mean(factor(0, NOISE, "H2")) == pytest.approx(np.mean(1 + share), abs=0.005)


def test_with_noise_of_equal_relative_power_hv_alone_is_right() -> None:
    """A system without dynamics: every line has the ratio of noise to signal that Hv assumes."""
    random = np.random.default_rng(900_002)
    force = random.standard_normal(SAMPLES)
    noise = [NOISE * np.std(force) * random.standard_normal(SAMPLES) for _ in range(2)]
    found = {}
    for name in ESTIMATORS:
        frf = broadband(force + noise[0], GAIN * (force + noise[1]), RATE, block_samples=1000, estimator=name)
        found[name] = np.abs(frf.values.mean()) / GAIN
    assert found["H1"] == pytest.approx(1 / (1 + NOISE**2), abs=0.005)
    assert found["H2"] == pytest.approx(1 + NOISE**2, abs=0.005)
    assert found["Hv"] == pytest.approx(1, abs=0.003)


def test_hv_of_a_stepped_sine_takes_its_noise_ratio_from_all_tones() -> None:
    """White noise in both channels with the ratio of the signals' powers over both tones. At 125 Hz the charge has a
    quarter of its magnitude at 10 Hz, so that a ratio of that tone's own powers would give the geometric mean of H1 and
    H2, which is too large there."""
    force = dwelling([10.0, 125.0], cycles=300)
    charge, true = answer_to(force), np.abs(known_frf(np.array([10.0, 125.0])))
    random, noise, repeats = np.random.default_rng(910_001), 0.007, 40 if SOAK else 10
    found: dict[str, list[Floats]] = {name: [] for name in ESTIMATORS}
    uncertainty = []
    for _ in range(repeats):
        seen_force = force + noise * random.standard_normal(len(force))
        seen_charge = charge + noise * np.sqrt(np.mean(true**2)) * random.standard_normal(len(force))
        for name in ESTIMATORS:
            frf = stepped_sine(seen_force, seen_charge, RATE, estimator=name)
            found[name].append(np.abs(frf.values) / true)
            uncertainty.append(frf.relative_uncertainty)
    h1, h2, hv = (np.array(found[name]) for name in ("H1", "H2", "Hv"))

    def in_standard_errors(excess: Floats) -> Floats:
        return np.asarray(excess.mean(axis=0) / (excess.std(axis=0, ddof=1) / np.sqrt(repeats)))

    assert np.all(np.abs(in_standard_errors(hv - 1)) < 3)
    assert in_standard_errors(np.sqrt(h1 * h2) - hv)[1] > 6
    covered = np.abs(np.log(hv)) < 1.96 * np.array(uncertainty[2::3])
    assert np.mean(covered) > 0.85


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_stated_uncertainty_is_the_scatter_of_repeats(estimator: Estimator) -> None:
    """Of lines below 300 Hz, over records with noise in both channels; by a formula of first order in (1 − γ²)/n."""
    found, stated = [], []
    for seed in range(930_001, 930_013 if SOAK else 930_009):
        force, charge = (signal[: SAMPLES // 2] for signal in noisy(NOISE, NOISE, seed))
        frf = broadband(force, charge, RATE, block_samples=1000, estimator=estimator)
        low = frf.frequency < 300
        assert frf.relative_uncertainty is not None
        found.append(np.log(np.abs(frf.values[low])))
        stated.append(frf.relative_uncertainty[low] ** 2)
    scatter = np.var(found, axis=0, ddof=1) / np.mean(stated, axis=0)
    assert np.sqrt(np.mean(scatter)) == pytest.approx(1, abs=0.08)


SERIES = {
    "sample_rate_hz": RATE,
    "force_n": noisy(NOISE, NOISE)[0][:6000].tolist(),
    "charge_pc": (1e12 * noisy(NOISE, NOISE)[1][:6000]).tolist(),
}
RECORDING: dict[str, Any] = {
    "id": "r1", "sensor": "s01", "indenter_radius_mm": 4.0, "preload_n": 1.0, "dynamic_force_n": 0.1, **SERIES,
}  # fmt: skip
LINES: dict[str, Any] = {name: RECORDING[name] for name in RECORDING if name not in SERIES} | {
    "frequency_hz": [10.0, 20.0], "frf_re_pc_per_n": [7.0, 7.0], "frf_im_pc_per_n": [0.0, 0.0],
}  # fmt: skip


def estimated(recording: FrfRecording) -> Floats:
    return np.abs(lines_of(recording).values)


def test_the_estimator_stays_with_the_recording_in_json_hdf5_and_the_template() -> None:
    campaign, _ = from_dict(document({**RECORDING, "estimator": "Hv"}))
    written = to_dict(campaign)
    assert written["recordings"][0]["estimator"] == "Hv"
    buffer = io.BytesIO()
    hdf5_file.write_document(written, written["recordings"], buffer)
    (read,) = read_file(buffer.getvalue(), "a.h5").campaign.recordings
    assert isinstance(read, FrfRecording)
    assert read.estimator == "Hv"
    head = ["schema,campaign/1", "name,a", "skin.thickness_mm,2.5", "skin.youngs_modulus_mpa,16"]
    head += ["skin.poisson_ratio,0.5", "skin.sensor_radius_mm,1.5", "sensor,s01,0,0", ""]
    rows = zip(SERIES["force_n"][:20], SERIES["charge_pc"][:20], strict=True)
    table = ["id,sensor,indenter_radius_mm,preload_n,dynamic_force_n,estimator,sample_rate_hz,force_n,charge_pc"]
    table += [f"{'r1,s01,4,1,0.1,H2,2000' if not n else ',,,,,,'},{f},{q}" for n, (f, q) in enumerate(rows)]
    (read,) = read_file("\n".join([*head, *table]).encode(), "a.csv").campaign.recordings
    assert isinstance(read, FrfRecording)
    assert read.estimator == "H2"


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ({**RECORDING, "estimator": "H3"}, "must be one of H1, H2, Hv"),
        ({**RECORDING, "estimator": 1}, "must be one of H1, H2, Hv"),
        ({**LINES, "estimator": "Hv"}, "must be absent where there is no time series"),
    ],
)
def test_what_is_no_estimator_or_has_nothing_to_estimate_is_refused(entry: dict[str, Any], says: str) -> None:
    _, (problem,) = from_dict(document(entry))
    assert (problem.field, problem.allowed) == ("estimator", says)


def of_rig(**changes: Any) -> FrfRecording:
    """A table of two channels, read by a rig description."""
    rows = [f"{1000 * f};{-0.01 * q}" for f, q in zip(SERIES["force_n"], SERIES["charge_pc"], strict=True)]
    common = {name: RECORDING[name] for name in ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n")}
    described = rig(recording={**common, "sample_rate_hz": RATE}, **changes)
    (read,) = read_file("\n".join(["force;amplifier", *rows]).encode(), "a.csv", described).campaign.recordings
    assert isinstance(read, FrfRecording)
    return read


def test_the_rig_description_says_the_estimator_of_its_recordings() -> None:
    assert of_rig().estimator is None
    h1, h2, hv = (estimated(of_rig(estimator=name)) for name in ESTIMATORS)
    np.testing.assert_allclose(estimated(of_rig()), h1)
    assert np.all(h1 < hv)
    assert np.all(hv < h2)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"estimator": "h1"}, "estimator"),
        ({"recording": {"estimator": "H1"}}, r"recording\.estimator"),
        ({"estimator": "H1", "channels": {"frf_pc_per_n": {"channel": "FRF"}}}, "estimator"),
        (
            {
                "estimator": "H1",
                "kind": "compression",
                "recording": {},
                "channels": {"force_n": {"channel": "force"}},
            },
            "estimator",
        ),
    ],
)
def test_a_rig_description_is_refused_where_its_estimator_cannot_be_used(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        rig(**changes)

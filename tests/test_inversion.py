"""d33 of simulated arrays: right, with intervals that cover as often as they say, and odd sensors named."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.simulated_campaign import LARGEST_SCATTER_MM, Rig, simulate
from underskin import hertz
from underskin.errors import InvalidInput
from underskin.inversion import Inversion, NoD33, invert
from underskin.mixed_model import Estimate
from underskin.recordings.campaign import Campaign, FrfRecording, parse
from underskin.surrogate import SigmaTable, load_table
from underskin.units import Floats

CAMPAIGNS = 3000 if os.environ.get("UNDERSKIN_SOAK") else 400
NEEDS_CAMPAIGNS = pytest.mark.skipif(
    "UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS does not name the folder of campaigns"
)


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


def drawn(random: np.random.Generator) -> tuple[Rig, float]:
    """A rig like the paper's, and the array's d33 [pC/N] (one sensor: its own)."""
    count = int(random.choice([1, 2, 4, 9, 16]))
    spread = float(random.choice([0.0, 0.0, 0.0, 0.01, random.uniform(0.05, 0.15)]))
    array = float(random.uniform(8, 30))
    d33 = array * (1 + spread * random.normal(size=count))
    rig = Rig(
        d33=d33,
        preloads_n=tuple(np.linspace(0.5, random.uniform(1.5, 3), int(random.integers(2, 7))).tolist()),
        thickness_mm=float(random.uniform(1.5, 3.8)),
        modulus_mpa=float(random.uniform(4, 16)),
        sensor_radius_mm=float(random.uniform(0.6, 2.5)),
        gain=float(np.exp(random.uniform(np.log(0.01), np.log(0.05)))),
        position_mm=float(random.uniform(0.1, LARGEST_SCATTER_MM)) if random.random() < 0.3 else 0.0,
        largest_offset_mm=1.0 if random.random() < 0.3 else 0.0,
        line=float(random.uniform(0.003, 0.03)),
        averages=float(random.choice([8, 16, 32])),
    )
    return rig, array if count > 1 else float(d33[0])


def covered(estimate: Estimate, truth_pc_per_n: Floats) -> Floats:
    truth = truth_pc_per_n * 1e-12
    return np.asarray((estimate.low <= truth) & (truth <= estimate.high), dtype=float)


def test_intervals_cover_as_often_as_they_say(table: SigmaTable) -> None:
    random = np.random.default_rng(1)
    arrays, sensors, cells = [], [], []
    for _ in range(CAMPAIGNS):
        rig, array = drawn(random)
        found = invert(simulate(table, rig, random), table)
        assert found.campaign_d33 is not None
        arrays.append(covered(found.campaign_d33, np.array(array)))
        sensors.append(np.mean(covered(found.sensors, rig.d33)))
        cells.append(np.mean(covered(found.cells.d33, rig.d33[found.cells.sensor])))
    for hits in (arrays, sensors, cells):
        assert 0.93 <= np.mean(hits) <= 0.97


@pytest.mark.parametrize("position_mm", [0.0, 0.25])
def test_the_scatters_come_back(table: SigmaTable, position_mm: float) -> None:
    random = np.random.default_rng(3)
    d33 = 14 * (1 + 0.1 * random.normal(size=25))
    rig = Rig(d33=d33, gain=0.02, position_mm=position_mm, largest_offset_mm=1.0, sensor_radius_mm=1.0)
    found = invert(simulate(table, rig, random), table)
    assert found.spread is not None
    assert found.gain is not None
    assert found.position is not None
    assert found.spread.low <= 0.1 <= found.spread.high
    assert found.gain.low <= 0.02 <= found.gain.high
    assert found.position.value * 1e3 == pytest.approx(position_mm, abs=0.05)
    np.testing.assert_allclose(found.sensors.value * 1e12, d33, rtol=0.05)


def test_a_precise_rig_gives_back_the_d33_of_each_cell(table: SigmaTable) -> None:
    d33 = np.array([14.0, 13.0, 15.0])
    rig = Rig(d33=d33, gain=1e-6, line=1e-6, largest_offset_mm=2.0)
    found = invert(simulate(table, rig, np.random.default_rng(4)), table)
    assert len(found.cells.preload) == 3 * 2 * 5
    np.testing.assert_allclose(found.recordings.d33 * 1e12, d33[found.recordings.sensor], rtol=1e-4)


def codes(found: Inversion) -> dict[str, list[str]]:
    return {flag.sensor: [other.code for other in found.flags if other.sensor == flag.sensor] for flag in found.flags}


def altered(campaign: Campaign, sensor: str, change: str) -> Campaign:
    random = np.random.default_rng(9)

    def alter(recording: FrfRecording) -> FrfRecording:
        assert recording.frf_re_pc_per_n is not None
        assert recording.frf_im_pc_per_n is not None
        real, imaginary = recording.frf_re_pc_per_n, recording.frf_im_pc_per_n
        factor = {
            "weak": 0.3,
            "strong": 2.5,
            "dead": 0.0,
            "inverted": -1.0,
            "noisy": 1.0,
            "bent": 1 + 0.3 * ((recording.preload_n - 1.75) / 1.25) ** 2,
        }[change]
        extra = 0.3 * np.abs(real).mean() * random.normal(size=len(real)) if change in ("noisy", "dead") else 0.0
        return replace(recording, frf_re_pc_per_n=factor * real + extra, frf_im_pc_per_n=factor * imaginary)

    changed = [
        alter(recording) if isinstance(recording, FrfRecording) and recording.sensor == sensor else recording
        for recording in campaign.recordings
    ]
    return replace(campaign, recordings=tuple(changed))


@pytest.mark.parametrize("change", ["weak", "strong", "dead", "inverted", "noisy", "bent"])
def test_a_sensor_that_stands_out_is_named_with_the_reason(table: SigmaTable, change: str) -> None:
    rig = Rig(d33=np.full(9, 14.0), preloads_n=tuple(np.linspace(0.5, 3, 8).tolist()))
    campaign = simulate(table, rig, np.random.default_rng(5))
    plain = invert(campaign, table)
    found = invert(altered(campaign, "s4", change), table)
    assert plain.flags == ()
    assert codes(found) == {"s4": [change]}
    assert found.flags[0].reason.startswith(change)
    assert found.campaign_d33 is not None
    assert covered(found.campaign_d33, np.array(14.0))
    named = any("s4" in line for line in found.left_out)
    assert named == (change in ("weak", "strong", "dead", "inverted"))


def test_whole_arrays_are_seldom_accused(table: SigmaTable) -> None:
    random = np.random.default_rng(6)
    accused = 0
    for _ in range(60):
        d33 = 14 * (1 + 0.05 * random.normal(size=16))
        rig = Rig(d33=d33, preloads_n=(0.5, 1.0, 2.0, 3.0), gain=0.03, position_mm=0.1, largest_offset_mm=0.5)
        accused += bool(invert(simulate(table, rig, random), table).flags)
    assert accused <= 2


def test_a_contact_outside_the_table_is_left_out_and_said_so(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0, 14.0])), np.random.default_rng(7))
    soft = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=0.9))
    found = invert(soft, table)
    outside = ~found.recordings.inside
    assert 0 < outside.sum() < len(outside)
    assert len(found.left_out) == outside.sum()
    assert np.isnan(found.recordings.d33[outside]).all()
    assert all(re.search(r"L = (\S+) exceeds 0.1: at most 1.44 N with this sphere$", line) for line in found.left_out)


def refusal(campaign: Campaign, table: SigmaTable) -> str:
    with pytest.raises(NoD33) as refused:
        invert(campaign, table)
    assert (refused.value.field, refused.value.value) == ("recordings", campaign.name)
    return str(refused.value)


def test_a_campaign_of_which_nothing_can_be_used_says_what_exceeds_what(table: SigmaTable) -> None:
    rig = Rig(d33=np.array([14.0]), indenters_mm=(4.0,), modulus_mpa=16.0, thickness_mm=2.5, preloads_n=(1.0, 2.0))
    campaign = simulate(table, rig, np.random.default_rng(7))
    hard = moved(moved(campaign, 0, preload_n=1000.0), 1, preload_n=50.0)
    said = refusal(hard, table)
    assert said.startswith(
        "none of the 2 recordings can be used: recording r0: F = 1000 N, R = 4 mm, E = 16 MPa, L = 3.9"
    )
    assert "L = 3.91 exceeds 0.1: at most 25.6 N with this sphere; is preload_n in mN?; recording r1: F = 50 N" in said
    assert said.endswith("L = 0.195 exceeds 0.1: at most 25.6 N with this sphere")
    compressible = replace(campaign, skin=replace(campaign.skin, poisson_ratio=0.4))
    assert refusal(compressible, table).endswith(
        "Poisson's ratio = 0.4: the table is of incompressible elastomer, 0.5; and 1 more"
    )
    thin = replace(campaign, skin=replace(campaign.skin, thickness_mm=0.05, sensor_radius_mm=0.1))
    limit = re.search(r"a/h = \S+ exceeds 3: at most (\S+) N", refusal(thin, table))
    assert limit is not None
    assert hertz.contact_radius(float(limit[1]), 4e-3, 16e6) == pytest.approx(3 * 0.05e-3, rel=0.01)
    wide = replace(campaign, skin=replace(campaign.skin, thickness_mm=1.0, sensor_radius_mm=4.0))
    assert "rT/h = 4 exceeds 3" in refusal(wide, table)


def test_a_recording_without_a_line_in_the_band_is_told_apart(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(7))
    first = campaign.recordings[0]
    assert isinstance(first, FrfRecording)
    assert first.frequency_hz is not None
    found = invert(moved(campaign, 0, frequency_hz=first.frequency_hz + 5000), table, (1.0, 100.0))
    assert found.left_out == ("recording r0: it has no line in the band",)


@pytest.mark.parametrize(
    ("factor", "asks"),
    [
        (1000.0, "was mV/pC meant, not mV/nC"),
        (1e-3, "was mV/nC meant, not mV/pC"),
        (-1.0, "is the sign of charge or force"),
    ],
)
def test_a_slip_that_the_whole_array_shows_is_a_finding(table: SigmaTable, factor: float, asks: str) -> None:
    campaign = simulate(table, Rig(d33=np.full(3, 14.0)), np.random.default_rng(7))
    assert invert(campaign, table).findings == ()
    slipped = campaign
    for row in range(len(campaign.recordings)):
        slipped = scaled(slipped, row, factor)
    (finding,) = invert(slipped, table).findings
    assert asks in finding
    assert f"{14 * factor:.2g}"[:3] in finding


def moved(campaign: Campaign, row: int, **changes: object) -> Campaign:
    recording = replace(campaign.recordings[row], **changes)  # type: ignore[arg-type]
    return replace(campaign, recordings=(*campaign.recordings[:row], recording, *campaign.recordings[row + 1 :]))


@pytest.mark.parametrize("x_mm", [19.0, 250.0, 1e9, 1e308])
def test_a_recording_far_off_its_sensor_costs_only_itself(table: SigmaTable, x_mm: float) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(11))
    found = invert(moved(campaign, 0, position_mm=(x_mm, 0.0)), table)
    rest = invert(replace(campaign, recordings=campaign.recordings[1:]), table)
    assert found.campaign_d33 is not None
    assert rest.campaign_d33 is not None
    assert float(found.campaign_d33.value) == pytest.approx(float(rest.campaign_d33.value), rel=1e-6)
    assert found.recordings.inside.tolist() == [False] + 9 * [True]
    assert [line.split(":")[0] for line in found.left_out] == ["recording r0"]


def test_a_skin_much_thinner_than_the_scatter_of_positions_is_inverted(table: SigmaTable) -> None:
    rig = Rig(
        d33=np.array([14.0, 14.0]), thickness_mm=0.1, sensor_radius_mm=0.06, modulus_mpa=100.0,
        preloads_n=(0.02, 0.05, 0.1), indenters_mm=(4.0,),
    )  # fmt: skip
    found = invert(simulate(table, rig, np.random.default_rng(12)), table)
    assert found.recordings.inside.all()
    assert found.campaign_d33 is not None
    assert covered(found.campaign_d33, np.array(14.0))


def scaled(campaign: Campaign, row: int, factor: float) -> Campaign:
    recording = campaign.recordings[row]
    assert isinstance(recording, FrfRecording)
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    real, imaginary = factor * recording.frf_re_pc_per_n, factor * recording.frf_im_pc_per_n
    return moved(campaign, row, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)


@pytest.mark.parametrize("factor", [1000.0, 10.0, -1.0, 1e-3])
@pytest.mark.parametrize("sensors", [1, 5])
def test_a_recording_grossly_off_is_set_aside_and_named(table: SigmaTable, factor: float, sensors: int) -> None:
    rig = Rig(d33=np.full(sensors, 14.0), preloads_n=(0.5, 2.0))
    campaign = simulate(table, rig, np.random.default_rng(13))
    found = invert(scaled(campaign, 0, factor), table)
    assert found.campaign_d33 is not None
    assert covered(found.campaign_d33, np.array(14.0))
    assert covered(found.sensors, rig.d33).all()
    assert [line.split(":")[0] for line in found.left_out] == ["recording r0"]
    assert found.flags == ()


def test_scatter_that_rigs_have_is_never_set_aside(table: SigmaTable) -> None:
    random = np.random.default_rng(14)
    for _ in range(60):
        rig, _ = drawn(random)
        assert invert(simulate(table, rig, random), table).left_out == ()


def test_a_sensor_of_few_recordings_is_flagged_as_a_whole(table: SigmaTable) -> None:
    rig = Rig(d33=np.array([14.0] * 8 + [3.0, 60.0]), preloads_n=(1.0,))
    found = invert(simulate(table, rig, np.random.default_rng(15)), table)
    assert codes(found) == {"s8": ["weak"], "s9": ["strong"]}


@pytest.mark.parametrize("factor", [0.0, 1e-300, 1e200])
def test_a_campaign_without_a_charge_that_can_be_is_refused(table: SigmaTable, factor: float) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0]), preloads_n=(1.0,)), np.random.default_rng(16))
    with pytest.raises(InvalidInput, match=r"no charge in any|below 1 C/N"):
        invert(scaled(scaled(campaign, 0, factor), 1, factor), table)


def test_a_sensor_of_exact_zeros_is_dead(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.full(3, 14.0), preloads_n=(1.0,)), np.random.default_rng(17))
    found = invert(scaled(scaled(campaign, 0, 0.0), 1, 0.0), table)
    assert codes(found) == {"s0": ["dead"]}
    assert np.isfinite([found.sensors.value, found.sensors.low, found.sensors.high]).all()


def test_the_users_band_is_used_and_a_campaign_without_frf_is_refused(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(8))
    assert invert(campaign, table, (10.0, 50.0)).zone.chosen_by_user
    with pytest.raises(InvalidInput, match="frf"):
        invert(replace(campaign, recordings=()), table)


def test_a_declared_thickness_that_is_off_moves_d33_by_what_is_said(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0]), gain=1e-6, line=1e-6), np.random.default_rng(9))
    assert campaign.skin.thickness_mm is not None
    assert campaign.skin.youngs_modulus_mpa is not None
    changes = []
    for skin in (
        replace(campaign.skin, thickness_mm=1.01 * campaign.skin.thickness_mm),
        replace(campaign.skin, youngs_modulus_mpa=1.02 * campaign.skin.youngs_modulus_mpa),
    ):
        found = invert(replace(campaign, skin=skin), table).campaign_d33
        assert found is not None
        changes.append(100 * (float(found.value) / 14e-12 - 1))
    assert invert(campaign, table).declared_percent == pytest.approx(np.hypot(changes[0], changes[1]), rel=0.1)


def test_time_series_are_inverted_and_what_is_wrong_with_them_is_said(table: SigmaTable) -> None:
    random = np.random.default_rng(10)
    campaign = simulate(table, Rig(d33=np.array([14.0, 14.0]), gain=1e-6, line=1e-6), random)

    def as_series(recording: FrfRecording, damage: str) -> FrfRecording:
        assert recording.frf_re_pc_per_n is not None
        force = recording.preload_n + 0.03 * random.normal(size=4000)
        charge = recording.frf_re_pc_per_n[0] * force + 1e-3 * random.normal(size=4000)
        if damage == "held":
            charge[100:140] = charge[100]
        if damage == "lost":
            charge[::50] = charge[1::50] = charge[2::50] = charge[3::50] = charge[4::50] = 1.0
        return replace(
            recording, frequency_hz=None, frf_re_pc_per_n=None, frf_im_pc_per_n=None, coherence=None,
            sample_rate_hz=500.0, force_n=force, charge_pc=charge,
        )  # fmt: skip

    recorded = [item for item in campaign.recordings if isinstance(item, FrfRecording)]
    damage = {"r0": "held", "r1": "lost"}
    found = invert(
        replace(campaign, recordings=tuple(as_series(item, damage.get(item.id, "")) for item in recorded)), table
    )
    np.testing.assert_allclose(found.recordings.d33 * 1e12, 14, rtol=0.01)
    assert len(found.findings) == 1
    assert found.findings[0].startswith("recording r0")
    assert len(found.left_out) == 1
    assert found.left_out[0].startswith("recording r1")


@NEEDS_CAMPAIGNS
def test_concealed_campaigns_with_nothing_missing(table: SigmaTable) -> None:
    folder = Path(os.environ["UNDERSKIN_CAMPAIGNS"])
    truth = json.loads((folder / "open-truth.json").read_text())
    plain = [name for name, known in truth.items() if not known["effects"]]
    assert plain
    for name in plain:
        found = invert(parse(json.loads((folder / "open" / f"{name}.json").read_text())), table)
        assert found.campaign_d33 is not None
        assert found.campaign_d33.value * 1e12 == pytest.approx(truth[name]["d33_pc_per_n"], rel=0.03)
        assert covered(found.campaign_d33, np.array(truth[name]["d33_pc_per_n"]))


def test_a_force_whose_mean_contradicts_the_preload_is_a_finding(table: SigmaTable) -> None:
    random = np.random.default_rng(18)
    campaign = simulate(table, Rig(d33=np.array([14.0]), preloads_n=(1.0,)), random)

    def as_series(recording: FrfRecording, mean: float) -> FrfRecording:
        assert recording.frf_re_pc_per_n is not None
        shaken = 0.03 * random.normal(size=4000)
        charge = recording.frf_re_pc_per_n[0] * shaken + 1e-3 * random.normal(size=4000)
        return replace(
            recording, frequency_hz=None, frf_re_pc_per_n=None, frf_im_pc_per_n=None, coherence=None,
            sample_rate_hz=500.0, force_n=mean + shaken, charge_pc=charge,
        )  # fmt: skip

    recorded = [item for item in campaign.recordings if isinstance(item, FrfRecording)]
    for means, accused in (((1.0, 0.0), []), ((0.05, 2.5), []), ((4.0, 0.2), ["r0", "r1"]), ((1.0, -1000.0), ["r1"])):
        series = tuple(as_series(item, mean) for item, mean in zip(recorded, means, strict=True))
        found = invert(replace(campaign, recordings=series), table).findings
        assert [line.split(":")[0].split()[1] for line in found if "but preload_n is 1" in line] == accused

"""d33 of simulated arrays: right, with intervals that cover as often as they say, and odd sensors named."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.inversion.inverted_campaigns import covered, drawn, moved, scaled
from tests.support.simulated_campaign import Rig, simulate
from underskin.errors import InvalidInput
from underskin.inversion.invert import NoD33, invert
from underskin.physics import hertz
from underskin.recordings.campaign import Campaign, FrfRecording, parse
from underskin.surrogate.sigma_table import SigmaTable, load_table

CAMPAIGNS = 3000 if os.environ.get("UNDERSKIN_SOAK") else 100

NEEDS_CAMPAIGNS = pytest.mark.skipif(
    "UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS does not name the folder of campaigns"
)


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


@pytest.mark.slow
def test_intervals_cover_as_often_as_they_say_and_usual_scatter_is_never_set_aside(table: SigmaTable) -> None:
    """And of whole sensors seldom one is accused, at most in a campaign of twenty."""
    random = np.random.default_rng(1)
    arrays, sensors, cells, accused = [], [], [], 0
    for _ in range(CAMPAIGNS):
        rig, array = drawn(random)
        found = invert(simulate(table, rig, random), table)
        assert found.left_out == ()
        accused += any(flag.code not in ("weak", "strong") for flag in found.flags)  # sensors do differ
        arrays.append(covered(found.campaign_d33, np.array(array)))
        sensors.append(np.mean(covered(found.sensors, rig.d33)))
        cells.append(np.mean(covered(found.cells.d33, rig.d33[found.cells.sensor])))
    for hits in (arrays, sensors, cells):
        assert 0.93 <= np.mean(hits) <= 0.97
    assert accused <= CAMPAIGNS / 20


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


def test_a_contact_outside_the_table_is_left_out_and_said_so(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0, 14.0])), np.random.default_rng(7))
    soft = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=0.9))
    found = invert(soft, table)
    outside = ~found.recordings.inside
    assert 0 < outside.sum() < len(outside)
    assert len(found.left_out) == outside.sum()
    assert np.isnan(found.recordings.d33[outside]).all()
    assert all(
        re.search(r"L = (\S+) exceeds 0.1: at most 1.44 N with this sphere$", left.sentence) for left in found.left_out
    )


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
    assert "L = 3.91 exceeds 0.1: at most 25.6 N with this sphere; is the preload in mN or gf?" in said
    assert "gf?; recording r1: F = 50 N" in said
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
    heavy = moved(moved(wide, 0, preload_n=100.0), 1, preload_n=100.0)
    assert "at most" not in refusal(heavy, table)


def test_a_recording_without_a_line_in_the_band_is_told_apart(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(7))
    first = campaign.recordings[0]
    assert isinstance(first, FrfRecording)
    assert first.frequency_hz is not None
    found = invert(moved(campaign, 0, frequency_hz=first.frequency_hz + 5000), table, (1.0, 100.0))
    assert [left.sentence for left in found.left_out] == ["recording r0: it has no line in the band"]


def test_a_skin_much_thinner_than_the_scatter_of_positions_is_inverted(table: SigmaTable) -> None:
    rig = Rig(
        d33=np.array([14.0, 14.0]), thickness_mm=0.1, sensor_radius_mm=0.06, modulus_mpa=100.0,
        preloads_n=(0.02, 0.05, 0.1), indenters_mm=(4.0,),
    )  # fmt: skip
    found = invert(simulate(table, rig, np.random.default_rng(12)), table)
    assert found.recordings.inside.all()
    assert covered(found.campaign_d33, np.array(14.0))


@pytest.mark.parametrize("factor", [0.0, 1e-300, 1e200])
def test_a_campaign_without_a_charge_that_can_be_is_refused(table: SigmaTable, factor: float) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0]), preloads_n=(1.0,)), np.random.default_rng(16))
    with pytest.raises(InvalidInput, match=r"no charge in any|below 1 C/N|no number that can be meant"):
        invert(scaled(scaled(campaign, 0, factor), 1, factor), table)


def test_the_users_band_is_used_and_a_campaign_without_frf_is_refused(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(8))
    assert invert(campaign, table, (10.0, 50.0)).zone.chosen_by_user
    with pytest.raises(InvalidInput, match="FRFs"):
        invert(replace(campaign, recordings=()), table)


def test_a_declared_value_that_is_off_moves_d33_by_what_is_said(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0]), gain=1e-6, line=1e-6), np.random.default_rng(9))
    changes = []
    for name, off in (("thickness_mm", 1.02), ("sensor_radius_mm", 1.02), ("youngs_modulus_mpa", 1.1)):
        skin = replace(campaign.skin, **{name: off * getattr(campaign.skin, name)})
        found = invert(replace(campaign, skin=skin), table).campaign_d33
        assert found is not None
        changes.append(100 * (float(found.value) / 14e-12 - 1))
    assert invert(campaign, table).declared_percent == pytest.approx(np.linalg.norm(changes), rel=0.1)


@pytest.mark.slow
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
    assert found.findings[0].sentence.startswith("recording r0")
    assert len(found.left_out) == 1
    assert found.left_out[0].sentence.startswith("recording r1")


@pytest.mark.slow
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

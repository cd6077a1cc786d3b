"""Tolerances of the declared skin: part of the array's interval, and of no interval between sensors."""

from dataclasses import replace

import numpy as np
import pytest

from bench.soak import SOAK
from tests.inversion.inverted_campaigns import covered
from tests.support.campaign_documents import FRF, document
from tests.support.instrument_files import hdf5
from tests.support.simulated_campaign import Rig, simulate
from underskin.inversion.invert import invert
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import Tolerances, parse, to_dict
from underskin.recordings.readers import json_file
from underskin.surrogate.sigma_table import SigmaTable, load_table


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


@pytest.mark.slow
def test_a_skin_within_its_tolerances_is_covered(table: SigmaTable) -> None:
    """Declared values drawn by their tolerances: the absolute interval holds the true d33 as often as it says, 95 %."""
    random = np.random.default_rng(5)
    within = []
    campaign = simulate(table, Rig(d33=np.full(3, 14.0)), np.random.default_rng(6))
    skin = campaign.skin
    assert skin.thickness_mm
    assert skin.sensor_radius_mm
    assert skin.youngs_modulus_mpa
    for _ in range(200 if SOAK else 30):
        off = np.exp(np.array([0.02, 0.02, 0.1]) * random.normal(size=3))
        declared = replace(
            skin,
            thickness_mm=skin.thickness_mm * off[0],
            sensor_radius_mm=skin.sensor_radius_mm * off[1],
            youngs_modulus_mpa=skin.youngs_modulus_mpa * off[2],
        )
        found = invert(replace(campaign, skin=declared), table).absolute_d33
        within.append(bool(covered(found, np.array(14.0))))
    assert 0.88 <= np.mean(within) <= 1.0


def test_the_interval_goes_with_the_tolerances(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.full(3, 14.0)), np.random.default_rng(7))
    widths = []
    for tolerances in (Tolerances(0.0, 0.0, 0.0), None, Tolerances(4.0, 4.0, 20.0)):
        found = invert(replace(campaign, skin=replace(campaign.skin, tolerances=tolerances)), table)
        assert found.absolute_d33 is not None
        assert found.campaign_d33 is not None
        widths.append(float(found.absolute_d33.high - found.absolute_d33.low))
        if tolerances == Tolerances(0.0, 0.0, 0.0):
            assert widths[0] == pytest.approx(float(found.campaign_d33.high - found.campaign_d33.low))
    assert widths[1] > 1.5 * widths[0]
    assert widths[2] > 1.5 * widths[1]


def test_tolerances_are_part_of_every_form_of_a_campaign() -> None:
    stated = {"thickness_percent": 1.0, "sensor_radius_percent": 0.5, "youngs_modulus_percent": 20.0}
    given = document(FRF)
    given["skin"] = {**given["skin"], "tolerances": stated}
    campaign = parse(given)
    assert campaign.skin.tolerances == Tolerances(**stated)
    for data, name in ((hdf5(given), "c.h5"), (json_file.write(campaign), "c.json")):
        assert to_dict(read_file(data, name).campaign) == to_dict(campaign)
    partly = {**given, "skin": {**given["skin"], "tolerances": {"thickness_percent": 1.0}}}
    assert parse(partly).skin.tolerances == Tolerances(thickness_percent=1.0)
    rig = {"schema": "rig/1", "skin": given["skin"], "channels": {"force_n": {"channel": "F"}}}
    assert rig_description.from_dict(rig).skin["tolerances"] == stated


def test_tolerances_in_the_template() -> None:
    lines = [
        "schema,campaign/1",
        "name,c",
        "skin.thickness_mm,2.5",
        "skin.youngs_modulus_mpa,16",
        "skin.poisson_ratio,0.5",
    ]
    lines += ["skin.sensor_radius_mm,1.5", "skin.tolerances.thickness_percent,0.4", "sensor,s01,0,0", ""]
    lines += ["id,sensor,indenter_radius_mm,preload_n,dynamic_force_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n"]
    lines += ["r1,s01,4,1,0.1,10,7.4,0", ",,,,,20,7.4,0"]
    reading = read_file("\n".join(lines).encode(), "c.csv")
    assert reading.problems == []
    assert reading.campaign.skin.tolerances == Tolerances(thickness_percent=0.4)

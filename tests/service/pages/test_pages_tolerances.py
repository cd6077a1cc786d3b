"""What the skin's declared values may be off by is in what the campaign's page says of the array's d33."""

from typing import Any

import numpy as np
import pytest

from tests.service.pages.forms import said
from tests.support.diagnosed import sent
from tests.support.simulated_campaign import Rig, simulate
from tests.support.store_server import Server
from underskin.recordings.campaign import to_dict
from underskin.surrogate.sigma_table import load_table


def mistuned(**skin: Any) -> dict[str, Any]:
    """A campaign of sensors of 14 pC/N, whose skin is declared 3 % too thick, 2 % too wide and 15 % too stiff."""
    rig = Rig(d33=np.full(3, 14.0), thickness_mm=2.5, sensor_radius_mm=1.5, modulus_mpa=16.0)
    document = to_dict(simulate(load_table(), rig, np.random.default_rng(4)))
    off = {"thickness_mm": 2.575, "sensor_radius_mm": 1.47, "youngs_modulus_mpa": 18.4}
    return {**document, "name": "off", "skin": {**document["skin"], **off, **skin}}


def test_page_s_interval_holds_d33_skin(server: Server) -> None:
    """The page s interval holds a d33 of a skin within its tolerances."""
    campaign_id = sent(server, mistuned(), "off")
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    array, relative = answer["array"], answer["array_relative"]
    assert array["d33_low_pc_per_n"] < 14 < array["d33_high_pc_per_n"]
    assert not relative["d33_low_pc_per_n"] < 14 < relative["d33_high_pc_per_n"]
    told = said(server, f"/campaigns/{campaign_id}")
    shown = f"(95 %: {array['d33_low_pc_per_n']:.1f} to {array['d33_high_pc_per_n']:.1f})"
    assert shown in told.replace("\xa0", " ")
    assert "The interval includes what the declared thickness, sensor radius and modulus may be off by" in told


def test_stated_tolerances_replace_usual_ones(server: Server) -> None:
    """Stated tolerances replace the usual ones."""
    exact = {"thickness_percent": 0, "sensor_radius_percent": 0, "youngs_modulus_percent": 0}
    campaign_id = sent(server, mistuned(tolerances=exact), "exact")
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    assert answer["declared_percent"] == 0
    assert answer["array"] == pytest.approx(answer["array_relative"])
    assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json()["skin"]["tolerances"] == exact

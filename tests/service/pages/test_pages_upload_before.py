"""What somebody is told of an upload before it is kept: that it is here already, that its d33 can be none, what is
refused and why."""

import html
import io
from typing import Any

import httpx
import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.uploads import as_json
from tests.support.store_server import Server, campaign


def looked_at(server: Server, name: str, content: str, **fields: str) -> str:
    """The page of an upload."""
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        form = {"form_token": token_of(client.get("/upload").text), **fields}
        answer = client.post("/upload", data=form, files={"file": (name, content.encode())}, follow_redirects=True)
    assert answer.status_code == 200, answer.text
    return answer.text


def scaled(document: dict[str, Any], factor: float) -> dict[str, Any]:
    for recording in document["recordings"]:
        for name in ("frf_re_pc_per_n", "frf_im_pc_per_n"):
            recording[name] = [factor * value for value in recording[name]]
    return document


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e3, "pC/N, more than sensors have: was mV/pC meant"),
        (1e-3, "pC/N, less than sensors have: was mV/nC meant"),
        (-1.0, "negative: is the sign of charge or force turned?"),
    ],
)
def test_a_d33_that_no_sensor_has_is_said_before_it_is_kept(server: Server, factor: float, said: str) -> None:
    page = looked_at(server, "slip.json", as_json(scaled(campaign("slip", id="slips"), factor)))
    (line,) = [line for line in page.splitlines() if "before you keep it" in line]
    assert "d33 of the array is" in line
    assert said in line
    assert page.index("before you keep it") < page.index("<button>Keep")


def test_recordings_that_are_here_already_are_named_with_their_campaign(server: Server) -> None:
    document = campaign("first monday", id="twice")
    assert "before you keep it" not in looked_at(server, "monday.json", as_json(document))
    kept = server.http.post("/v1/campaigns", json=document).json()
    day = server.http.get(f"/v1/campaigns/{kept['id']}").json()["received_at"][:10]
    told = f"these recordings are in campaign first monday of skin twice already (kept {day})."
    renamed = {**document, "name": "second monday", "recordings": document["recordings"][1:]}
    renamed["recordings"] = [{**one, "id": f"again {one['id']}"} for one in renamed["recordings"]]
    for content in (document, renamed):
        assert told in looked_at(server, "again.json", as_json(content))
    document["recordings"][0]["frf_re_pc_per_n"][0] += 1e-9
    in_part = "5 of these 6 recordings are in campaign first monday of skin twice already"
    assert in_part in looked_at(server, "other.json", as_json(document))
    for recording in document["recordings"][1:]:
        recording["frf_re_pc_per_n"][0] += 1e-9
    assert "already" not in looked_at(server, "other.json", as_json(document))
    server.http.post(f"/v1/campaigns/{kept['id']}/withdraw", json={"reason": "wrong skin"}).raise_for_status()
    assert told not in looked_at(server, "after.json", as_json(renamed))


def test_a_correction_that_names_another_skin_is_offered_the_one_it_corrects(server: Server) -> None:
    wrong = server.http.post("/v1/campaigns", json=campaign("slip", id="old"), params={"skin": "old"}).json()["id"]
    page = looked_at(server, "right.json", as_json(campaign("right", id="new")), corrects=wrong)
    assert "the file names skin new, not old, that of the campaign that it corrects" in page
    assert 'id="keep-skin" name="skin" list="skins" value="old"' in page
    assert "nothing would change" not in page
    page = looked_at(server, "same.json", as_json(campaign("slip", id="old")), corrects=wrong)
    assert "it says the same as the campaign that it corrects: nothing would change." in page


RATE_HZ, SAMPLES = 1024, 2048


def shaken(static: np.ndarray | float) -> bytes:
    """A shaker about a static force [N], in newtons and picocoulombs."""
    shaking = 0.1 * np.random.default_rng(3).normal(size=SAMPLES)
    timing = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0}
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        channels = [
            ChannelObject("press 1", name, values, {**timing, "unit_string": unit})
            for name, values, unit in (("Force", static + shaking, "N"), ("Charge", 7 * shaking, "pC"))
        ]
        writer.write_segment([RootObject({}), GroupObject("press 1", {}), *channels])
    return buffer.getvalue()


RIG = """\
schema: rig/1
kind: frf
skin: {thickness_mm: 2.5, youngs_modulus_mpa: 16, poisson_ratio: 0.5, sensor_radius_mm: 1.5,
       sensors: [{id: s1, x_mm: 0, y_mm: 0}]}
recording: {sensor: s1, indenter_radius_mm: 4, preload_n: 1}
channels: {force_n: {channel: Force}, charge_pc: {channel: Charge}}
"""


def test_a_stated_preload_is_held_against_the_force_of_each_file(server: Server) -> None:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        form = {"form_token": token_of(client.get("/upload").text)}
        files = [("file", (f"{force}.tdms", shaken(force))) for force in (1.0, 2.0)]
        answer = client.post("/upload", data=form, files=[*files, ("rig", ("rig.yaml", RIG))], follow_redirects=True)
    assert "<b>2</b> recordings understood" in answer.text
    assert answer.text.count("as stated, but its force is") == 1
    assert "2.0.tdms: pressed by 1 N as stated, but its force is 2.00 N on average" in html.unescape(answer.text)


def test_why_recordings_are_refused_stands_before_they_are_kept(server: Server) -> None:
    document = campaign("partly", sensors=2, id="partly")
    document["recordings"][0]["preload_n"] = -2.0
    page = html.unescape(looked_at(server, "bad.json", as_json(document)))
    assert "preload_n" in page
    assert page.index("must be finite and greater than 0") < page.index("<button>Keep")


@pytest.mark.parametrize(("first", "said"), [(60.0, "these will give no d33"), (None, "no d33 will come of this")])
def test_preload_beyond_table_gives_no_d33_said(server: Server, first: float | None, said: str) -> None:
    """That a preload beyond the table gives no d33 is said before."""
    document = campaign("heavy", sensors=2, id="heavy")
    for number, recording in enumerate(document["recordings"]):
        recording["preload_n"] = 60.0 if first is None or number == 0 else recording["preload_n"]
    page = looked_at(server, "heavy.json", as_json(document))
    assert said in page
    assert page.index(said) < page.index("<button>Keep")

"""What somebody is told of an upload before it is kept: that it is here already, that its d33 can be none."""

from typing import Any

import httpx
import pytest

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
def test_d33_no_sensor_said_before_kept(server: Server, factor: float, said: str) -> None:
    """A d33 that no sensor has is said before it is kept."""
    page = looked_at(server, "slip.json", as_json(scaled(campaign("slip", id="slips"), factor)))
    (line,) = [line for line in page.splitlines() if "before you keep it" in line]
    assert "d33 of the array is" in line
    assert said in line
    assert page.index("before you keep it") < page.index("<button>Keep")


def test_recordings_here_already_named_campaign(server: Server) -> None:
    """Recordings that are here already are named with their campaign."""
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


def test_correction_names_skin_offered_corrects(server: Server) -> None:
    """A correction that names another skin is offered the one it corrects."""
    wrong = server.http.post("/v1/campaigns", json=campaign("slip", id="old"), params={"skin": "old"}).json()["id"]
    page = looked_at(server, "right.json", as_json(campaign("right", id="new")), corrects=wrong)
    assert "the file names skin new, not old, that of the campaign that it corrects" in page
    assert 'id="keep-skin" name="skin" list="skins" value="old"' in page
    assert "nothing would change" not in page
    page = looked_at(server, "same.json", as_json(campaign("slip", id="old")), corrects=wrong)
    assert "it says the same as the campaign that it corrects: nothing would change." in page

"""Raw curves of height and deflection, from the upload page to the modulus: the same by page, command line and HTTP."""

import html
import json
import re
from pathlib import Path

import httpx
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.uploads import campaigns_of
from tests.support.raw_curves import MODULUS_MPA, RADIUS_MM, SPRING_N_PER_M, rig_of_raw_curve, text_of_raw_curve
from tests.support.store_server import Server
from underskin import diagnose
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import load_table

DERIVED = rig_of_raw_curve()["derived"]
FORM = {
    "kind": "indentation",
    "poisson_ratio": "0.5",
    "indenter_radius_mm": f"{RADIUS_MM}",
    "units_checked": "yes",
    "tare-force_n": "10",
    "derived-name-0": "k",
    "derived-formula-0": f"{SPRING_N_PER_M:g} [N/m]",
    "derived-formula-1": DERIVED["depth"],
    "derived-is-1": "displacement_mm",
    "derived-formula-2": DERIVED["load"],
    "derived-is-2": "force_n",
}


def kept_by_page(server: Server, text: str, skin: str) -> None:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        token = {"form_token": token_of(client.get("/upload").text)}
        address = client.post("/upload", data=token, files={"file": ("afm.txt", text.encode())}).headers["location"]
        token = {"form_token": token_of(client.get(address).text)}
        client.post(f"{address}/mapping", data=FORM | token)
        assert "<b>1</b> recording understood" in client.get(address).text
        rig = client.get(f"{address}/rig.json").json()
        assert rig["derived"] == {
            "k": "3 [N/m]",
            "derived displacement": DERIVED["depth"],
            "derived force": DERIVED["load"],
        }
        client.post(f"{address}/keep", data={"skin": skin} | token)


def test_an_instruments_template_reads_its_next_file(server: Server) -> None:
    text = text_of_raw_curve(above="# template")
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        for day in ("monday", "tuesday"):
            token = {"form_token": token_of(client.get("/upload").text)}
            sent = {"file": (f"{day}.txt", f"{text}\n".encode())}
            address = client.post("/upload", data=token, files=sent).headers["location"]
            page = client.get(address).text
            token = {"form_token": token_of(page)}
            assert ("Read them so again" in page) == (day == "tuesday")
            if day == "monday":
                client.post(f"{address}/mapping", data=FORM | token | {"name": "force microscope 2"})
            else:
                assert "force microscope 2" in page
                client.post(f"{address}/template", data=token)
            assert "<b>1</b> recording understood" in client.get(address).text
            client.post(f"{address}/keep", data={"skin": day} | token)
    (one,), (other,) = (campaigns_of(server, day) for day in ("monday", "tuesday"))
    forces = [
        server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"][0]["force_n"] for kept in (one, other)
    ]
    assert forces[0] == forces[1]


def test_a_depth_of_several_channels_is_not_flipped_as_a_whole(server: Server) -> None:
    """Height less deflection, of a height that falls, is no depth turned round: the modulus would be wrong."""
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        token = {"form_token": token_of(client.get("/upload").text)}
        text = text_of_raw_curve(above="# not flipped").encode()
        address = client.post("/upload", data=token, files={"file": ("afm.txt", text)}).headers["location"]
        token = {"form_token": token_of(client.get(address).text)}
        wrong = {"derived-formula-1": "'Height (nm)' - 'Deflection (nm)'"}
        client.post(f"{address}/mapping", data=FORM | wrong | token)
        page = html.unescape(client.get(address).text)
        beside = re.search(r'id="derived-wrong-1">([^<]*)<', page)
        assert beside is not None
        assert "turn the terms of 'Height (nm)' - 'Deflection (nm)' that fall as it is pressed" in beside[1]
        assert "Flip what is counted negative" not in page


@pytest.mark.slow
def test_a_raw_curve_gives_the_known_modulus_by_every_way_in(server: Server, tmp_path: Path) -> None:
    text = text_of_raw_curve(noise_nm=2, seed=900411)
    kept_by_page(server, text, "afm-page")
    rig, curve = tmp_path / "rig.json", tmp_path / "afm.txt"
    rig.write_text(json.dumps(rig_of_raw_curve()))
    curve.write_text(text)
    url = str(server.http.base_url)
    server.place.command("import", str(curve), "--rig", str(rig), "--skin", "afm-command", "--url", url)
    sent = {"rig": ("rig.json", rig.read_bytes()), "file": ("afm.txt", text.encode())}
    server.http.post("/v1/campaigns", params={"skin": "afm-http"}, files=sent).raise_for_status()
    documents = []
    for way in ("page", "command", "http"):
        (kept,) = campaigns_of(server, f"afm-{way}")
        documents.append(server.http.get(f"/v1/campaigns/{kept}/document").json())
    columns = [[document["recordings"][0][name] for name in ("displacement_mm", "force_n")] for document in documents]
    assert columns[0] == columns[1] == columns[2]
    report = diagnose(parse(documents[0]), load_table())
    assert report["verdict"] == "no_mismatch"
    found = re.search(
        r"Young's modulus over all answers: ([\d.]+) MPa \(95 %: ([\d.]+) to ([\d.]+)\)", report["statement"]
    )
    assert found is not None, report["statement"]
    value, low, high = map(float, found.groups())
    assert value == pytest.approx(MODULUS_MPA, rel=0.03)
    assert low <= MODULUS_MPA <= high

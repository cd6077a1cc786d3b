"""An indentation on the upload page: its curve is there at once, from a force or from a spring's deflection."""

import base64
import html
import re
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import orjson
import pytest

from tests.cli.commands import run
from tests.service.pages.forms import BROWSING, token_of
from tests.support.store_server import Server

DEPTH_UM = np.linspace(-0.5, 1.5, 17)
FORCE_UN = np.where(DEPTH_UM > 0, 20 * np.abs(DEPTH_UM) ** 1.5, 0.0)
DEFLECTION_UM = FORCE_UN / 3  # 3 N/m
IN_LAB = {"mm": 1.0, "µm": 1e-3, "nm": 1e-6, "N": 1.0, "mN": 1e-3, "µN": 1e-6, "nN": 1e-9}


def table(columns: dict[str, Any], above: str = "") -> str:
    rows = zip(*columns.values(), strict=True)
    return "\n".join([above, "\t".join(columns), "eoh", *("\t".join(f"{one:.9g}" for one in row) for row in rows)])


class Upload:
    """One file on its page, without a browser."""

    def __init__(self, client: httpx.Client, content: str | bytes, name: str = "curve.txt") -> None:
        self.client = client
        form = {"form_token": token_of(client.get("/upload").text)}
        sent = content.encode() if isinstance(content, str) else content
        answer = client.post("/upload", data=form, files={"file": (name, sent)})
        self.address, self.page = answer.headers["location"], ""
        self.look()

    def look(self) -> None:
        self.page = self.client.get(self.address).text

    def say(self, **changes: str) -> None:
        """Send the form as the page has it, with changes."""
        form = dict(re.findall(r'<input type="hidden" name="((?:channel|label)-\d+)" value="([^"]*)"', self.page))
        for name, body in re.findall(r'<select[^>]* name="([^"]+)"[^>]*>(.*?)</select>', self.page, re.DOTALL):
            chosen = re.search(r'value="([^"]*)" selected', body)
            form[name] = chosen[1] if chosen else ""
        for tag in re.findall(r"<input (?!type)[^>]*>", self.page):
            name, value = re.search(r'name="([^"]+)"', tag), re.search(r'value="([^"]*)"', tag)
            if name and value:
                form[name[1]] = value[1]
        sent = {name: html.unescape(value) for name, value in form.items()} | changes
        token = {"form_token": token_of(self.page)}
        assert self.client.post(f"{self.address}/mapping", data=sent | token).status_code == 303
        self.look()

    def figure(self, name: str) -> dict[str, Any]:
        """As plotly has it."""
        place = f'id="figure-{name}".*?<script type="application/json">(.*?)</script>'
        drawn = re.search(place, self.page, re.DOTALL)
        assert drawn is not None
        found: dict[str, Any] = orjson.loads(html.unescape(drawn[1]))
        return found

    @property
    def curve(self) -> tuple[np.ndarray, np.ndarray]:
        """Depth [mm] and force [N] of the figure."""
        figure = self.figure("curves")
        columns = []
        for axis in "xy":
            unit = figure["layout"][f"{axis}axis"]["title"]["text"].partition("[")[2].removesuffix("]")
            values = [decoded(trace[axis]) for trace in figure["data"]]
            columns.append(IN_LAB[unit] * np.concatenate([values[0], *(one[1:] for one in values[1:])]))
        return columns[0], columns[1]


def decoded(values: Any) -> np.ndarray:
    """Numbers as plotly writes them."""
    if isinstance(values, dict):
        return np.frombuffer(base64.b64decode(values["bdata"]), values["dtype"])
    return np.array(values)


@pytest.fixture
def client(server: Server) -> Any:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as opened:
        yield opened


def test_a_curve_is_drawn_before_anything_else_is_known(client: httpx.Client) -> None:
    upload = Upload(client, table({"Depth (um)": DEPTH_UM, "Force (uN)": FORCE_UN}))
    assert "<b>No recording</b> understood yet" in upload.page
    depth, force = upload.curve
    assert depth == pytest.approx(1e-3 * DEPTH_UM, rel=1e-5)
    assert force == pytest.approx(1e-6 * FORCE_UN, rel=1e-5)
    said = html.unescape(upload.page)
    assert "rows of 2 numbers from line 4 to 20, separated by tabs, with decimal points; names from line 2" in said
    assert "<b>displacement</b>: 'Depth (um)' in um: -0.5 to 1.5 µm" in said
    assert upload.page.index('id="figure-curves"') < upload.page.index('id="mapping"')


def test_force_and_depth_come_from_a_deflection_in_the_form(client: httpx.Client) -> None:
    raw = {"Piezo (um)": DEPTH_UM + DEFLECTION_UM, "Deflection (nm)": 1e3 * DEFLECTION_UM}
    stated = Upload(client, table(raw, "k (N/m)\t3"))
    assert stated.curve[1] == pytest.approx(1e-6 * FORCE_UN, rel=1e-5)
    upload = Upload(client, table(raw))
    assert 'id="figure-curves"' not in upload.page
    upload.say(spring_constant_n_per_m="3", indenter_radius_mm="0.0075", units_checked="yes")
    assert "<b>1</b> recording understood" in upload.page
    depth, force = upload.curve
    assert depth == pytest.approx(1e-3 * DEPTH_UM, abs=1e-9)
    assert force == pytest.approx(1e-6 * FORCE_UN, rel=1e-5)
    before = client.get(f"{upload.address}/rig.json").json()
    assert before["channels"] == {
        "displacement_mm": {"channel": "Piezo (um)", "deflection": {"channel": "Deflection (nm)"}},
        "force_n": {"channel": "Deflection (nm)", "spring_constant_n_per_m": 3.0},
    }
    upload.say(units_checked="yes")
    assert client.get(f"{upload.address}/rig.json").json() == before


def test_what_is_turned_is_shown_turned(client: httpx.Client) -> None:
    depth = np.concatenate([DEPTH_UM - DEPTH_UM[0], DEPTH_UM[-2::-1] - DEPTH_UM[0]])
    force = np.concatenate([FORCE_UN, FORCE_UN[-2::-1]])
    upload = Upload(client, table({"Depth (um)": -depth, "Force (uN)": -force}))
    upload.say(indenter_radius_mm="0.0075", units_checked="yes")
    assert "-2 to 0 µm" in html.unescape(upload.page)
    token = {"form_token": token_of(upload.page)}
    assert client.post(f"{upload.address}/signs", data={"turned": "yes"} | token).status_code == 303
    upload.look()
    said = html.unescape(upload.page)
    assert "'Depth (um)' in um, turned round: 0 to 2 µm" in said
    assert "-2 to 0 µm" not in said
    assert re.search(r"<b>force</b>: [^<]*, turned round: 0 to 36\.7\d µN", said)
    course = upload.figure("course")
    assert {trace["name"] for trace in course["data"]} == {"loading", "way back"}
    assert all(np.nanmin(decoded(trace["y"])) >= 0 for trace in course["data"])


def test_page_and_command_say_the_same_of_a_punch(client: httpx.Client, tmp_path: Path) -> None:
    """A flat punch declared as a sphere gives no modulus, as the command says, before the file is kept."""
    depth = np.linspace(-0.1, 0.3, 201)
    text = table({"Depth (mm)": depth, "Force (N)": np.where(depth > 0, 8 / 3 * depth, 0.0)})
    upload = Upload(client, text)
    upload.say(kind="indentation", indenter_radius_mm="1", poisson_ratio="0.5")
    (tmp_path / "curve.txt").write_text(text)
    (tmp_path / "rig.json").write_bytes(client.get(f"{upload.address}/rig.json").content)
    answer = run("d33", str(tmp_path / "curve.txt"), "--rig", str(tmp_path / "rig.json"))
    (said,) = [line for line in answer.stdout.splitlines() if line.startswith("left out: ")]
    assert "as under a flat punch" in said
    assert said in html.unescape(upload.page)

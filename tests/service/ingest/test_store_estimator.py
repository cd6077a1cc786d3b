"""H1, H2 or Hv by the query, the form, the client and the command line: kept with the recordings, and used for d33."""

from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from tests.recordings.known_signals import RATE
from tests.support.store_server import Server, campaign
from underskin import Client
from underskin.recordings.campaign import FrfRecording

BACKEND = "sqlite"
ESTIMATORS = ("H1", "H2", "Hv")


def shaken(name: str) -> dict[str, Any]:
    """A sensor without dynamics, 7 pC/N, with noise of 30 % of each signal in force and charge."""
    random = np.random.default_rng(900_003)
    document = campaign(name, sensors=1)
    for recording in document["recordings"]:
        force = 0.05 * random.standard_normal(8000)
        seen = force + 0.015 * random.standard_normal(8000), 7 * (force + 0.015 * random.standard_normal(8000))
        for field in ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence"):
            del recording[field]
        recording |= {"sample_rate_hz": RATE, "force_n": (2 + seen[0]).tolist(), "charge_pc": seen[1].tolist()}
    return document


def d33(server: Server, campaign_id: str) -> float:
    return float(server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()["array"]["d33_pc_per_n"])


def require_estimated(server: Server, ids: dict[str, str]) -> None:
    """Noise of 0.3² of the power in both channels is taken off whichever estimator is asked for, which is kept."""
    values = {name: d33(server, campaign_id) for name, campaign_id in ids.items()}
    assert values["H1"] == pytest.approx(values["Hv"], rel=0.03)
    assert values["H2"] == pytest.approx(values["Hv"], rel=0.03)
    for name, campaign_id in ids.items():
        (first, *_) = server.http.get(f"/v1/campaigns/{campaign_id}/document").json()["recordings"]
        assert first["estimator"] == name


def test_the_query_and_the_form_choose_the_estimator(server: Server) -> None:
    content = orjson.dumps(shaken("shaken"))
    ids = {}
    for name in ESTIMATORS:
        answer = server.http.post(f"/v1/campaigns?estimator={name}", json=orjson.loads(content))
        assert answer.status_code == 201, answer.text
        ids[name] = answer.json()["id"]
    require_estimated(server, ids)
    file: list[tuple[str, Any]] = [("file", ("a.json", content))]
    answer = server.http.post("/v1/campaigns", files=[*file, ("estimator", (None, "Hv"))])
    assert d33(server, answer.json()["campaigns"][0]["id"]) == d33(server, ids["Hv"])
    answer = server.http.post("/v1/campaigns?estimator=H4", files=file)
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "estimator")
    answer = server.http.post("/v1/campaigns?estimator=Hv", json=campaign("lines"))
    assert answer.json()["notes"] == ["Hv is for time series, which 6 of 6 recordings are not"]


def test_the_estimator_stays_with_a_skin_that_moves(server: Server, elsewhere: Server, tmp_path: Path) -> None:
    sent = server.http.post("/v1/campaigns?estimator=Hv&skin=palm", json=shaken("shaken")).json()["id"]
    with Client(str(server.http.base_url)) as client, Client(str(elsewhere.http.base_url)) as other:
        client.skins.export("palm", tmp_path / "palm.h5")
        other.skins.load(tmp_path / "palm.h5")
        moved = other.campaigns.load(sent)
    assert {recording.estimator for recording in moved.recordings if isinstance(recording, FrfRecording)} == {"Hv"}
    assert d33(elsewhere, sent) == d33(server, sent)


def test_the_client_and_the_commands_choose_the_estimator(server: Server, tmp_path: Path) -> None:
    file = tmp_path / "shaken.json"
    file.write_bytes(orjson.dumps(shaken("shaken")))
    there = ["--url", str(server.http.base_url)]
    ids = {}
    with Client(str(server.http.base_url)) as client:
        ids["H1"] = client.campaigns.post(shaken("shaken"), estimator="H1")["id"]
        ids["H2"] = client.campaigns.post_files([file], estimator="H2")[0]["id"]
        done = server.place.command("import", str(file), "--estimator", "Hv", *there)
        assert done.returncode == 0, done.stderr
        ids["Hv"] = next(client.campaigns.all())["id"]
        require_estimated(server, ids)
    done = server.place.command("import", str(file), "--estimator", "H9", *there)
    assert (done.returncode, "'H9' is not one of 'H1', 'H2', 'Hv'" in done.stderr) == (2, True)
    told = {name: server.place.command("d33", str(file), "--estimator", name, "--csv").stdout for name in ("H2", "Hv")}
    for name, text in told.items():
        array = next(line for line in text.splitlines() if ",array," in line)
        assert float(array.split(",")[6]) == pytest.approx(d33(server, ids[name]), rel=1e-6)

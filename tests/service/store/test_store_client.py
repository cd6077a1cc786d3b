"""The Python client and the command line, on all that the store does."""

import re
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import orjson
import pytest

from service.store import campaigns, database
from tests.support.store_server import Place, Server, campaign, running
from underskin import Client
from underskin.recordings.campaign import parse, to_dict

BACKEND = "sqlite"


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(str(server.http.base_url)) as opened:
        yield opened


def test_a_campaign_there_and_back(client: Client) -> None:
    sent = parse(campaign("array"))
    answer = client.campaigns.post(sent, skin="palm")
    assert to_dict(client.campaigns.load(answer["id"])) == to_dict(sent)
    assert client.campaigns.get(answer["id"])["recordings"] == 6
    assert [entry["id"] for entry in client.campaigns.all(skin="palm")] == [answer["id"]]
    d33 = client.campaigns.d33(answer["id"])
    assert {entry["sensor"] for entry in d33["sensors"]} == {"s0", "s1", "s2"}
    chosen = client.campaigns.d33(answer["id"], band_hz=(20, 80))
    assert (chosen["band"]["low_hz"], chosen["band"]["chosen_by_user"]) == (20, True)


def test_pages_are_turned(client: Client, server: Server) -> None:
    store = database(server.place.database_url, server.place.folder)
    with closing(store), store.writing() as connection:
        for number in range(210):
            one = parse(campaign(f"{number}", sensors=1, lines=3))
            campaigns.add(connection, campaigns.NewCampaign(one, None))
    assert len({entry["id"] for entry in client.campaigns.all()}) == 210
    assert len({entry["id"] for entry in client.skins.all()}) == 210


def test_the_commands_import_and_export(server: Server, tmp_path: Path) -> None:
    good, mixed, bad = tmp_path / "good.json", tmp_path / "mixed.json", tmp_path / "bad.json"
    good.write_bytes(orjson.dumps(campaign("good")))
    spoilt = campaign("mixed")
    spoilt["recordings"][0]["preload_n"] = -1
    mixed.write_bytes(orjson.dumps(spoilt))
    bad.write_text("{")
    there = ["--url", str(server.http.base_url)]
    done = server.place.command("import", str(good), "--skin", "palm", *there)
    assert done.returncode == 0, done.stderr
    assert re.search(r"6 recordings: d33 1\d\.\d ± [\d.]+ pC/N$", done.stdout.strip())
    done = server.place.command("import", str(mixed), str(bad), str(good), "--skin", "palm", *there)
    assert done.returncode == 2
    told = done.stdout + done.stderr
    assert "preload_n = -1" in told
    assert "bad.json" in told
    assert done.stdout.count(" ± ") == 2
    assert done.stdout.count("of skin palm, was there, 6 recordings") == 1
    assert len(server.http.get("/v1/campaigns?skin=palm").json()["campaigns"]) == 2
    done = server.place.command("import", str(good), *there)
    assert "was there" not in done.stdout
    assert done.returncode == 0
    file = tmp_path / "palm.h5"
    done = server.place.command("export", "palm", str(file), *there)
    assert done.returncode == 0, done.stderr
    other = Place(tmp_path / "other")
    other.folder.mkdir()
    with running(other) as elsewhere:
        done = server.place.command("import", str(file), "--url", str(elsewhere.http.base_url))
        assert done.returncode == 0, done.stderr
        assert len(elsewhere.http.get("/v1/campaigns?skin=palm").json()["campaigns"]) == 2


def test_import_tells_what_the_files_are_worth(server: Server, tmp_path: Path) -> None:
    hard, odd = campaign("hard"), campaign("odd")
    for recording in hard["recordings"]:
        recording["preload_n"] = 500
    for recording in odd["recordings"]:
        recording["frf_re_pc_per_n"] = [-value for value in recording["frf_re_pc_per_n"]]
    odd["recordings"][0]["preload_n"] = 500
    for document in (hard, odd):
        (tmp_path / f"{document['name']}.json").write_bytes(orjson.dumps(document))
    files = [str(tmp_path / name) for name in ("hard.json", "odd.json")]
    done = server.place.command("import", *files, "--url", str(server.http.base_url))
    lines = done.stdout.splitlines()
    assert done.returncode == 0, done.stderr
    assert "6 recordings: no d33: preload_n: no preload is below 500 N: they look 1000 × too large" in lines[0]
    assert "6 recordings: d33 -13." in lines[1]
    assert "look at: d33 of the array is -13." in lines[2]
    assert "negative: is the sign of charge or force turned?" in lines[2]
    assert "left out: recording " in lines[3]
    assert "exceeds 0.1" in lines[3]


def test_wrong_usage_is_one_line(server: Server, tmp_path: Path) -> None:
    there = ["--url", str(server.http.base_url)]
    for arguments, says in (
        (["export", "palm", str(tmp_path / "none" / "palm.h5"), *there], "none does not exist"),
        (
            ["export", "palm", str(tmp_path / "palm.h5"), *there, "--key", "schlüssel"],
            "api_key = '…': must be of ASCII",
        ),
        (
            ["export", "palm", str(tmp_path / "palm.h5"), "--url", "lab:8000"],
            "url = 'lab:8000': must begin with http://",
        ),
        (["export", "palm", str(tmp_path / "palm.h5"), "--url", ""], "must begin with http://"),
        (["export", "palm", str(tmp_path / "palm.h5"), "--url", "http://a:b"], "url = 'http://a:b'"),
    ):
        done = server.place.command(*arguments)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert says in done.stderr

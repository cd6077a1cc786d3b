"""`underskin watch` as a bench runs it: real processes, killed and started again, a server that goes and comes back."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from tests.support import preloaded
from tests.support.bench import JOURNAL, SETTLE_S, Network, bench, network
from tests.support.cases import first
from tests.support.store_server import Place, Server, campaign, running


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests here, each with a skin of its own; it runs no diagnoses."""
    with running(Place(tmp_path_factory.mktemp("watched")), UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
        yield started


def names(server: Server, skin: str) -> list[str]:
    """The campaigns of a skin by name."""
    answer = server.http.get("/v1/campaigns", params={"skin": skin, "state": "all", "limit": 200})
    return sorted(entry["name"] for entry in answer.json()["campaigns"])


def address(server: Server) -> str:
    return str(server.http.base_url).rstrip("/")


def small(name: str) -> dict[str, Any]:
    return campaign(name, sensors=1, lines=5)


def test_what_is_saved_is_sent_once_complete_and_once_only(server: Server, tmp_path: Path) -> None:
    with bench(tmp_path, address(server), "once") as at:
        at.save("before.json", small("before"))
        at.start()
        at.wait_for("before.json: campaign c-")
        assert "watching" in at.told
        assert "skin once, which is new" in at.told
        content = orjson.dumps(small("slow"))
        with (at.folder / "slow.json").open("wb") as slow:  # as an instrument that writes bit by bit
            for start in range(0, len(content), 1 + len(content) // 8):
                slow.write(content[start : start + 1 + len(content) // 8])
                slow.flush()
                time.sleep(SETTLE_S / 2)
        at.wait_for("slow.json: campaign c-")
        at.save("day/later.json", small("later"))
        at.save(".hidden.json", small("hidden"))
        at.save("later.json.part", small("part"))
        at.wait_for(f"{Path('day', 'later.json')}: campaign c-")
        (at.folder / os.fsdecode(b"\xfcber Nacht.json")).write_bytes(orjson.dumps(small("named")))  # not in UTF-8
        at.wait_for("?ber Nacht.json: campaign c-")
        (at.folder / "slow.json").rename(at.folder / "renamed.json")
        at.wait_for("renamed.json: has the content of slow.json, and is not sent")
        assert at.end() == 0
        assert names(server, "once") == ["before", "later", "named", "slow"]
        at.start()
        at.save("last.json", small("last"))
        at.wait_for("last.json: campaign c-")
        assert at.end(signal.SIGINT) == 0
        assert names(server, "once") == ["before", "last", "later", "named", "slow"]
        assert at.told.count("before.json: campaign") == 1
        saved = {"before.json", "slow.json", "day/later.json", "last.json", os.fsdecode(b"\xfcber Nacht.json")}
        assert {entry["file"] for entry in at.journal()} == saved


def test_what_is_refused_is_told_once_and_sent_again_when_it_has_changed(server: Server, tmp_path: Path) -> None:
    with bench(tmp_path, address(server), "refused") as at:
        spoilt = small("spoilt")
        for recording in spoilt["recordings"]:
            recording["preload_n"] = -1
        at.save("spoilt.json", spoilt)
        (at.folder / "notes.txt").write_text("pressed the left hand first")
        at.start()
        at.wait_for("spoilt.json: 422")
        assert "preload_n = -1.0: must be finite and greater than 0 (N)" in at.told
        at.wait_for("notes.txt: 422")  # which no reader opens: after a further while
        at.end()
        at.start()
        at.save("good.json", small("good"))
        at.wait_for("good.json: campaign c-")
        assert (at.told.count("\nspoilt.json: "), at.told.count("\nnotes.txt: ")) == (1, 1)
        at.save("spoilt.json", small("spoilt"))
        at.wait_for("spoilt.json: campaign c-")
        assert names(server, "refused") == ["good", "spoilt"]


def test_rig_description_used_makes_sense_file(server: Server, tmp_path: Path) -> None:
    """A rig description is used and one that makes sense of a file has it sent again."""
    rig = tmp_path / "rig.yaml"
    described = Path("examples/campaigns/testing-machine.yaml").read_text()
    rig.write_text(described.replace("Stroke [mm]", "Depth [mm]"))
    with bench(tmp_path, address(server), "rig", "--rig", str(rig)) as at:
        (at.folder / "block.csv").write_bytes(Path("examples/campaigns/block.csv").read_bytes())
        at.start()
        at.wait_for("block.csv: 422")
        assert "it lacks Depth [mm]" in at.told
        rig.write_text(described)
        at.end()
        at.start()
        at.wait_for("block.csv: campaign c-")
        assert "E of block 16.04" in at.told
        at.end()
        rig.write_text(described + "# a remark\n")
        at.start()
        at.save("other.json", small("other"))
        at.wait_for("other.json: campaign c-")
        assert names(server, "rig") == ["block", "other"]


def test_a_kill_between_the_sending_and_the_journal_doubles_nothing(server: Server, tmp_path: Path) -> None:
    through = Network(address(server))
    with network(through) as url, bench(tmp_path, url, "killed") as at:
        at.save("first.json", small("first"))
        through.kill_at_answer.append(at.start())
        assert at.process is not None
        assert at.process.wait(240) == -signal.SIGKILL
        assert names(server, "killed") == ["first"]  # kept, and the watch never heard of it
        assert not (at.folder / JOURNAL).exists()
        at.start()
        at.wait_for("first.json: campaign c-")
        assert "of skin killed, was there, 2 recordings" in at.told
        assert names(server, "killed") == ["first"]
        assert [entry["file"] for entry in at.journal()] == ["first.json"]
        assert through.posts == 2


@pytest.mark.parametrize("status", first(1, [507, 401, 502, 503]))
def test_what_is_not_the_files_fault_is_tried_again(server: Server, tmp_path: Path, status: int) -> None:
    through = Network(address(server), status=status)
    with network(through) as url, bench(tmp_path, url, f"status-{status}") as at:
        at.save("first.json", small("first"))
        at.start()
        at.wait_for(f"{status} ")
        while through.posts < 3:  # after 1 s and 2 s
            time.sleep(0.05)
        assert at.told.count(f"{status} ") == 1
        assert not (at.folder / JOURNAL).exists()
        through.status = None
        at.wait_for("first.json: campaign c-")
        assert "sending goes on" in at.told
        assert names(server, at.skin) == ["first"]


@pytest.mark.slow
def test_kills_at_random_moments_lose_and_double_nothing(server: Server, tmp_path: Path) -> None:
    """Two files are saved for each watch that is killed: in the end there is each of them, once."""
    kills = 30 if os.environ.get("UNDERSKIN_SOAK") else 3
    moments = np.random.default_rng(900_013).uniform(SETTLE_S, SETTLE_S + 1.5, kills)
    with bench(tmp_path, address(server), "random") as at:
        for number, moment in enumerate(moments.tolist()):
            at.start()
            at.save(f"{number}-a.json", small(f"{number} a"))
            time.sleep(moment / 2)
            at.save(f"{number}-b.json", small(f"{number} b"))
            time.sleep(moment / 2)
            at.end(signal.SIGKILL)
        at.start()
        at.save("last.json", small("last"))
        at.wait_for("last.json: campaign c-")
        assert at.end() == 0
    assert names(server, "random") == sorted(["last", *(f"{number} {one}" for number in range(kills) for one in "ab")])


def test_a_server_that_goes_and_comes_back_gets_everything_once(tmp_path: Path) -> None:
    place = Place(tmp_path / "data")
    place.folder.mkdir()
    through = Network()
    with network(through) as url, bench(tmp_path, url, "outage") as at:
        at.save("early.json", small("early"))
        at.start()  # before the server
        at.wait_for("cannot be reached")
        with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
            through.server = address(started)
            at.wait_for("sending goes on")
            at.wait_for("early.json: campaign c-")
            started.kill()
        for number in range(3):
            at.save(f"night-{number}.json", small(f"night {number}"))
        at.wait_for("cannot be reached", 2)
        with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as again:
            through.server = address(again)
            at.wait_for("night-2.json: campaign c-")
            assert at.told.count("cannot be reached") == at.told.count("sending goes on") == 2  # once an outage
            assert names(again, "outage") == ["early", "night 0", "night 1", "night 2"]
            assert at.end() == 0


def test_one_process_watches_a_folder_and_what_cannot_be_used_is_said(server: Server, tmp_path: Path) -> None:
    with bench(tmp_path, address(server), "alone") as at:
        at.start()
        at.wait_for("watching")

        def refused(*words: str) -> str:
            done = preloaded.run("watch", *words, "--skin", "alone", "--url", at.url)
            assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1), done.stderr
            return done.stderr

        assert f"{at.folder} is watched by another process already" in refused(str(at.folder))
        at.end()
        assert "none is no folder" in refused(str(tmp_path / "none"))
        rig = tmp_path / "rig.yaml"
        rig.write_text("schema: rig/2")
        assert "rig/2" in refused(str(at.folder), "--rig", str(rig))
        (at.folder / JOURNAL).write_text("{")
        assert "cannot be read" in refused(str(at.folder))


def test_a_key_that_is_not_known_ends_it_at_the_start(tmp_path: Path) -> None:
    place = Place(tmp_path / "data")
    place.folder.mkdir()
    key = place.command("key", "create", "bench", "--scope", "write").stdout.strip()
    with running(place, key=key) as locked, bench(tmp_path, address(locked), "keyed") as at:
        assert at.start("--key", "us_wrong").wait(240) == 2
        assert "401 Unauthorized: This key is not known" in at.told
        at.save("first.json", small("first"))
        at.start("--key", key)
        at.wait_for("first.json: campaign c-")

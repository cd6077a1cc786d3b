"""A skin as one file: elsewhere it is as it was here, to the last digit."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import orjson
import pytest

from tests.service.conftest import emptied
from tests.service.ingest.test_store_files import CSV, RIG
from tests.support.cases import first
from tests.support.store_server import Server, campaign

BACKEND = "postgresql"


def fill(server: Server) -> None:
    """A skin with everything that can happen to it."""

    def send(name: str, skin: str, **query: str) -> str:
        document = campaign(name)
        document["recordings"].append({**document["recordings"][0], "id": "bad", "preload_n": -1})
        answer = server.http.post("/v1/campaigns", json=document, params={"skin": skin, **query})
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    first, second, third = (send(name, "palm") for name in ("first", "second", "third"))
    send("of another name", "palm-b")
    send("unrelated", "finger")
    send("right", "palm", corrects=second, reason="typing slip")
    compression = campaign("cylinder")
    compression["skin"] = {"poisson_ratio": 0.5}
    curve = {"displacement_mm": [0.0, 0.01, 0.03], "force_n": [0.0, 1.5, 4.0]}
    compression["recordings"] = [
        {"id": "c1", "kind": "compression", "sample_height_mm": 10.0, "sample_diameter_mm": 20.0, **curve}
    ]
    assert server.http.post("/v1/campaigns?skin=palm", json=compression).status_code == 201
    for path, body in (
        (f"/v1/campaigns/{first}/exclusions", {"recording": "s1-2N", "reason": "cable loose"}),
        (f"/v1/campaigns/{third}/withdraw", {"reason": "fell down"}),
        ("/v1/skins/palm/join", {"skin_id": "palm-b", "reason": "the label fell off"}),
    ):
        assert server.http.post(path, json=body).status_code == 200


def state(server: Server) -> dict[str, Any]:
    """All that can be asked of the skin."""
    entries = server.http.get("/v1/campaigns?skin=palm&state=all").json()["campaigns"]
    names = [entry["id"] for entry in entries]
    return {
        "list": entries,
        "skin": server.http.get("/v1/skins/palm-b").json(),
        "details": [server.http.get(f"/v1/campaigns/{name}").json() for name in names],
        "documents": [server.http.get(f"/v1/campaigns/{name}/document").json() for name in names],
        "d33": [server.http.get(f"/v1/campaigns/{name}/d33").json() for name in names],
        "history": server.http.get("/v1/skins/palm/history").json(),
    }


def exported(server: Server) -> bytes:
    answer = server.http.get("/v1/skins/palm-b/export")
    assert answer.status_code == 200, answer.text
    return answer.content


def sent(server: Server, file: bytes) -> Any:
    return server.http.post("/v1/skins/import", content=file, headers={"Content-Type": "application/x-hdf5"})


def test_a_skin_is_elsewhere_as_it_was_here(server: Server, elsewhere: Server) -> None:
    fill(server)
    file = exported(server)
    answer = sent(elsewhere, file)
    assert (answer.status_code, answer.json()) == (200, {"skin_id": "palm", "kept": 6, "present": 0})
    assert state(elsewhere) == state(server)
    assert [entry["id"] for entry in elsewhere.http.get("/v1/skins").json()["skins"]] == ["palm"]
    assert sent(elsewhere, exported(elsewhere)).json() == {"skin_id": "palm", "kept": 0, "present": 6}
    assert sent(server, file).json() == {"skin_id": "palm", "kept": 0, "present": 6}


def test_what_differs_here_refuses_the_whole_file(server: Server, elsewhere: Server) -> None:
    fill(server)
    sent(elsewhere, exported(server))
    current = elsewhere.http.get("/v1/campaigns?skin=palm").json()["campaigns"][0]["id"]
    elsewhere.http.post(f"/v1/campaigns/{current}/withdraw", json={"reason": "changed here"})
    server.http.post("/v1/campaigns?skin=palm", json=campaign("new"))
    before = state(elsewhere)
    answer = sent(elsewhere, exported(server))
    assert (answer.status_code, current in answer.json()["detail"]) == (409, True)
    assert state(elsewhere) == before


def test_a_skin_joined_through_another_is_elsewhere_as_it_was_here(server: Server, elsewhere: Server) -> None:
    for name in ("a", "b", "c"):  # by id, those that refer come first
        assert server.http.post("/v1/campaigns", json=campaign(name), params={"skin": name}).status_code == 201
    for skin, other in (("b", "a"), ("c", "b")):
        joined = server.http.post(f"/v1/skins/{skin}/join", json={"skin_id": other, "reason": "one skin"})
        assert joined.status_code == 200
    file = server.http.get("/v1/skins/a/export").content
    for _ in range(2):
        answer = sent(elsewhere, file)
        assert answer.status_code == 200, answer.text
        assert elsewhere.http.get("/v1/skins/a").json() == server.http.get("/v1/skins/a").json()


def test_the_same_file_many_times_at_once_is_kept_once(server: Server, elsewhere: Server) -> None:
    server.http.post("/v1/campaigns?skin=palm", json=[campaign("one"), campaign("two")])
    file = server.http.get("/v1/skins/palm/export").content
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(lambda _: sent(elsewhere, file), range(3)))
    assert [answer.status_code for answer in answers] == [200] * 3
    assert sum(answer.json()["kept"] for answer in answers) == 2


def _link_out(file: h5py.File) -> None:
    file["campaigns/outside"] = h5py.ExternalLink("/etc/passwd", "/")


def _drop_rows(file: h5py.File) -> None:
    del file["skins"]


def _spoil_array(file: h5py.File) -> None:
    name = list(file["campaigns"])[-2]
    file[f"campaigns/{name}/arrays/frf_re_pc_per_n"][0] = float("nan")


def _edited(place: str, **values: Any) -> Callable[[h5py.File], None]:
    """Changes an object, or the first of a list, in JSON text; `place` may name the last campaign."""

    def spoil(file: h5py.File) -> None:
        path = place.format(last=list(file["campaigns"])[-1])
        document = orjson.loads(file[path][()].tobytes())
        row = document[0] if isinstance(document, list) else document
        row.update({name: value(row[name]) if callable(value) else value for name, value in values.items()})
        del file[path]
        file[path] = np.frombuffer(orjson.dumps(document), np.uint8)

    return spoil


def _changed(**values: Any) -> Callable[[h5py.File], None]:
    """Puts one change in place of those of the file."""
    row = {"id": "ch-0123456789abcdef", "skin_id": "palm", "at": "2017-05-03T09:00:00.000000Z", "undoes": None}
    row |= dict.fromkeys(("campaign_id", "recording", "made_from", "reason")) | {"before": {}, "after": {}} | values

    def spoil(file: h5py.File) -> None:
        own = {**row, "campaign_id": row["campaign_id"] and row["campaign_id"].format(last=list(file["campaigns"])[-1])}
        del file["changes"]
        file["changes"] = np.frombuffer(orjson.dumps([own]), np.uint8)

    return spoil


def _rename_skin(file: h5py.File) -> None:
    file.attrs["skin"] = "nowhere"


def _rename_all(file: h5py.File) -> None:
    file.attrs["skin"] = ".."
    _edited("skins", id="..", root_id="..")(file)
    _edited("rigs", skin_id="..")(file)
    for name in file["campaigns"]:
        _edited(f"campaigns/{name}/about", skin_id="..")(file)


def _add_long_name(file: h5py.File) -> None:
    file["campaigns"].create_group("n" * 60_000)


ABOUT = "campaigns/{last}/about"
SPOILT: dict[str, Callable[[h5py.File], None]] = {
    "link out": _link_out,
    "no skins": _drop_rows,
    "array": _spoil_array,
    "skin": _rename_skin,
    "long name": _add_long_name,
    "physics": _edited(ABOUT, about=lambda about: {**about, "skin": {**about["skin"], "poisson_ratio": 7}}),
    "dots": _rename_all,
    "campaign of another skin": _changed(action="annotate", campaign_id="c-0123456789abcdef", before={"name": "x"}),
    "joined to itself": _edited("skins", joined_to="palm", joined_at="2017-05-03T09:00:00.000000Z", join_reason="?"),
    "rig no rig": _edited("rigs", document='{"schema": "rig/2"}'),
    "half withdrawn": _edited(ABOUT, withdraw_reason="fell down"),
    "campaign to another skin": _changed(action="annotate", campaign_id="{last}", before={"skin_id": "finger"}),
    "join of another skin": _changed(action="join", before={"skin_id": "finger", "members": ["finger"]}),
    "rig of another skin": _edited("rigs", skin_id="finger"),
    "another skin": _edited(ABOUT, skin_id="elsewhere"),
}


@pytest.fixture(scope="module")
def whole(servers: Callable[[str], Server]) -> bytes:
    """An export of more campaigns than are read at a time, with a rig."""
    server = emptied(servers("sqlite"))
    server.http.post("/v1/campaigns?skin=palm", json=[campaign(f"{number}", sensors=1, lines=3) for number in range(9)])
    form = [("rig", ("bench.yaml", RIG)), ("file", ("cut.csv", CSV))]
    assert server.http.post("/v1/campaigns?skin=palm", files=form).status_code == 201
    return server.http.get("/v1/skins/palm/export").content


def test_of_a_file_that_was_tampered_with_nothing_is_kept(whole: bytes, elsewhere: Server, tmp_path: Path) -> None:
    """Nor of what is no export."""
    file = tmp_path / "palm.h5"
    refused = {"empty": b"", "not HDF5": b"not HDF5", "a head alone": b"\x89HDF\r\n\x1a\n" + bytes(500)}
    for name, spoil in first(5, SPOILT.items()):
        file.write_bytes(whole)
        with h5py.File(file, "r+") as opened:
            spoil(opened)
        refused[name] = file.read_bytes()
    for name, content in refused.items():
        answer = sent(elsewhere, content)
        assert answer.status_code == 422, f"{name}: {answer.text}"
        assert elsewhere.http.get("/v1/campaigns?state=all").json()["campaigns"] == [], name
        assert elsewhere.http.get("/v1/skins").json()["skins"] == [], name

"""A skin as one file: elsewhere it is as it was here, to the last digit."""

from pathlib import Path
from typing import Any

import h5py
import pytest

from tests.store.server import Server, campaign


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


def _link_out(file: h5py.File) -> None:
    file["campaigns/outside"] = h5py.ExternalLink("/etc/passwd", "/")


def _drop_rows(file: h5py.File) -> None:
    del file["skins"]


def _spoil_array(file: h5py.File) -> None:
    name = next(iter(file["campaigns"]))
    file[f"campaigns/{name}/arrays/frf_re_pc_per_n"][0] = float("nan")


@pytest.mark.parametrize("spoil", [_link_out, _drop_rows, _spoil_array])
def test_a_file_that_was_tampered_with_is_refused(
    server: Server, elsewhere: Server, tmp_path: Path, spoil: Any
) -> None:
    server.http.post("/v1/campaigns?skin=palm", json=campaign("one"))
    file = tmp_path / "palm.h5"
    file.write_bytes(server.http.get("/v1/skins/palm/export").content)
    with h5py.File(file, "r+") as opened:
        spoil(opened)
    answer = sent(elsewhere, file.read_bytes())
    assert answer.status_code == 422, answer.text
    assert elsewhere.http.get("/v1/campaigns?state=all").json()["campaigns"] == []


@pytest.mark.parametrize("content", [b"", b"not HDF5", b"\x89HDF\r\n\x1a\n" + bytes(500)])
def test_what_is_no_export_is_refused(elsewhere: Server, content: bytes) -> None:
    assert sent(elsewhere, content).status_code == 422

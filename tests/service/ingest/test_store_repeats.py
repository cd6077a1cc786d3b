"""Recordings that come twice: told when they come, counted once in histories."""

from typing import Any

from tests.service.usecases.test_store_skins import history, points
from tests.support.store_server import Server, campaign

BACKEND = "postgresql"
Document = dict[str, Any]


def made(name: str, month: int = 1, **changes: Any) -> Document:
    document = campaign(name, **changes)
    for recording in document["recordings"]:
        recording["recorded_at"] = f"2017-{month:02}-03T09:00:00Z"
    return document


def renamed(document: Document, name: str, recordings: list[Document] | None = None, **changes: Any) -> Document:
    """The same measurements under other names, and with one more condition."""
    kept = document["recordings"] if recordings is None else recordings
    conditions = {"dwell_s": 30.0, **changes}
    return {
        **document,
        "name": name,
        "recordings": [{**one, **conditions, "id": f"{name} {one['id']}"} for one in kept],
    }


def post(server: Server, document: Document, **query: str) -> Document:
    answer = server.http.post("/v1/campaigns", json=document, params={"skin": "palm", **query})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def test_a_campaign_that_comes_twice_is_told_and_counts_once(server: Server) -> None:
    days = [made(f"day {month}", month, d33=14 - 0.1 * month) for month in range(1, 7)]
    first = [post(server, day) for day in days]
    assert [entry["notes"] for entry in first] == [[]] * 6
    before = history(server, "palm")
    again = [post(server, renamed(day, f"again {day['name']}")) for day in days]
    kept = server.http.get(f"/v1/campaigns/{first[0]['id']}").json()["received_at"][:10]
    assert again[0]["notes"][0] == (
        f"these recordings are in campaign day 1 of skin palm already (kept {kept}). That is {first[0]['id']}; "
        "in the history of a skin, identical recordings count once."
    )
    after = history(server, "palm")
    assert after["sensors"] == before["sensors"]
    assert before["sensors"][0]["trend"] is not None
    assert after["left_out_points"] == []
    assert after["left_out_campaigns"] == [
        {
            "campaign_id": twin["id"],
            "reason": f"its recordings count in campaign {entry['id']}: identical recordings count once",
            "repeats": entry["id"],
        }
        for entry, twin in zip(first, again, strict=True)
    ]
    page = server.http.get("/skins/palm", headers={"Accept": "text/html"}).text
    assert "Recordings that came twice" in page
    assert f"its recordings count in campaign {first[0]['id']}" in page
    csv = server.http.get("/skins/palm/history.csv").text
    assert (csv.count(first[0]["id"]), csv.count(again[0]["id"])) == (3, 0)


def test_a_twin_counts_once_the_other_is_withdrawn_or_corrected(server: Server) -> None:
    day = made("monday")
    first = post(server, day)["id"]
    twin = post(server, renamed(day, "again"))["id"]
    assert points(server, "palm") == [first]
    server.http.post(f"/v1/campaigns/{first}/withdraw", json={"reason": "sent twice"}).raise_for_status()
    assert points(server, "palm") == [twin]
    corrected = post(server, renamed(day, "right"), corrects=twin, reason="a slip in the name")
    assert corrected["notes"] == []
    assert points(server, "palm") == [corrected["id"]]


def test_of_two_points_that_share_a_recording_the_fuller_counts(server: Server) -> None:
    whole = made("whole")
    some = [one for one in whole["recordings"] if one["sensor"] == "s0"][:1]
    own = made("own", 2)["recordings"]
    part = post(server, renamed(whole, "part", some + [one for one in own if one["sensor"] != "s0"]))["id"]
    assert points(server, "palm") == [part]
    answer = post(server, whole)
    assert answer["notes"][0].startswith("1 of these 6 recordings is in campaign part of skin palm already")
    found = history(server, "palm")
    used = {entry["sensor"]: {point["campaign_id"] for point in entry["points"]} for entry in found["sensors"]}
    assert used == {"s0": {answer["id"]}, "s1": {answer["id"], part}, "s2": {answer["id"], part}}
    assert found["left_out_campaigns"] == []
    assert found["left_out_points"] == [
        {
            "campaign_id": part,
            "sensor": "s0",
            "repeats": answer["id"],
            "reason": f"its recordings count in campaign {answer['id']}: identical recordings count once",
        }
    ]
    page = server.http.get("/skins/palm", headers={"Accept": "text/html"}).text
    assert "sensor s0: its recordings count in campaign" in page


def test_recordings_typed_by_hand_without_a_time_are_all_kept(server: Server) -> None:
    day = campaign("typed", sensors=1, lines=5)
    typed = {"frf_re_pc_per_n": [7.0] * 5, "frf_im_pc_per_n": [0.0] * 5}
    base = {name: value for name, value in day["recordings"][0].items() if name not in ("recorded_at", "coherence")}
    places: list[Document] = [{}, {}, {"position_mm": [1.0, 0.0]}]
    documents = [
        {**day, "recordings": [{**base, **typed, **place, "id": f"r{number}"}]} for number, place in enumerate(places)
    ]
    answer = server.http.post("/v1/campaigns?together=typed&skin=palm", json=documents)
    assert answer.status_code == 201, answer.text
    (kept,) = answer.json()["campaigns"]
    assert [entry["id"] for entry in kept["recordings"]] == ["r0", "r1", "r2"]
    assert not [note for note in kept["notes"] if "count once" in note]
    again = post(
        server, {**day, "recordings": [{**base, **typed, "id": "typed"}, *campaign("noisy", sensors=1)["recordings"]]}
    )
    assert again["notes"] == []
    third = post(
        server,
        {**day, "recordings": [{**base, **typed, "id": "typed"}, *campaign("noisy", sensors=1)["recordings"][1:]]},
    )
    assert third["notes"][0].startswith("1 of these 2 recordings is in campaign typed of skin palm already")


def test_an_excluded_recording_keeps_no_other_from_counting(server: Server) -> None:
    day = made("monday")
    first = post(server, day)["id"]
    for recording in ("s0-1N", "s0-2N"):
        exclusion = {"recording": recording, "reason": "cable"}
        server.http.post(f"/v1/campaigns/{first}/exclusions", json=exclusion).raise_for_status()
    again = [one for one in day["recordings"] if one["sensor"] == "s0"]
    twin = post(server, renamed(day, "again", again))["id"]
    used = {entry["sensor"]: entry["points"][0]["campaign_id"] for entry in history(server, "palm")["sensors"]}
    assert used == {"s0": twin, "s1": first, "s2": first}


def test_a_copy_is_known_at_another_time_and_on_another_skin_but_not_with_other_numbers(server: Server) -> None:
    day = made("monday")
    first = post(server, day)["id"]
    post(server, renamed(day, "later", recorded_at="2018-01-03T09:00:00Z"))
    assert points(server, "palm") == [first]
    other = post(server, renamed(day, "other"), skin="finger")
    assert "in campaign monday of skin palm already" in other["notes"][0]
    assert points(server, "finger") == [other["id"]]
    server.http.post("/v1/skins/palm/join", json={"skin_id": "finger", "reason": "one skin"}).raise_for_status()
    assert points(server, "palm") == [first]
    for recording in day["recordings"]:
        recording["frf_re_pc_per_n"][0] += 1e-9
    changed = post(server, day)
    assert changed["notes"] == []
    assert points(server, "palm") == [first, changed["id"]]


def test_an_imported_skin_counts_them_once_too(server: Server, elsewhere: Server) -> None:
    day = made("monday")
    first = post(server, day)["id"]
    post(server, renamed(day, "again"))
    exported = server.http.get("/v1/skins/palm/export").content
    elsewhere.http.post("/v1/skins/import", content=exported).raise_for_status()
    assert points(elsewhere, "palm") == [first]
    assert history(elsewhere, "palm") == history(server, "palm")

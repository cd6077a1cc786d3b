"""Campaigns over HTTP: kept whole, listed, withdrawn, corrected, and answered the same when sent again."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

from tests.support.store_server import Server, campaign

BACKEND = "postgresql"


def post(server: Server, document: Any, **query: str) -> dict[str, Any]:
    answer = server.http.post("/v1/campaigns", json=document, params=query)
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def listed(server: Server, **query: str | int) -> list[dict[str, Any]]:
    answer = server.http.get("/v1/campaigns", params=query)
    assert answer.status_code == 200, answer.text
    return list(answer.json()["campaigns"])


def test_what_was_sent_comes_back_to_the_last_digit(server: Server) -> None:
    sent = campaign("first")
    answer = post(server, sent, skin="palm")
    assert answer["skin_id"] == "palm"
    assert [entry["status"] for entry in answer["recordings"]] == ["ok"] * 6
    document = server.http.get(f"/v1/campaigns/{answer['id']}/document").json()
    sent["skin"]["d33_pc_per_n"] = None
    assert document == sent


def test_bad_recordings_are_named_and_the_good_ones_kept(server: Server) -> None:
    document = campaign("mixed")
    document["recordings"][0]["preload_n"] = -1
    document["recordings"][1]["frf_re_pc_per_n"][3] = None
    document["recordings"][2]["colour"] = "red"
    answer = post(server, document)
    refused = {entry["id"]: entry["errors"][0] for entry in answer["recordings"] if entry["status"] == "refused"}
    assert {name: error["field"] for name, error in refused.items()} == {
        "s0-1N": "preload_n",
        "s0-2N": "frf_re_pc_per_n[3]",
        "s1-1N": "colour",
    }
    assert refused["s0-1N"]["value"] == -1
    detail = server.http.get(f"/v1/campaigns/{answer['id']}").json()
    assert [entry["id"] for entry in detail["entries"]] == ["s1-2N", "s2-1N", "s2-2N"]
    assert {entry["id"] for entry in detail["refused"]} == set(refused)


def test_all_or_nothing_keeps_nothing_of_a_spoilt_batch(server: Server) -> None:
    spoilt = campaign("spoilt")
    spoilt["recordings"][4]["dynamic_force_n"] = 0
    answer = server.http.post("/v1/campaigns?all_or_nothing=true", json=[campaign("good"), spoilt])
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "recordings[s2-1N].dynamic_force_n"
    assert listed(server, state="all") == []


def test_a_form_of_many_files_is_answered_file_by_file(server: Server) -> None:
    import orjson

    files = [
        ("file", ("../../etc/passwd", orjson.dumps(campaign("one")))),
        ("file", ("two.json", b'{"schema": "campaign/1", ')),
        ("file", ("three.json", orjson.dumps([campaign("three"), campaign("four")]))),
    ]
    answer = server.http.post("/v1/campaigns", files=files)
    assert answer.status_code == 201
    results = answer.json()["campaigns"]
    assert [(entry["file"], entry["status"]) for entry in results] == [
        ("../../etc/passwd", "ok"),
        ("two.json", "refused"),
        ("three.json", "ok"),
        ("three.json", "ok"),
    ]
    assert "line 1" in results[1]["errors"][0]["allowed"]
    assert {entry["name"] for entry in listed(server)} == {"one", "three", "four"}


def test_the_same_key_gets_the_same_answer_and_keeps_once(server: Server) -> None:
    headers = {"Idempotency-Key": "run-7"}
    first, second = (server.http.post("/v1/campaigns", json=campaign("run"), headers=headers) for _ in range(2))
    assert first.status_code == 201
    assert (second.status_code, second.json()) == (201, first.json())
    other = server.http.post("/v1/campaigns", json=campaign("other"), headers=headers)
    assert (other.status_code, "run-7" in other.json()["detail"]) == (422, True)
    elsewhere = server.http.post("/v1/campaigns?skin=b", json=campaign("run"), headers=headers)
    assert elsewhere.status_code == 422
    assert len(listed(server, state="all")) == 1


def test_the_same_key_many_times_at_once_keeps_once(server: Server) -> None:
    def send(_: int) -> dict[str, Any]:
        answer = server.http.post("/v1/campaigns", json=campaign("at once"), headers={"Idempotency-Key": "k"})
        assert answer.status_code == 201, answer.text
        return dict(answer.json())

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(send, range(8)))
    assert all(answer == answers[0] for answer in answers)
    assert len(listed(server, state="all")) == 1


def test_a_refused_request_does_not_use_up_its_key(server: Server) -> None:
    headers = {"Idempotency-Key": "again"}
    assert server.http.post("/v1/campaigns", json={"schema": "campaign/2"}, headers=headers).status_code == 422
    assert server.http.post("/v1/campaigns", json=campaign("again"), headers=headers).status_code == 201


def test_lists_are_paged_and_filtered(server: Server) -> None:
    for number in range(7):
        late = campaign(f"run {number}")
        for recording in late["recordings"]:
            recording["recorded_at"] = f"2017-05-0{number + 1}T09:00:00+02:00"
        post(server, late, skin="even" if number % 2 == 0 else "odd")
    names, cursor = [], None
    while True:
        page = server.http.get("/v1/campaigns", params={"limit": 3, **({"cursor": cursor} if cursor else {})}).json()
        names += [entry["name"] for entry in page["campaigns"]]
        cursor = page["next"]
        if cursor is None:
            break
        assert len(page["campaigns"]) == 3
    assert names == [f"run {number}" for number in reversed(range(7))]
    assert {entry["name"] for entry in listed(server, skin="odd")} == {"run 1", "run 3", "run 5"}
    assert [entry["name"] for entry in listed(server, name_contains="RUN 4")] == ["run 4"]
    between = listed(server, recorded_from="2017-05-03T07:00:00Z", recorded_to="2017-05-05T07:00:00Z")
    assert [entry["name"] for entry in between] == ["run 3", "run 2"]
    assert server.http.get("/v1/campaigns?cursor=x").status_code == 422
    assert server.http.get("/v1/campaigns?recorded_from=yesterday").status_code == 422


def test_letters_beyond_ascii_are_found_in_either_case(server: Server) -> None:
    post(server, campaign("Übung Eins"), skin="Äußere Haut")
    for text in ("Übung", "übung", "ÜBUNG EINS"):
        assert [entry["name"] for entry in listed(server, name_contains=text)] == ["Übung Eins"], text
    for text in ("Äuß", "äußere"):
        found = server.http.get("/v1/skins", params={"id_contains": text}).json()["skins"]
        assert [entry["id"] for entry in found] == ["Äußere Haut"], text
    assert listed(server, name_contains="ubung") == []


def test_a_withdrawn_campaign_stays_and_says_why(server: Server) -> None:
    name = post(server, campaign("wrong sphere"))["id"]
    answer = server.http.post(f"/v1/campaigns/{name}/withdraw", json={"reason": "the sphere was the other one"})
    assert (answer.status_code, answer.json()["state"]) == (200, "withdrawn")
    assert listed(server) == []
    assert [entry["withdraw_reason"] for entry in listed(server, state="withdrawn")] == ["the sphere was the other one"]
    assert server.http.get(f"/v1/campaigns/{name}/document").json()["name"] == "wrong sphere"
    assert server.http.post(f"/v1/campaigns/{name}/withdraw", json={"reason": "again"}).status_code == 409
    assert server.http.post("/v1/campaigns/c-0/withdraw", json={"reason": "?"}).status_code == 404
    assert server.http.post(f"/v1/campaigns/{name}/withdraw", json={"reason": " "}).status_code == 422


def test_a_correction_replaces_and_the_original_stays(server: Server) -> None:
    original = post(server, campaign("thin"), skin="palm")["id"]
    right = campaign("thick", thickness_mm=2.6)
    corrected = post(server, right, corrects=original, reason="thickness was read wrong")
    assert corrected["skin_id"] == "palm"
    assert [entry["id"] for entry in listed(server, skin="palm")] == [corrected["id"]]
    before, after = (server.http.get(f"/v1/campaigns/{name}").json() for name in (original, corrected["id"]))
    assert (before["state"], before["corrected_by"], before["skin"]["thickness_mm"]) == (
        "corrected",
        corrected["id"],
        2.5,
    )
    assert (after["corrects"], after["correct_reason"]) == (original, "thickness was read wrong")
    query = {"corrects": original, "reason": "once more"}
    again = server.http.post("/v1/campaigns", json=campaign("late"), params=query)
    assert (again.status_code, corrected["id"] in again.json()["detail"]) == (409, True)
    assert server.http.post("/v1/campaigns", json=right, params={"corrects": corrected["id"]}).status_code == 422


def test_a_correction_stays_on_its_skin_whatever_its_file_says(server: Server) -> None:
    wrong = post(server, campaign("monday"), skin="palm")["id"]
    right = campaign("monday again", id="finger")
    corrected = post(server, right, corrects=wrong, reason="cable")
    (note,) = corrected["notes"]
    assert "'finger'" in note
    assert "kept on skin 'palm'" in note
    assert corrected["skin_id"] == "palm"
    assert server.http.get(f"/v1/campaigns/{corrected['id']}").json()["notes"] == [note]
    moved = post(server, right, corrects=corrected["id"], reason="of the finger after all", skin="finger")
    assert (moved["skin_id"], moved["notes"]) == ("finger", [])
    server.http.post("/v1/skins/palm/join", json={"skin_id": "finger", "reason": "one skin"}).raise_for_status()
    same = post(server, campaign("last", id="palm"), corrects=moved["id"], reason="cable")
    assert (same["skin_id"], same["notes"]) == ("finger", [])


def test_two_corrections_at_once_leave_one_current(server: Server) -> None:
    original = post(server, campaign("first"), skin="palm")["id"]
    query = {"corrects": original, "reason": "both noticed"}

    def correct(number: int) -> int:
        return server.http.post("/v1/campaigns", json=campaign(f"v{number}"), params=query).status_code

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(correct, range(4))) == [201, 409, 409, 409]
    assert len(listed(server, skin="palm")) == 1


def test_odd_texts_are_refused_and_break_nothing(server: Server) -> None:
    name = post(server, campaign("x"), skin="a")["id"]
    for path in ("campaigns/%00", "campaigns/%F0%9F%90%9F/d33", "skins/%00", "skins/%00/history", "skins/.%2e/export"):
        assert server.http.get(f"/v1/{path}").status_code in (404, 422), path
    for query in ("skin=%00", "name_contains=%00%25", "cursor=-1", "cursor=9" + 30 * "9", "state=gone", "limit=0"):
        assert server.http.get(f"/v1/campaigns?{query}").status_code in (200, 422), query
    for limit, allowed in ((0, "must be at least 1"), (201, "must be at most 200")):
        assert server.http.get(f"/v1/campaigns?limit={limit}").json()["errors"][0]["allowed"] == allowed
    for band in ("inf", "nan", "1e308", "-1"):
        answer = server.http.get(f"/v1/campaigns/{name}/d33?band_low_hz=1&band_high_hz={band}")
        assert answer.status_code in (200, 422), band
    as_json = {"Content-Type": "application/json"}
    for half in (b'{"reason": "\\ud800"}', b'{"\\udfff": 1, "reason": "?"}'):  # halves of a pair
        answer = server.http.post(f"/v1/campaigns/{name}/withdraw", content=half, headers=as_json)
        assert (answer.status_code, answer.headers["content-type"]) == (400, "application/problem+json")
    for text in ("\x00", "\U0001f600", "x" * 1001):
        body = {"recording": text, "reason": text}
        assert server.http.post(f"/v1/campaigns/{name}/exclusions", json=body).status_code in (404, 422)
    assert (
        server.http.post("/v1/campaigns", json=campaign("y"), headers={"Idempotency-Key": "k" * 256}).status_code == 422
    )
    assert len(listed(server)) == 1

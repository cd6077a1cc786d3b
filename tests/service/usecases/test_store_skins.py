"""Skins: joined, and every figure over time with what it leaves out."""

from typing import Any

import pytest

from tests.support.store_server import Server, campaign

BACKEND = "postgresql"


def post(server: Server, skin: str, name: str, d33: float = 14.0, year: int = 2017) -> str:
    document = campaign(name, d33=d33)
    for recording in document["recordings"]:
        recording["recorded_at"] = f"{year}-05-03T09:00:00Z"
    answer = server.http.post("/v1/campaigns", json=document, params={"skin": skin})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def history(server: Server, skin: str) -> dict[str, Any]:
    answer = server.http.get(f"/v1/skins/{skin}/history")
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def points(server: Server, skin: str) -> list[str]:
    """Campaigns that the history of the first sensor uses."""
    return [point["campaign_id"] for point in history(server, skin)["sensors"][0]["points"]]


def test_skins_are_paged_and_found(server: Server) -> None:
    for number in range(5):
        post(server, f"palm-{number}", "x")
    first = server.http.get("/v1/skins?limit=3").json()
    second = server.http.get("/v1/skins", params={"limit": 3, "cursor": first["next"]}).json()
    assert [entry["id"] for entry in first["skins"] + second["skins"]] == [f"palm-{number}" for number in range(5)]
    assert second["next"] is None
    assert [entry["id"] for entry in server.http.get("/v1/skins?id_contains=M-3").json()["skins"]] == ["palm-3"]
    assert server.http.get("/v1/skins/none").status_code == 404


def test_joined_skins_are_one_and_keep_their_names(server: Server) -> None:
    a, b, c = (post(server, skin, skin, year=year) for skin, year in (("a", 2017), ("b", 2018), ("c", 2019)))
    join = {"skin_id": "b", "reason": "the label fell off"}
    assert server.http.post("/v1/skins/a/join", json=join).status_code == 200
    assert server.http.post("/v1/skins/c/join", json={"skin_id": "a", "reason": "again"}).status_code == 200
    for name in ("a", "b", "c"):
        assert points(server, name) == [a, b, c]
        detail = server.http.get(f"/v1/skins/{name}").json()
        assert (detail["id"], [entry["id"] for entry in detail["joined"]]) == ("c", ["a", "b"])
    assert [(entry["id"], entry["campaigns"]) for entry in server.http.get("/v1/skins").json()["skins"]] == [("c", 3)]
    assert server.http.get(f"/v1/campaigns/{b}").json()["skin_id"] == "b"
    assert len(server.http.get("/v1/campaigns?skin=b").json()["campaigns"]) == 3
    d = post(server, "b", "late", year=2020)
    assert points(server, "c") == [a, b, c, d]


@pytest.mark.parametrize(("skin", "other", "status"), [("a", "a", 422), ("a", "none", 404), ("none", "a", 404)])
def test_what_cannot_be_joined_is_refused(server: Server, skin: str, other: str, status: int) -> None:
    post(server, "a", "a")
    assert server.http.post(f"/v1/skins/{skin}/join", json={"skin_id": other, "reason": "?"}).status_code == status


def test_a_joined_skin_is_not_joined_again(server: Server) -> None:
    for name in ("a", "b", "c"):
        post(server, name, name)
    assert server.http.post("/v1/skins/a/join", json={"skin_id": "b", "reason": "same"}).status_code == 200
    answer = server.http.post("/v1/skins/c/join", json={"skin_id": "b", "reason": "no"})
    assert (answer.status_code, "'a'" in answer.json()["detail"]) == (409, True)


def test_a_sensor_that_ages_shows_and_the_others_do_not(server: Server) -> None:
    for year in range(2017, 2023):
        document = campaign(f"{year}")
        for recording in document["recordings"]:
            recording["recorded_at"] = f"{year}-05-03T09:00:00Z"
            if recording["sensor"] == "s1":
                factor = 1 - 0.08 * (year - 2017)
                recording["frf_re_pc_per_n"] = [factor * value for value in recording["frf_re_pc_per_n"]]
        assert server.http.post("/v1/campaigns?skin=palm", json=document).status_code == 201
    sensors = {entry["sensor"]: entry for entry in history(server, "palm")["sensors"]}
    assert {name: entry["trend"]["significant"] for name, entry in sensors.items()} == {
        "s0": False,
        "s1": True,
        "s2": False,
    }
    aged = sensors["s1"]
    assert aged["no_trend"] is None
    first = aged["points"][0]["d33_pc_per_n"]
    assert aged["trend"]["slope_pc_per_n_per_year"] == pytest.approx(-0.08 * first, rel=0.1)


@pytest.mark.parametrize(
    ("times", "why"),
    [
        (("2017-05-03T09:00:00", "2017-06-03T09:00:00"), "needs 3 campaigns, and there are 2"),
        (("2017-05-03T09:00:00", "2017-06-03T09:00:00", None), "1 of 3 points are timed by arrival"),
        (("2017-05-03T09:00:00", "2017-05-03T12:00:00", "2017-05-04T08:59:00"), "less than a day"),
    ],
)
def test_no_trend_is_told_from_times_that_tell_none(server: Server, times: tuple[str | None, ...], why: str) -> None:
    for number, time in enumerate(times):
        document = campaign(f"{number}")
        for recording in document["recordings"]:
            recording.pop("recorded_at", None)
            recording |= {} if time is None else {"recorded_at": time}
        assert server.http.post("/v1/campaigns?skin=palm", json=document).status_code == 201
    for sensor in history(server, "palm")["sensors"]:
        assert sensor["trend"] is None
        assert why in sensor["no_trend"]


def test_figures_say_what_they_leave_out(server: Server) -> None:
    kept, gone, wrong = (post(server, "palm", name) for name in ("kept", "gone", "wrong"))
    before = server.http.get(f"/v1/campaigns/{kept}/d33").json()
    assert before["left_out"] == []
    server.http.post(f"/v1/campaigns/{gone}/withdraw", json={"reason": "fell down"})
    query = {"corrects": wrong, "reason": "typing slip"}
    right = server.http.post("/v1/campaigns", json=campaign("right"), params=query).json()["id"]
    exclusion = {"recording": "s1-2N", "reason": "cable loose"}
    detail = server.http.post(f"/v1/campaigns/{kept}/exclusions", json=exclusion).json()
    assert detail["excluded"] == 1
    found = history(server, "palm")
    assert {point["campaign_id"] for entry in found["sensors"] for point in entry["points"]} == {kept, right}
    assert {entry["campaign_id"]: entry["reason"] for entry in found["left_out_campaigns"]} == {
        gone: "withdrawn: fell down",
        wrong: f"corrected by {right}",
    }
    assert found["left_out_recordings"] == [{"campaign_id": kept, "recording": "s1-2N", "reason": "cable loose"}]
    after = server.http.get(f"/v1/campaigns/{kept}/d33").json()
    assert [entry["recording"] for entry in after["left_out"]] == ["s1-2N"]
    assert len(server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"]) == 6
    again = server.http.post(f"/v1/campaigns/{kept}/exclusions", json=exclusion)
    assert again.status_code == 409
    absent = server.http.post(f"/v1/campaigns/{kept}/exclusions", json={"recording": "r9", "reason": "?"})
    assert absent.status_code == 404


def test_an_array_that_ages_is_told_before_its_sensors(server: Server) -> None:
    """All sensors fall by 3 % from date to date, which no sensor alone tells; the page and the command say it."""
    for number in range(4):
        document = campaign(f"{number}", sensors=6)
        for recording in document["recordings"]:
            recording["recorded_at"] = f"2017-0{1 + 2 * number}-03T09:00:00Z"
            recording["frf_re_pc_per_n"] = [0.97**number * value for value in recording["frf_re_pc_per_n"]]
        assert server.http.post("/v1/campaigns?skin=palm", json=document).status_code == 201
    found = history(server, "palm")["array"]
    assert found["significant"]
    assert found["change_low_percent"] < 100 * (0.97**3 - 1) < found["change_high_percent"]
    assert found["days"] == 181
    assert found["statement"].startswith("d33 of the array fell by ")
    assert "d33 of the array fell by " in server.http.get("/skins/palm").text
    assert not any(entry["departure"]["significant"] for entry in history(server, "palm")["sensors"])

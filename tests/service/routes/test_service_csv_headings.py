"""Headings of CSV columns over HTTP are those of the CSV template; what is wrong is told at once."""

import json
from typing import Any

import httpx
import pytest

from tests.service.routes.test_service_columns import SKIN


def sent(http: httpx.Client, path: str, columns: dict[str, Any]) -> httpx.Response:
    """The answer to one row."""
    body = ",".join(columns) + "\n" + ",".join(map(str, columns.values())) + "\n"
    return http.post(path, content=body, headers={"Content-Type": "text/csv"})


def errors(answer: httpx.Response) -> list[dict[str, Any]]:
    assert answer.status_code == 422, answer.text
    found: list[dict[str, Any]] = answer.json()["errors"]
    return found


def test_a_misspelt_field_is_guessed_in_csv_and_json(http: httpx.Client) -> None:
    columns = {**SKIN, "prelaod_n": 1, "frf_pc_per_n": 7}
    for answer, value in ((sent(http, "/v1/d33", columns), "1"), (http.post("/v1/d33", json=columns), 1)):
        _, misspelt = errors(answer)
        assert (misspelt["field"], misspelt["value"]) == ("prelaod_n", value)
        assert misspelt["allowed"] == "is not a field of this request; did you mean preload_n?"


@pytest.mark.parametrize("phase", ["frf_phase_deg", "Phase [deg]"])
def test_magnitude_and_phase_are_the_real_part(http: httpx.Client, phase: str) -> None:
    polar = sent(http, "/v1/d33", {**SKIN, "preload_n": 1, "frf_magnitude_pc_per_n": 14, phase: 60})
    real = http.post("/v1/d33", json={**SKIN, "preload_n": 1, "frf_pc_per_n": [7.0]})
    assert polar.json()["d33_pc_per_n"] == pytest.approx(real.json()["d33_pc_per_n"], rel=1e-12)
    alone = sent(http, "/v1/d33", {**SKIN, "preload_n": 1, "frf_magnitude_pc_per_n": 14})
    assert alone.status_code == 400
    assert "needs frf_phase_deg or frf_phase_rad with it" in alone.json()["detail"]
    assert [one["field"] for one in errors(sent(http, "/v1/frf", {**SKIN, "preload_n": 1, phase: 60}))] == [
        "d33_pc_per_n",
        phase,
    ]


def test_what_was_read_otherwise_than_its_heading_says_is_told(http: httpx.Client) -> None:
    """In a header of the answer, since columns have no room for it."""
    columns = {**SKIN, "preload_n": 1, "d33_pc_per_n": 14}
    plain = sent(http, "/v1/frf", columns)
    assert "Underskin-Notes" not in plain.headers
    radius = columns.pop("indenter_radius_mm")
    halved = sent(http, "/v1/frf", {**columns, "Indenter diameter [mm]": 2 * radius})
    assert halved.json() == plain.json()
    assert json.loads(halved.headers["Underskin-Notes"]) == ["'Indenter diameter [mm]' is halved"]
    body = "a_over_h,rt_over_h\n0.3,0.6\n\n" + "".join(f"µ {number}\n" for number in range(14))
    notes = json.loads(
        http.post("/v1/sigma", content=body, headers={"Content-Type": "text/csv"}).headers["Underskin-Notes"]
    )
    assert "µ 0" in notes[0]
    assert (len(notes), notes[-1]) == (11, "and 4 more")

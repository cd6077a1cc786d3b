"""FRF over HTTP: the library's numbers in lab units, spectra, and rows outside the table."""

import csv
import io
from typing import Any

import httpx
import numpy as np
import pytest

from underskin import Indenter, Skin, load_table, transmission
from underskin.units import to_lab, to_si

TABLE = load_table()
GENERATOR = np.random.default_rng(15)
PROTOTYPE: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4,
    "preload_n": 1,
    "d33_pc_per_n": 14,
}


def posted(http: httpx.Client, **columns: Any) -> dict[str, Any]:
    reply = http.post("/v1/frf", json=PROTOTYPE | columns)
    assert reply.status_code == 200, reply.text
    answer: dict[str, Any] = reply.json()
    return answer


def test_the_prototype_by_hand(http: httpx.Client) -> None:
    answer = posted(http)
    a = (0.75 * 1 * 4e-3 * 0.75 / 16e6) ** (1 / 3)
    sigma = float(TABLE.sigma(a / 2.5e-3, 0.6, 1 / 256).sigma)
    expected = {
        "contact_radius_mm": 1e3 * a,
        "a_over_h": a / 2.5e-3,
        "rt_over_h": 0.6,
        "load_parameter": 1 / 256,
        "sigma": sigma,
        "mean_stress_mpa": 1e-6 * 3 * sigma / (2 * np.pi * 2.5e-3**2),
        "frf_pc_per_n": 14 * 1.5 * 0.36 * sigma,
    }
    for name, value in expected.items():
        assert answer[name] == pytest.approx([value], rel=1e-12), name
    assert (answer["model"], answer["table_sha256"], answer["status"]) == ("paper", TABLE.sha256, ["ok"])


def test_columns_are_the_librarys(http: httpx.Client) -> None:
    columns: dict[str, Any] = {
        "thickness_mm": GENERATOR.uniform(1, 5, 200),
        "youngs_modulus_mpa": GENERATOR.uniform(1, 30, 200),
        "sensor_radius_mm": GENERATOR.uniform(0.5, 4, 200),
        "indenter_radius_mm": GENERATOR.uniform(2, 12, 200),
        "preload_n": GENERATOR.uniform(0.1, 20, 200),
        "d33_pc_per_n": GENERATOR.uniform(-40, 40, 200),
    }
    answer = posted(http, **{name: values.tolist() for name, values in columns.items()})
    skin = Skin.from_lab(**{name: columns[name] for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm")})
    indenter = Indenter.from_lab(indenter_radius_mm=columns["indenter_radius_mm"])
    reached = transmission(TABLE, skin, indenter, columns["preload_n"])
    assert 20 < reached.inside.sum() < 200
    assert [status == "ok" for status in answer["status"]] == reached.inside.tolist()
    expected = {
        "contact_radius_mm": to_lab("contact_radius_mm", reached.contact_radius),
        "sigma": reached.sigma,
        "rel_error": reached.rel_error,
        "mean_stress_mpa": to_lab("mean_stress_mpa", reached.mean_stress),
        "frf_pc_per_n": to_lab("frf_pc_per_n", reached.frf(to_si("d33_pc_per_n", columns["d33_pc_per_n"]))),
    }
    for name, values in expected.items():
        assert np.array(answer[name], dtype=float) == pytest.approx(values, rel=1e-13, nan_ok=True), name


def test_rows_outside_keep_what_does_not_depend_on_the_table(http: httpx.Client) -> None:
    """ν = 0.49 and too high a load: the contact is still told, σ and what follows is null."""
    answer = posted(http, preload_n=[1, 1, 300], poisson_ratio=[0.5, 0.49, 0.5])
    assert answer["status"] == ["ok", "out_of_domain", "out_of_domain"]
    for name in ("sigma", "rel_error", "mean_stress_mpa", "frf_pc_per_n"):
        assert answer[name][1:] == [None, None]
        assert answer[name][0] == posted(http)[name][0]
    a = np.cbrt(0.75 * 4e-3 * np.array([1, 1, 300]) * (1 - np.array([0.5, 0.49, 0.5]) ** 2) / 16e6)
    assert answer["contact_radius_mm"] == pytest.approx(1e3 * a, rel=1e-13)
    assert answer["load_parameter"] == pytest.approx([1 / 256, 1 / 256, 300 / 256], rel=1e-13)


def test_spectra_are_flat_and_real(http: httpx.Client) -> None:
    answer = posted(http, preload_n=[1, 300, 3], frequency_hz=[0, 10.5, 130])
    assert answer["frequency_hz"] == [0, 10.5, 130]
    first, _, last = answer["frf_pc_per_n"]
    assert answer["frf_re_pc_per_n"] == [[first] * 3, [None] * 3, [last] * 3]
    assert answer["frf_im_pc_per_n"] == [[0.0] * 3, [None] * 3, [0.0] * 3]
    assert "frf_re_pc_per_n" not in posted(http)


def test_spectra_in_csv_have_a_column_a_frequency(http: httpx.Client) -> None:
    body = PROTOTYPE | {"preload_n": [1, 300], "frequency_hz": [10.5, 130]}
    reply = http.post("/v1/frf", json=body, headers={"Accept": "text/csv"})
    assert reply.headers["underskin-model"] == "paper"
    assert reply.headers["underskin-table-sha256"] == TABLE.sha256
    first, second = csv.DictReader(io.StringIO(reply.text, newline=""))
    for part in ("re", "im"):
        for frequency in ("10.5", "130.0"):
            name = f"frf_{part}_pc_per_n[{frequency} Hz]"
            assert float(first[name]) == (float(first["frf_pc_per_n"]) if part == "re" else 0)
            assert second[name] == "NaN"
    assert (first["status"], second["status"]) == ("ok", "out_of_domain")


def test_spectra_have_a_limit_that_is_told(http: httpx.Client) -> None:
    body = PROTOTYPE | {"preload_n": [1.0] * 1001, "frequency_hz": list(range(1000))}
    reply = http.post("/v1/frf", json=body)
    assert reply.status_code == 422
    (error,) = reply.json()["errors"]
    assert error["field"] == "frequency_hz"
    assert "at most 1000000" in error["allowed"]


def test_unusual_magnitudes_pass_once_they_are_confirmed(http: httpx.Client) -> None:
    """A skin a thousand times as large in all lengths, and as stiff, answers the same."""
    large = {name: 1e3 * PROTOTYPE[name] for name in ("thickness_mm", "sensor_radius_mm", "indenter_radius_mm")}
    refused = http.post("/v1/frf", json=PROTOTYPE | large | {"preload_n": 1e6})
    assert refused.status_code == 422
    answer = posted(http, **large, preload_n=1e6, units_checked=True)
    assert answer["frf_pc_per_n"] == pytest.approx(posted(http)["frf_pc_per_n"], rel=1e-12)


def test_what_overflows_is_outside_and_spoils_no_other(http: httpx.Client) -> None:
    answer = posted(http, preload_n=[1, 1e308], indenter_radius_mm=[4, 1e308], units_checked=True)
    assert answer["status"] == ["ok", "out_of_domain"]
    assert answer["frf_pc_per_n"] == [posted(http)["frf_pc_per_n"][0], None]

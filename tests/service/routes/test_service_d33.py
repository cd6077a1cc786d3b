"""d33 over HTTP: what /v1/frf predicts comes back; uncertainties; lines with a band to average over."""

from typing import Any

import httpx
import numpy as np
import pytest

from underskin import load_table

TABLE = load_table()
GENERATOR = np.random.default_rng(22)
SKIN: dict[str, Any] = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4}
FREQUENCY = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0]


def posted(http: httpx.Client, route: str = "/v1/d33", **columns: Any) -> dict[str, Any]:
    reply = http.post(route, json=SKIN | columns)
    assert reply.status_code == 200, reply.text
    answer: dict[str, Any] = reply.json()
    return answer


def refused(http: httpx.Client, **columns: Any) -> tuple[str, str]:
    reply = http.post("/v1/d33", json=SKIN | {"preload_n": 1} | columns)
    assert reply.status_code == 422, reply.text
    (error,) = reply.json()["errors"]
    return error["field"], error["allowed"]


def test_known_frf_values_mean_known_d33(http: httpx.Client) -> None:
    """FRF = d33 (3/2) ρ² σ, worked out here from the table."""
    a = np.cbrt(0.75 * np.array([1, 3]) * 4e-3 * 0.75 / 16e6) / 2.5e-3
    sigma = TABLE.sigma(a, 0.6, np.array([1, 3]) / 256).sigma
    frf = np.array([14, 22]) * 1.5 * 0.36 * sigma
    answer = posted(http, preload_n=[1, 3], frf_pc_per_n=frf.tolist())
    assert answer["d33_pc_per_n"] == pytest.approx([14, 22], rel=1e-12)
    assert answer["frf_pc_per_n"] == frf.tolist()


def test_any_frf_comes_back(http: httpx.Client) -> None:
    skin = {
        "thickness_mm": GENERATOR.uniform(1, 5, 300),
        "youngs_modulus_mpa": GENERATOR.uniform(5, 30, 300),
        "sensor_radius_mm": GENERATOR.uniform(0.5, 3, 300),
        "indenter_radius_mm": GENERATOR.uniform(2, 12, 300),
        "preload_n": GENERATOR.uniform(0.1, 3, 300),
    }
    columns = {name: values.tolist() for name, values in skin.items()}
    d33 = GENERATOR.choice([-1, 1], 300) * GENERATOR.uniform(1, 50, 300)
    predicted = posted(http, "/v1/frf", **columns, d33_pc_per_n=d33.tolist())
    inside = np.array(predicted["status"]) == "ok"
    assert inside.sum() > 200
    frf = [0.0 if value is None else value for value in predicted["frf_pc_per_n"]]
    answer = posted(http, **columns, frf_pc_per_n=frf)
    assert answer["status"] == predicted["status"]
    assert np.array(answer["d33_pc_per_n"], float)[inside] == pytest.approx(d33[inside], rel=1e-13)
    for name in ("sigma", "rel_error", "mean_stress_mpa", "contact_radius_mm", "a_over_h", "rt_over_h"):
        assert answer[name] == predicted[name]


def test_uncertainties_add_in_quadrature(http: httpx.Client) -> None:
    answer = posted(http, preload_n=1, frf_pc_per_n=[7.4, -7.4, 0.0], frf_uncertainty_pc_per_n=[0.1, 0.1, 0.1])
    seen = 1.5 * 0.36 * answer["sigma"][0]
    of_frf, of_table = 0.1 / seen, 7.4 / seen * answer["rel_error"][0]
    expected = [np.hypot(of_frf, of_table), np.hypot(of_frf, of_table), of_frf]
    assert answer["d33_uncertainty_pc_per_n"] == pytest.approx(expected, rel=1e-13)
    assert answer["d33_pc_per_n"] == pytest.approx([7.4 / seen, -7.4 / seen, 0], rel=1e-13)


def test_without_an_uncertainty_d33s_is_unknown(http: httpx.Client) -> None:
    answer = posted(http, preload_n=1, frf_pc_per_n=7.4)
    assert answer["frf_uncertainty_pc_per_n"] == answer["d33_uncertainty_pc_per_n"] == [None]
    assert answer["status"] == ["ok"]
    exact = posted(http, preload_n=1, frf_pc_per_n=7.4, frf_uncertainty_pc_per_n=0)
    expected = exact["d33_pc_per_n"][0] * exact["rel_error"][0]
    assert exact["d33_uncertainty_pc_per_n"] == pytest.approx([expected], rel=1e-13)


@pytest.mark.parametrize(
    ("frf", "index", "said"), [([7.4, 7.4e-12], 1, "C/N"), ([0.0, 7.4], 0, "dead sensor"), (740000.0, None, "fC/N")]
)
def test_what_looks_wrong_is_used_and_said(http: httpx.Client, frf: Any, index: int | None, said: str) -> None:
    answer = posted(http, preload_n=1, frf_pc_per_n=frf)
    assert set(answer["status"]) == {"ok"}
    (finding,) = answer["findings"]
    assert (finding["field"], finding["index"]) == ("frf_pc_per_n", index)
    assert said in finding["statement"]
    assert posted(http, preload_n=1, frf_pc_per_n=7.4)["findings"] == []


@pytest.mark.parametrize(
    ("frf", "index", "said"),
    [
        (7400.0, None, "1.4e+04 pC/N, more than sensors have: was mV/pC meant"),
        ([7.4, 7.4e-3, 7.4e-3], 1, "0.014 pC/N, less than sensors have: was mV/nC meant"),
        ([-7.4], 0, "-14 pC/N, negative: is the sign of charge or force turned"),
    ],
)
def test_d33_no_sensor_answered_said(http: httpx.Client, frf: Any, index: int | None, said: str) -> None:
    """A d33 that no sensor has is answered and said."""
    answer = posted(http, preload_n=1, frf_pc_per_n=frf)
    assert set(answer["status"]) == {"ok"}
    (finding,) = answer["findings"]
    assert (finding["field"], finding["index"]) == ("d33_pc_per_n", index)
    assert said in finding["statement"]
    assert ("(1 more rows like it)" in finding["statement"]) == (index == 1)


def test_rows_outside_are_null_and_spoil_no_other(http: httpx.Client) -> None:
    frf: dict[str, Any] = {"frf_pc_per_n": [7.4, 7.4, 7.4], "frf_uncertainty_pc_per_n": 0.1}
    answer = posted(http, preload_n=[1, 300, 1], poisson_ratio=[0.5, 0.5, 0.45], **frf)
    assert answer["status"] == ["ok", "out_of_domain", "out_of_domain"]
    alone = posted(http, preload_n=1, frf_pc_per_n=7.4, frf_uncertainty_pc_per_n=0.1)
    for name in ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "sigma", "mean_stress_mpa"):
        assert answer[name] == [alone[name][0], None, None]
    assert answer["frf_pc_per_n"] == [7.4, 7.4, 7.4]


def test_lines_are_averaged_over_the_band(http: httpx.Client) -> None:
    """Limits of the band included; the standard error of the mean is the plateau's uncertainty."""
    real = 7.4 + 0.2 * GENERATOR.normal(size=(3, 6))
    imaginary = 0.7 + 0.2 * GENERATOR.normal(size=(3, 6))
    lines: dict[str, Any] = {"frequency_hz": FREQUENCY, "band_hz": [10, 80], "frf_re_pc_per_n": real.tolist()}
    answer = posted(http, preload_n=[1, 2, 3], **lines, frf_im_pc_per_n=imaginary.tolist())
    chosen = real[:, 1:5]
    assert answer["frf_pc_per_n"] == pytest.approx(chosen.mean(axis=1), rel=1e-14)
    assert answer["frf_uncertainty_pc_per_n"] == pytest.approx(chosen.std(axis=1, ddof=1) / 2, rel=1e-13)
    assert answer["frf_im_pc_per_n"] == pytest.approx(imaginary[:, 1:5].mean(axis=1), rel=1e-14)
    plateau = {name: answer[name] for name in ("frf_pc_per_n", "frf_uncertainty_pc_per_n")}
    same = posted(http, preload_n=[1, 2, 3], **plateau)
    for name in ("d33_pc_per_n", "d33_uncertainty_pc_per_n"):
        assert answer[name] == pytest.approx(same[name], rel=1e-14)


def test_a_spectrum_from_frf_comes_back(http: httpx.Client) -> None:
    predicted = posted(http, "/v1/frf", preload_n=[1, 3], d33_pc_per_n=[14, -22], frequency_hz=FREQUENCY)
    lines = {name: predicted[name] for name in ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n")}
    answer = posted(http, preload_n=[1, 3], **lines, band_hz=[1, 130])
    assert answer["d33_pc_per_n"] == pytest.approx([14, -22], rel=1e-13)
    assert answer["frf_im_pc_per_n"] == [0.0, 0.0]


LINES = {"frequency_hz": FREQUENCY, "frf_re_pc_per_n": [[7.0] * 6], "band_hz": [5, 50]}


@pytest.mark.parametrize(
    ("columns", "field", "allowed"),
    [
        ({}, "frequency_hz", "is required where frf_pc_per_n is not given"),
        ({**LINES, "band_hz": None}, "band_hz", "is required"),
        ({**LINES, "frf_re_pc_per_n": None}, "frf_re_pc_per_n", "is required"),
        ({**LINES, "frf_pc_per_n": 7.0}, "band_hz", "goes with lines"),
        ({**LINES, "band_hz": [200, 300]}, "band_hz", "must hold at least one entry of frequency_hz"),
        ({**LINES, "band_hz": [50, 5]}, "band_hz", "must hold at least one entry of frequency_hz"),
        ({**LINES, "band_hz": [20, 20]}, "frf_uncertainty_pc_per_n", "one line, which has no scatter"),
        ({**LINES, "frf_re_pc_per_n": [[7.0] * 5]}, "frf_re_pc_per_n", "as many lines as frequency_hz (6)"),
        ({**LINES, "frf_im_pc_per_n": [[7.0] * 7]}, "frf_im_pc_per_n", "as many lines as frequency_hz (6)"),
        ({**LINES, "frf_re_pc_per_n": [[7.0] * 6] * 2, "preload_n": [1, 1, 1]}, "frf_re_pc_per_n", "as many rows as"),
        ({"frf_pc_per_n": 7.0, "frf_uncertainty_pc_per_n": -0.1}, "frf_uncertainty_pc_per_n", "at least 0"),
    ],
)
def test_lines_that_cannot_be_used_are_refused(
    http: httpx.Client, columns: dict[str, Any], field: str, allowed: str
) -> None:
    found_field, found_allowed = refused(http, **columns)
    assert found_field == field
    assert allowed in found_allowed

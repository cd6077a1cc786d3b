"""Columns as NumPy's .npz: the same answers as in JSON, and nothing but arrays of numbers and texts is read."""

import io
import struct
import zipfile
from collections.abc import Callable, Mapping
from typing import Any

import httpx
import numpy as np
import pytest

from tests.service.requests import D33, FRF, SIGMA, problem_of
from underskin import load_table

TABLE = load_table()
GENERATOR = np.random.default_rng(85)
NPZ = "application/x-npz"
LINES: dict[str, Any] = {
    **{name: D33[name] for name in D33 if name != "frf_pc_per_n"},
    "frequency_hz": [10, 20, 300],
    "band_hz": [1, 100],
    "frf_re_pc_per_n": [[7, 7.1, 99], [8e-6, 8.1e-6, 99]],
    "frf_im_pc_per_n": [[0.7, 0.6, 9], [0.1, 0.2, 9]],
}


def archive(arrays: Mapping[str, Any], save: Callable[..., None] = np.savez) -> bytes:
    """Arrays by name, as NumPy writes them."""
    file = io.BytesIO()
    save(file, **arrays)
    return file.getvalue()


def zipped(members: list[tuple[str, bytes]], compression: int = zipfile.ZIP_STORED) -> bytes:
    """Files in an archive, by name."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as opened:
        for name, content in members:
            opened.writestr(name, content)
    return file.getvalue()


def npy(array: Any, **options: Any) -> bytes:
    """An array in NumPy's own format."""
    file = io.BytesIO()
    np.save(file, array, **options)
    return file.getvalue()


def claiming(shape: str, data: bytes = b"") -> bytes:
    """An array whose header claims a shape."""
    file = io.BytesIO()
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data)
    return file.getvalue()


def post(http: httpx.Client, path: str, body: bytes, accept: str = "application/json") -> httpx.Response:
    return http.post(path, content=body, headers={"Content-Type": NPZ, "Accept": accept})


def answered(http: httpx.Client, path: str, fields: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The arrays of an answer to arrays, and the JSON of one to JSON."""
    reply = post(http, path, archive(fields), NPZ)
    assert reply.status_code == 200, reply.text
    assert reply.headers["content-type"] == NPZ
    with np.load(io.BytesIO(reply.content), allow_pickle=False) as arrays:
        return dict(arrays), http.post(path, json=fields).json()


@pytest.mark.parametrize(
    ("path", "fields"),
    [
        ("/v1/sigma", SIGMA),
        ("/v1/sigma", {"a_over_h": [0.3, 4.0], "rt_over_h": 0.6, "load_parameter": 0.01}),
        ("/v1/sigma", {"a_over_h": 1, "rt_over_h": [1, 2], "model": "half_space"}),
        ("/v1/frf", {**FRF, "preload_n": [1.0, 300.0], "frequency_hz": [10, 20, 30]}),
        ("/v1/frf", {**FRF, "thickness_mm": 0.005, "units_checked": True}),
        ("/v1/d33", {**D33, "frf_uncertainty_pc_per_n": 0.1}),
        ("/v1/d33", LINES),
    ],
)
def test_arrays_are_answered_as_json_is(http: httpx.Client, path: str, fields: dict[str, Any]) -> None:
    arrays, expected = answered(http, path, fields)
    assert list(arrays) == [name for name, value in expected.items() if value is not None]
    for name, array in arrays.items():
        if array.dtype.kind == "f":
            assert np.array_equal(array, np.array(expected[name], float), equal_nan=True), name
        elif name == "findings":
            assert httpx.Response(200, content=str(array)).json() == expected[name]
        elif name == "limit":
            assert [words or None for words in array.tolist()] == expected[name]
        else:
            assert array.tolist() == expected[name], name


@pytest.mark.parametrize(
    "body",
    [
        archive({"a_over_h": [0.5, 1.0], "rt_over_h": 0.5}, np.savez_compressed),
        archive({"a_over_h": np.array([0.5, 1.0], ">f4"), "rt_over_h": np.float16(0.5)}),
        archive({"a_over_h": np.array([0.5, 1.0], np.longdouble), "rt_over_h": [0.5, 0.5], "model": "layer"}),
        zipped([("a_over_h", npy(np.array([0.5, 1.0]))), ("rt_over_h.npy", npy(0.5))], zipfile.ZIP_DEFLATED),
    ],
)
def test_whatever_holds_the_same_numbers_is_read_alike(http: httpx.Client, body: bytes) -> None:
    expected = http.post("/v1/sigma", json={"a_over_h": [0.5, 1.0], "rt_over_h": 0.5}).json()
    assert post(http, "/v1/sigma", body).json() == expected


def test_any_answer_in_columns_comes_as_arrays(http: httpx.Client) -> None:
    accept = {"Accept": NPZ}
    one = http.get("/v1/sigma?a_over_h=0.3&rt_over_h=0.6", headers=accept)
    with np.load(io.BytesIO(one.content)) as arrays:
        assert arrays["sigma"] == pytest.approx([0.936505], abs=1e-6)
        assert (arrays["table_sha256"], arrays["status"].tolist()) == (TABLE.sha256, ["ok"])
    skin = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14}
    sensors = [{"id": "s01", "x_mm": 0, "y_mm": 0}, {"id": "s02", "x_mm": 90, "y_mm": 0}]
    contact = {"x_mm": 2, "y_mm": 1, "indenter_radius_mm": 4, "normal_force_n": 1}
    array = http.post("/v1/stress", json={**skin, "sensors": sensors, "contacts": [contact]}, headers=accept)
    with np.load(io.BytesIO(array.content)) as arrays:
        assert arrays["sensor"].tolist() == ["s01", "s02"]
        assert arrays["status"].tolist() == ["ok", "out_of_domain"]
        assert np.isnan(arrays["charge_pc"]).tolist() == [False, True]


@pytest.mark.parametrize(
    ("accept", "form"),
    [
        (NPZ, NPZ),
        (f"{NPZ}, text/csv;q=0.5, */*;q=0.1", NPZ),
        (f"text/csv, {NPZ};q=0.5", "text/csv; charset=utf-8"),
        (f"application/json, {NPZ};q=0.9", "application/json"),
        ("application/*", "application/json"),
    ],
)
def test_the_preferred_form_is_sent(http: httpx.Client, accept: str, form: str) -> None:
    for reply in (
        http.post("/v1/sigma", json=SIGMA, headers={"Accept": accept}),
        http.get("/v1/sigma?a_over_h=0.3&rt_over_h=0.6", headers={"Accept": accept}),
    ):
        assert reply.headers["content-type"] == form


PLAIN = {"a_over_h": [0.3, 0.6], "rt_over_h": 0.6}
OBJECTS = np.array([0.3, None], dtype=object)
STRUCTURED = np.zeros(2, [("x", float)])


@pytest.mark.parametrize(
    ("path", "arrays", "field", "said"),
    [
        ("/v1/sigma", {"a_over_h": ["0.3", "0.6"]}, "a_over_h", "must be an array of floats or integers"),
        ("/v1/sigma", {"a_over_h": [True, False]}, "a_over_h", "must be an array of floats"),
        ("/v1/sigma", {"a_over_h": STRUCTURED}, "a_over_h", "must be an array of floats"),
        ("/v1/sigma", {"a_over_h": OBJECTS}, "a_over_h", "it holds Python objects (pickles)"),
        ("/v1/sigma", {"a_over_h": [[0.3, 0.6]]}, "a_over_h", "must be a column, of shape (rows,)"),
        ("/v1/sigma", {"a_over_h": []}, "a_over_h", "must not be empty"),
        ("/v1/sigma", {"a_over_h": [0.3, np.nan]}, "a_over_h", "must be finite"),
        ("/v1/sigma", {"rt_over_h": [0.6, 0.6, 0.6]}, "rt_over_h", "must have as many rows as a_over_h (2)"),
        ("/v1/sigma", {"model": ["layer", "layer"]}, "model", "must be a single text or boolean, of shape ()"),
        ("/v1/sigma", {"model": np.array(0xD800FFFF, "<u4").view("<U1")}, "model", "must be a text in Unicode"),
        ("/v1/sigma", {"load": 0.1}, "load", "is not a field of this request"),
        ("/v1/frf", {**FRF, "units_checked": "yes"}, "units_checked", "must be true or false"),
        ("/v1/frf", {**FRF, "offset_x_mm": [0.0, 0.1]}, "offset_x_mm", "is used only with model adopted"),
        ("/v1/d33", {**LINES, "frf_re_pc_per_n": [7.0, 7.1]}, "frf_re_pc_per_n", "should be a valid list"),
    ],
)
def test_an_array_that_cannot_be_used_is_named(
    http: httpx.Client, path: str, arrays: dict[str, Any], field: str, said: str
) -> None:
    fields = {**PLAIN, **arrays} if path == "/v1/sigma" else arrays
    problem = problem_of(post(http, path, archive(fields)), 422)
    (error,) = problem["errors"]
    assert error["field"] == field
    assert said in error["allowed"]
    assert field in problem["detail"]


GOOD = npy(np.array([0.3, 0.6]))


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ([("a_over_h.npy", GOOD), ("a_over_h.npy", GOOD)], "is given twice"),
        ([("a_over_h.npy", GOOD), ("a_over_h", GOOD)], "is given twice"),
        ([("a_over_h.npy", b"")], "NumPy's .npy format"),
        ([("a_over_h.npy", GOOD[:-1])], "NumPy's .npy format"),
        ([("a_over_h.npy", GOOD + b"\0")], "it has 17 bytes, and its header says 16"),
        ([("a_over_h.npy", GOOD.replace(b"\x01\x00", b"\x09\x00", 1))], "NumPy's .npy format"),
        ([("a_over_h.npy", claiming("(1000000000000,)"))], "NumPy's .npy format"),
        ([("a_over_h.npy", claiming("(0, 1000000000000)"))], "must be a column"),
        ([("a_over_h.npy", npy(OBJECTS, allow_pickle=True))], "it holds Python objects (pickles)"),
    ],
)
def test_a_damaged_array_is_named(http: httpx.Client, members: list[tuple[str, bytes]], said: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warnings.warn", lambda *_, **__: None)  # zipfile's, of a name that comes twice
        body = zipped([("rt_over_h.npy", npy(0.6)), *members])
    (error,) = problem_of(post(http, "/v1/sigma", body), 422)["errors"]
    assert error["field"] == "a_over_h"
    assert said in error["allowed"]


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_only_numpys_own_compression_is_read(http: httpx.Client, compression: int) -> None:
    (error,) = problem_of(post(http, "/v1/sigma", zipped([("a_over_h.npy", GOOD)], compression)), 422)["errors"]
    assert "it is neither stored nor deflated" in error["allowed"]


@pytest.mark.parametrize("body", [b"", b"PK", b"a_over_h,rt_over_h\n0.3,0.6\n", archive(PLAIN)[:-30], GOOD])
def test_what_is_no_archive_is_said(http: httpx.Client, body: bytes) -> None:
    assert "The body is not an .npz file" in problem_of(post(http, "/v1/sigma", body), 400)["detail"]


def test_a_header_that_no_parser_bears_is_refused(http: httpx.Client) -> None:
    buffer = io.BytesIO()
    header = b"-" * 9000 + b"1"
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("a_over_h.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
    (error,) = problem_of(post(http, "/v1/sigma", buffer.getvalue()), 422)["errors"]
    assert error["field"] == "a_over_h"


def test_a_long_directory_is_refused_unread(http: httpx.Client) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for number in range(5000):
            file.writestr(f"{number}.npy", b"")
    assert "directory" in problem_of(post(http, "/v1/sigma", buffer.getvalue()), 400)["detail"]
    with zipfile.ZipFile(buffer, "a") as file:
        file.comment = bytes(40)  # behind which the directory's length would not be seen
    assert "does not end as" in problem_of(post(http, "/v1/sigma", buffer.getvalue()), 400)["detail"]


LARGE = {"a_over_h": np.zeros(10_000_000), "rt_over_h": 0.6}


def test_an_archive_that_expands_beyond_the_limit_is_refused_unread(http: httpx.Client) -> None:
    body = archive(LARGE, np.savez_compressed)
    assert len(body) < 100_000
    problem = problem_of(post(http, "/v1/sigma", body), 413)
    assert "80 MB, which exceeds 64 MB (UNDERSKIN_MAX_BODY_MB)" in problem["detail"]


@pytest.mark.parametrize("declared", [144, 100_000])
def test_an_archive_that_lies_about_its_size_is_refused(http: httpx.Client, declared: int) -> None:
    honest = archive(LARGE, np.savez_compressed)
    lying = honest.replace(struct.pack("<I", 80_000_128), struct.pack("<I", declared))
    assert lying != honest
    (error,) = problem_of(post(http, "/v1/sigma", lying), 422)["errors"]
    assert error["field"] == "a_over_h"


def test_whatever_is_damaged_is_refused_and_never_a_failure(http: httpx.Client) -> None:
    whole = archive({**PLAIN, "model": "layer"}, np.savez_compressed)
    statuses = set()
    for _ in range(400):
        body = bytearray(whole)
        for place in GENERATOR.integers(len(body), size=GENERATOR.integers(1, 4)):
            body[place] = GENERATOR.integers(256)
        statuses.add(post(http, "/v1/sigma", bytes(body), NPZ).status_code)
    assert statuses <= {200, 400, 413, 422}

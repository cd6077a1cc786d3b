"""The client against a running service: the same numbers as the library, and errors that say what to do."""

import http.server
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import underskin
from tests.support import preloaded
from tests.support.server import running
from underskin import Client, Indenter, ServiceError, Skin, Unreachable
from underskin.units import to_lab, to_si

SKIN: dict[str, Any] = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5}
PRESSED: dict[str, Any] = {**SKIN, "indenter_radius_mm": 4.0}
TABLE = underskin.load_table()


@pytest.fixture(scope="module", params=[False, True], ids=["json", "npz"])
def client(server_url: str, request: pytest.FixtureRequest) -> Iterator[Client]:
    with Client(server_url, npz=request.param) as opened:
        yield opened


def test_sigma_is_the_tables(client: Client) -> None:
    a, load = np.linspace(0, 3, 7), np.linspace(0, 0.1, 7)
    answer = client.sigma(a, 0.6, load)
    expected = TABLE.sigma(a, 0.6, load)
    assert answer.sigma == pytest.approx(expected.sigma, rel=1e-15)
    assert answer.rel_error == pytest.approx(expected.rel_error, rel=1e-15)
    assert answer.status.tolist() == ["ok"] * 7
    assert (answer.model, answer.table_sha256) == ("layer", TABLE.sha256)


def test_rows_outside_the_table_are_nan_and_spoil_no_other(client: Client) -> None:
    answer = client.frf(**PRESSED, preload_n=[1.0, 300.0], d33_pc_per_n=14.0)
    assert answer.status.tolist() == ["ok", "out_of_domain"]
    assert answer.limit.tolist() == ["", "L = 1.17 exceeds 0.1: at most 25.6 N"]
    assert np.isnan(answer.frf_pc_per_n).tolist() == np.isnan(answer.sigma).tolist() == [False, True]
    assert np.isfinite(answer.contact_radius_mm).all()


def test_frf_is_the_librarys(client: Client) -> None:
    preload = np.array([0.5, 1.0, 3.0])
    answer = client.frf(**PRESSED, preload_n=preload, d33_pc_per_n=14.0)
    reached = underskin.transmission(TABLE, Skin.from_lab(**SKIN), Indenter.from_lab(indenter_radius_mm=4.0), preload)
    frf = to_lab("frf_pc_per_n", reached.frf(to_si("d33_pc_per_n", 14.0)))
    assert answer.frf_pc_per_n == pytest.approx(frf, rel=1e-14)
    assert answer.mean_stress_mpa == pytest.approx(reached.mean_stress * 1e-6, rel=1e-14)
    assert answer.frequency_hz is None


def test_spectra_have_an_axis_for_the_frequencies(client: Client) -> None:
    answer = client.frf(**PRESSED, preload_n=[1.0, 3.0], d33_pc_per_n=14.0, frequency_hz=[10, 20, 30])
    assert answer.frf_re_pc_per_n is not None
    assert answer.frf_re_pc_per_n == pytest.approx(np.repeat(answer.frf_pc_per_n[:, None], 3, axis=1))
    assert answer.frequency_hz == pytest.approx([10, 20, 30])


def test_d33_takes_back_what_frf_gave(client: Client) -> None:
    preload, d33 = np.array([1.0, 3.0]), np.array([14.0, -22.0])
    frf = client.frf(**PRESSED, preload_n=preload, d33_pc_per_n=d33).frf_pc_per_n
    answer = client.d33(**PRESSED, preload_n=preload, frf_pc_per_n=frf, frf_uncertainty_pc_per_n=np.abs(frf) / 100)
    assert answer.d33_pc_per_n == pytest.approx(d33, rel=1e-12)
    assert answer.d33_uncertainty_pc_per_n == pytest.approx([0.14, 0.22], rel=1e-4)


def test_d33_from_lines_averages_the_band(client: Client) -> None:
    lines: dict[str, Any] = {"frequency_hz": [10, 20, 300], "band_hz": (1, 130)}
    one = client.d33(**PRESSED, preload_n=1.0, frf_re_pc_per_n=[7.0, 7.2, 9.0], **lines)
    assert float(one.frf_pc_per_n) == pytest.approx(7.1)
    two = client.d33(
        **PRESSED,
        preload_n=1.0,
        frf_re_pc_per_n=[[7.0, 7.2, 9.0], [6.0, 6.2, 9.0]],
        frf_im_pc_per_n=np.ones((2, 3)),
        **lines,
    )
    assert two.frf_pc_per_n == pytest.approx([7.1, 6.1])
    assert two.frf_im_pc_per_n == pytest.approx([1, 1])


def test_a_column_of_100_000_rows(client: Client) -> None:
    preload = np.random.default_rng(5).uniform(0.5, 3, 200_000)[::2]  # a view with gaps, as lab arrays often are
    answer = client.frf(**PRESSED, preload_n=preload, d33_pc_per_n=14.0)
    assert answer.frf_pc_per_n.shape == preload.shape
    assert answer.frf_pc_per_n[[0, -1]] == pytest.approx(
        client.frf(**PRESSED, preload_n=preload[[0, -1]], d33_pc_per_n=14.0).frf_pc_per_n, rel=1e-15
    )


@pytest.mark.parametrize(
    ("wrong", "field", "index"),
    [
        ({"preload_n": [1.0, -1.0]}, "preload_n", 1),
        ({"preload_n": [1.0, np.nan]}, "preload_n", 1),
        ({"thickness_mm": 0.0025}, "thickness_mm", None),
        ({"thickness_mm": [1.0, 2.0], "preload_n": [1.0, 2.0, 3.0]}, "preload_n", None),
    ],
)
def test_refusal_carries_the_problem(client: Client, wrong: dict[str, Any], field: str, index: int | None) -> None:
    with pytest.raises(ServiceError) as refusal:
        client.frf(**{**PRESSED, "preload_n": 1.0, "d33_pc_per_n": 14.0, **wrong})
    assert refusal.value.status == 422
    (error,) = refusal.value.problem["errors"]
    assert (error["field"], error["index"]) == (field, index)
    assert field in str(refusal.value)


def test_slip_of_units_can_be_meant(client: Client) -> None:
    answer = client.frf(
        **{**PRESSED, "indenter_radius_mm": 0.007}, preload_n=1e-6, d33_pc_per_n=14.0, units_checked=True
    )
    assert answer.status == "ok"


def test_key_is_sent_and_a_wrong_one_is_refused(tmp_path: Path) -> None:
    made = preloaded.run("key", "create", "lab", environment=os.environ | {"UNDERSKIN_DATA": str(tmp_path / "data")})
    with running(tmp_path, {}, "--host", "0.0.0.0") as keyed:
        with Client(keyed.url, api_key=made.stdout.strip()) as client:
            assert client.sigma(0.3, 0.6).status == "ok"
        with Client(keyed.url, api_key="wrong") as client, pytest.raises(ServiceError) as refusal:
            client.sigma(0.3, 0.6)
        assert refusal.value.status == 401


def test_nobody_there() -> None:
    with Client("http://127.0.0.1:1") as client, pytest.raises(Unreachable, match=r"127\.0\.0\.1:1.*refused"):
        client.health()


@pytest.fixture
def foreign_server() -> Iterator[str]:
    """A web server that is not underskin."""

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200 if self.path == "/health" else 502)
            self.end_headers()
            self.wfile.write(b"<html>somebody else</html>")

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Page) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_somebody_else_there(foreign_server: str) -> None:
    with Client(foreign_server) as client:
        for ask, status in ((client.health, 200), (client.ready, 502)):
            with pytest.raises(ServiceError, match=r"not an answer of underskin.*somebody else") as refusal:
                ask()
            assert refusal.value.status == status

"""Many files that each unfold to a lot: what one request brings in all is limited, and nothing is kept half."""

import io
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np
import pytest

from tests.support.memory import family_mb
from tests.support.store_server import Place, Server, campaign, running
from underskin.recordings.readers import hdf5_file

UNFOLDED_BYTES = 16_000_000  # of each file: what one of a few kB may have
MOST_MB = 100  # of those of one request
FITTING = MOST_MB * 1_000_000 // UNFOLDED_BYTES
MANY = 40
MOST_MEMORY_MB = 3 * MOST_MB  # more than before


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    limits = {"UNDERSKIN_MAX_UPLOAD_MB": "20", "UNDERSKIN_READING_MEMORY_MB": str(MOST_MB)}
    with running(Place(tmp_path_factory.mktemp("unfolding") / "data"), **limits) as server:
        yield server


@pytest.fixture(scope="module")
def zeros() -> bytes:
    """A campaign of one time series of zeros, compressed."""
    document = campaign("zeros", sensors=1)
    about: dict[str, Any] = {name: document["recordings"][0][name] for name in ("id", "sensor", "indenter_radius_mm")}
    values = np.zeros(UNFOLDED_BYTES // 8 // 2)
    series = {
        "sample_rate_hz": 1000.0,
        "preload_n": 1.0,
        "dynamic_force_n": 0.09,
        "force_n": values,
        "charge_pc": values,
    }
    plain, packed = io.BytesIO(), io.BytesIO()
    hdf5_file.write_document({**document, "recordings": None}, [{**about, **series}], plain)
    with h5py.File(plain) as source, h5py.File(packed, "w") as target:
        copy(source, target)
    assert len(packed.getvalue()) < 100_000
    return packed.getvalue()


def copy(source: h5py.Group, target: h5py.Group) -> None:
    target.attrs.update(source.attrs)
    for name, entry in source.items():
        if isinstance(entry, h5py.Group):
            copy(entry, target.create_group(name))
        else:
            long = {"compression": "gzip"} if entry.size > 1 else {}
            target.create_dataset(name, data=entry[()], **long).attrs.update(entry.attrs)


def files(content: bytes, count: int) -> list[tuple[str, tuple[str, bytes]]]:
    return [("file", (f"{number}.h5", content)) for number in range(count)]


def kept(server: Server, skin: str) -> int:
    return len(server.http.get("/v1/campaigns", params={"skin": skin, "limit": 200}).json()["campaigns"])


@pytest.mark.soak
def test_a_request_of_files_that_unfold_to_too_much_is_refused(small: Server, zeros: bytes) -> None:
    before = family_mb(small.process.pid)
    answer = small.http.post("/v1/campaigns?skin=many", files=files(zeros, MANY))
    assert answer.status_code == 413, answer.text
    for said in (f"{MOST_MB} MB", "UNDERSKIN_MAX_UPLOAD_MB", "several requests", "Nothing was kept"):
        assert said in answer.json()["detail"]
    assert family_mb(small.process.pid) - before < MOST_MEMORY_MB
    assert kept(small, "many") == 0
    assert small.http.post("/v1/campaigns?skin=many", files=files(zeros, FITTING)).status_code == 201
    assert kept(small, "many") == FITTING

"""The lab's own mechanisms over HTTP: kept, known to diagnoses by name, refused, discarded; and what is left out."""

import shutil
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.diagnosed import sent
from tests.support.diagnosis_campaigns import Made
from tests.support.diagnosis_campaigns import campaign as made_campaign
from tests.support.lean_reports import beside
from tests.support.store_server import Server
from underskin import Client, ServiceError
from underskin.client.documents import Diagnosis
from underskin.recordings.campaign import FrfRecording, to_dict
from underskin.surrogate.sigma_table import load_table

FEW = beside("ageing", "contact_resonance")  # what its diagnoses leave out, so that they take little time
WARM = """\
schema: mechanism/1
name: warm_amplifier
description: The amplifier's gain follows the temperature.
acts_on: gain
axes: [temperature_c]
law: 1 + rise * (temperature_c - 23)
parameters:
  rise: {unit: 1/°C, low: -0.1, high: 0.1, prior: {mean: 0, sd: 0.03}, limit: 0}
source: Our own measurements.
"""


@pytest.fixture
def lab(working: Server) -> Iterator[Server]:
    """A server that makes diagnoses, and has no mechanisms of the lab's own before and after."""
    folder = working.place.folder / "mechanisms"
    shutil.rmtree(folder, ignore_errors=True)
    yield working
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def client(lab: Server) -> Iterator[Client]:
    with Client(str(lab.http.base_url)) as opened:
        yield opened


def warmed() -> dict[str, object]:
    """A campaign whose gain rises by 2 % a degree, the temperature in a column of its own."""
    quiet = made_campaign(Made(sensors=1, repeats=3, gain=0.005, seed=3), load_table())
    temperatures = np.random.default_rng(5).uniform(20, 30, len(quiet.recordings))
    recordings = []
    for entry, temperature in zip(quiet.recordings, temperatures.tolist(), strict=True):
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        factor = 1 + 0.02 * (temperature - 23)
        recordings.append(
            replace(
                entry,
                frf_re_pc_per_n=factor * entry.frf_re_pc_per_n,
                frf_im_pc_per_n=factor * entry.frf_im_pc_per_n,
                conditions={"temperature_c": round(temperature, 3)},
            )
        )
    return to_dict(replace(quiet, recordings=tuple(recordings)))


def test_a_law_is_found_kept_under_a_name_recognised_and_left_out_again(lab: Server, client: Client) -> None:
    campaign_id = sent(lab, warmed())

    def diagnosed(*without: str) -> Diagnosis:
        return client.diagnoses.wait(client.diagnoses.start(campaign_id, without=[*FEW, *without])["id"])

    first = diagnosed()
    assert (first["verdict"], first["report"]["unnamed"]["axis"]) == ("unexplained", "temperature_c")
    kept = client.mechanisms.keep_found(first["id"], "warm_amplifier", "The gain follows the temperature.")
    assert (kept["own"], kept["package"].split()[0]) == (True, "warm_amplifier.yaml")
    assert "warm_amplifier" in {entry["name"] for entry in client.mechanisms.all()}

    second = diagnosed()
    assert second["id"] != first["id"]
    assert [entry["name"] for entry in second["report"]["mechanisms"]] == ["warm_amplifier"]
    assert client.diagnoses.start(campaign_id, without=FEW) == {"id": second["id"], "state": "done"}

    third = diagnosed("warm_amplifier")
    assert (third["verdict"], set(third["without"])) == ("unexplained", {*FEW, "warm_amplifier"})
    assert set(third["report"]["provenance"]["without"]) == {*FEW, "warm_amplifier"}

    client.skins.adopt("palm", second["id"])
    with pytest.raises(ServiceError, match="withdraw it first"):
        client.mechanisms.discard("warm_amplifier")
    client.skins.withdraw_model("palm", "tried")
    assert client.mechanisms.discard("warm_amplifier")["name"] == "warm_amplifier"
    assert "warm_amplifier" not in {entry["name"] for entry in client.mechanisms.all()}
    assert client.diagnoses.get(second["id"])["report"] == second["report"]
    assert [file.name.split()[0] for file in (lab.place.folder / "mechanisms" / "discarded").iterdir()]


def test_a_document_is_kept_once_and_nothing_else_can_be_discarded(lab: Server, client: Client) -> None:
    assert client.mechanisms.keep(WARM)["parameters"] == [{"name": "rise", "unit": "1/°C", "low": -0.1, "high": 0.1}]
    with pytest.raises(ServiceError, match="taken"):
        client.mechanisms.keep(WARM)
    with pytest.raises(ServiceError, match="cannot be discarded"):
        client.mechanisms.discard("ageing")
    with pytest.raises(ServiceError, match="There is no mechanism"):
        client.mechanisms.discard("nothing")
    with pytest.raises(ServiceError, match="must be one of"):
        client.diagnoses.start(sent(lab, warmed()), without=["nothing"])
    with pytest.raises(ServiceError, match="no diagnosis"):
        client.mechanisms.keep_found("d-0123456789abcdef", "other")
    file = lab.place.folder / "mechanisms" / "warm_amplifier.yaml"
    assert file.read_text(encoding="utf-8") == WARM
    file.unlink()
    assert "warm_amplifier" not in {entry["name"] for entry in client.mechanisms.all()}


REFUSED = (
    (WARM.replace("name: warm_amplifier", "name: ../evil"), 422, "name"),
    ("a: [", 422, "not YAML"),
    ("", 422, "schema"),
    (WARM.replace("low: -0.1", f"low: -{10**30}"), 422, "line 8"),
    ('{"diagnosis_id": "d-1"}', 422, "name"),
    ('{"name": "a", "name": "b", "diagnosis_id": "d-1"}', 422, "given twice"),
    ("x" * 100_001, 413, "100000 bytes"),
    ('{"schema": "mechanism/1", "name": "\\ud800"}', 400, "surrogate"),
    # As tests/mechanisms/test_declared_mechanisms.py has them.
    (WARM.replace("gain", "weather"), 422, "acts_on"),
    (WARM.replace("rise *", "__import__('os').system('x') *"), 422, "line 6"),
    (WARM.replace("The amplifier's gain", '"\\ud800" #'), 422, "description: the character U+D800"),
    (WARM.replace("prior: {mean: 0, sd: 0.03}", "prior: {mean: 0, sd: 1.0e+20}"), 422, "of the prior"),
)


def test_what_cannot_be_kept_is_refused_with_its_reason(lab: Server) -> None:
    for body, status, said in first(8, REFUSED):
        kind = "application/json" if body.startswith("{") else "application/yaml"
        answer = lab.http.post("/v1/mechanisms", content=body.encode(), headers={"Content-Type": kind})
        assert (answer.status_code, said in answer.text) == (status, True), f"{body[:200]}: {answer.text}"
    folder = lab.place.folder / "mechanisms"
    assert not folder.exists() or not list(folder.iterdir())


def test_a_file_that_cannot_be_used_is_named_until_it_is_mended(lab: Server, client: Client) -> None:
    file = lab.place.folder / "mechanisms" / "warm.yaml"
    campaign_id = sent(lab, warmed())
    file.parent.mkdir()
    file.write_text(WARM.replace("gain", "weather"), encoding="utf-8")
    for _ in range(2):
        listed = lab.http.get("/v1/mechanisms").json()
        assert "ageing" in {entry["name"] for entry in listed["mechanisms"]}
        assert [(one["file"], "line 4: acts_on" in one["reason"]) for one in listed["unusable"]] == [
            ("warm.yaml", True)
        ]
        page = lab.http.get("/mechanisms", headers={"Accept": "text/html"})
        assert (page.status_code, "warm.yaml cannot be used" in page.text) == (200, True)
        with pytest.raises(ServiceError, match=r"warm.yaml: line 4: acts_on"):
            client.diagnoses.start(campaign_id, without=FEW)
    file.write_text(WARM, encoding="utf-8")
    client.diagnoses.cancel(client.diagnoses.start(campaign_id, without=FEW)["id"])
    assert "warm_amplifier" in {entry["name"] for entry in client.mechanisms.all()}

"""Models adopted from diagnoses: refused where they must be, served by /frf, /d33 and histories, kept and moved."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import orjson
import pytest

from tests.support.diagnosed import D33, SKIN, diagnosed, report, resonant, sent, small
from tests.support.store_server import Server, campaign
from underskin import Client, ServiceError
from underskin.client.answers import Adopted
from underskin.recordings.campaign import FrfRecording, parse

BACKEND = "postgresql"
PRESSED: dict[str, Any] = {
    "thickness_mm": SKIN.thickness_mm,
    "youngs_modulus_mpa": SKIN.youngs_modulus_mpa,
    "sensor_radius_mm": SKIN.sensor_radius_mm,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
}
FREQUENCY = [5.0, 50.0, 200.0]


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(str(server.http.base_url)) as opened:
        yield opened


def made(mechanisms: dict[str, tuple[float, ...]], names: dict[str, tuple[str, ...]]) -> dict[str, Any]:
    """The report on the array, about other mechanisms; for what a model needs, whatever was found."""
    found = [
        {
            "name": name,
            "probability": 0.97,
            "parameters": [
                {"name": parameter, "unit": "-", "value": value, "low": 0.9 * value, "high": 1.1 * value}
                for parameter, value in zip(names[name], values, strict=True)
            ],
            "explains_percent": 90.0,
        }
        for name, values in mechanisms.items()
    ]
    return {**report(), "mechanisms": found}


def test_an_adopted_model_is_the_physics_that_was_found(server: Server, client: Client) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    with pytest.raises(ServiceError, match="no adopted model"):
        client.skins.model("palm")
    adopted = client.skins.adopt("palm", diagnosis_id)
    assert client.skins.adopt("palm", diagnosis_id) == adopted
    assert client.skins.model("palm") == adopted
    assert (adopted["version"], adopted["campaign_id"], adopted["diagnosis_id"]) == (1, campaign_id, diagnosis_id)
    assert adopted["mechanisms"] == report()["mechanisms"]
    assert (adopted["needs"], adopted["depends_on_frequency"]) == ([], True)
    paper = client.frf(**PRESSED, d33_pc_per_n=D33)
    answer = client.frf(**PRESSED, d33_pc_per_n=D33, frequency_hz=FREQUENCY, adopted=Adopted("palm"))
    assert answer.model_id == adopted["id"]
    # A resonance above the band changes nothing on the plateau, and raises what comes near it.
    np.testing.assert_allclose(answer.frf_pc_per_n, paper.frf_pc_per_n, rtol=1e-3)
    assert answer.frf_re_pc_per_n is not None
    assert answer.frf_im_pc_per_n is not None
    (entry, *_) = (row for row in parse(resonant("one", preloads=[1.0])).recordings if isinstance(row, FrfRecording))
    lines, real, imaginary = entry.frequency_hz, entry.frf_re_pc_per_n, entry.frf_im_pc_per_n
    assert lines is not None
    assert real is not None
    assert imaginary is not None
    spectrum = client.frf(**PRESSED, d33_pc_per_n=D33, frequency_hz=lines, adopted=Adopted("palm"))
    assert spectrum.frf_re_pc_per_n is not None
    assert spectrum.frf_im_pc_per_n is not None
    predicted = spectrum.frf_re_pc_per_n + 1j * spectrum.frf_im_pc_per_n
    np.testing.assert_allclose(predicted, real + 1j * imaginary, rtol=0.06)
    assert abs(predicted[-1]) != pytest.approx(abs(float(paper.frf_pc_per_n)), rel=0.1)
    found = client.d33(
        **PRESSED, frequency_hz=lines, frf_re_pc_per_n=predicted.real, frf_im_pc_per_n=predicted.imag,
        band_hz=(5, 800), adopted=Adopted("palm"),
    )  # fmt: skip
    np.testing.assert_allclose(found.d33_pc_per_n, D33, rtol=1e-9)
    d33 = report()["d33"]
    assert found.d33_uncertainty_pc_per_n / found.d33_pc_per_n >= np.log(d33["high"] / d33["low"]) / 4


def test_what_the_model_needs_is_asked_for(server: Server, client: Client) -> None:
    mechanisms = {"contact_creep": (0.3, 40.0), "ageing": (0.1, 1000.0, 0.0), "crosstalk": (0.1,)}
    names = {
        "contact_creep": ("relaxed_fraction", "relaxation_time"),
        "ageing": ("loss", "onset", "saturation"),
        "crosstalk": ("fraction",),
    }
    _, diagnosis_id = diagnosed(server, resonant("array"), made(mechanisms, names))
    assert set(client.skins.adopt("palm", diagnosis_id)["needs"]) == {"dwell_s", "load_cycles", "sensor"}
    asked = {**PRESSED, "d33_pc_per_n": D33, "model": "adopted", "skin_id": "palm"}
    given: dict[str, Any] = {}
    for name, value in (("dwell_s", [0.0, 1e4]), ("sensor", "s1"), ("load_cycles", 0)):
        refused = server.http.post("/v1/frf", json=asked | given)
        assert (refused.status_code, name in refused.json()["detail"]) == (422, True), refused.text
        given[name] = value
    held = server.http.post("/v1/frf", json=asked | given).json()["frf_pc_per_n"]
    assert held[1] != pytest.approx(held[0], rel=1e-3)  # the contact has grown
    aged = server.http.post("/v1/frf", json=asked | given | {"load_cycles": 1e6}).json()["frf_pc_per_n"]
    assert aged[0] == pytest.approx(held[0] * (1 - 0.1 * np.log10(1001)), rel=1e-6)
    nobody = server.http.post("/v1/frf", json=asked | given | {"sensor": "s9"})
    assert (nobody.status_code, "s1, s2" in nobody.json()["detail"]) == (422, True)
    header = ",".join(["dwell_s", "load_cycles", "sensor", *asked])
    cells = ",".join(map(str, [0.0, 0, "s1", *asked.values()]))
    text = server.http.post("/v1/frf", content=f"{header}\n{cells}\n", headers={"Content-Type": "text/csv"})
    assert text.json()["frf_pc_per_n"] == held[:1]
    paper = server.http.post("/v1/d33", json={**PRESSED, "frf_pc_per_n": 5.0, "dwell_s": 3.0})
    assert (paper.status_code, "only with model adopted" in paper.json()["detail"]) == (422, True)


def test_another_skin_is_not_the_model_s(server: Server, client: Client) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    client.skins.adopt("palm", diagnosis_id)
    for name, value in (("youngs_modulus_mpa", 16.0), ("thickness_mm", 2.0), ("poisson_ratio", 0.4)):
        with pytest.raises(ServiceError, match=f"{name}.*as the skin was declared when it was diagnosed"):
            client.frf(**{**PRESSED, name: value}, d33_pc_per_n=D33, frequency_hz=FREQUENCY, adopted=Adopted("palm"))
    with pytest.raises(ServiceError, match=r"frequency_hz.*contact_resonance"):
        client.frf(**PRESSED, d33_pc_per_n=D33, adopted=Adopted("palm"))
    with pytest.raises(ServiceError, match=r"frequency_hz.*contact_resonance"):
        client.d33(**PRESSED, frf_pc_per_n=6.0, adopted=Adopted("palm"))
    beyond = client.frf(
        **PRESSED | {"preload_n": [1.0, 1e4]}, d33_pc_per_n=D33, frequency_hz=FREQUENCY, units_checked=True,
        adopted=Adopted("palm"),
    )  # fmt: skip
    assert beyond.status.tolist() == ["ok", "out_of_domain"]
    assert np.isnan(beyond.frf_pc_per_n).tolist() == [False, True]


def test_histories_say_which_model_each_value_used(server: Server, client: Client) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    other = sent(server, campaign("of another skin, by its modulus"))
    model_id = client.skins.adopt("palm", diagnosis_id)["id"]
    paper, adopted = (client.skins.history("palm", model=model) for model in ("paper", "adopted"))
    told = {(point["model"], point["model_id"]) for entry in paper["sensors"] for point in entry["points"]}
    assert told == {("paper", None)}
    points = [point for entry in adopted["sensors"] for point in entry["points"]]
    assert {(point["model"], point["model_id"], point["campaign_id"]) for point in points} == {
        ("adopted", model_id, campaign_id)
    }
    for point in points:
        assert point["d33_pc_per_n"] == pytest.approx(D33, rel=0.03)
    assert [(entry["campaign_id"], "youngs_modulus_mpa" in entry["reason"] or "thickness" in entry["reason"])
            for entry in adopted["left_out_campaigns"]] == [(other, True)]  # fmt: skip
    d33 = client.campaigns.d33(campaign_id, model="adopted")
    assert (d33["model"], d33["model_id"], d33["status"]) == ("adopted", model_id, "ok")
    assert d33["model_percent"] > 0
    assert client.campaigns.d33(campaign_id, model="adopted") == d33
    with pytest.raises(ServiceError, match="422"):
        client.campaigns.d33(other, model="adopted")


def test_only_what_is_explained_is_adopted(server: Server, client: Client) -> None:
    for verdict, what_to_do in (
        ("no_mismatch", "nothing to adopt; the paper's model serves"),
        ("ambiguous", r"several explanations remain.*recordings that it plans"),
        ("unexplained", "Look at the rig"),
        ("insufficient_data", r"Correct what it says is wrong, or record what it says is lacking"),
    ):
        _, diagnosis_id = diagnosed(server, small(), {**report(), "verdict": verdict})
        with pytest.raises(ServiceError, match=f"a diagnosis of verdict {verdict}.*must be explained: .*{what_to_do}"):
            client.skins.adopt("palm", diagnosis_id)
    assert client.skins.models("palm") == []


def test_what_cannot_be_adopted_is_refused(server: Server, client: Client) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    sent(server, campaign("finger"), "finger")
    with pytest.raises(ServiceError, match="404"):
        client.skins.adopt("none", diagnosis_id)
    with pytest.raises(ServiceError, match="404"):
        client.skins.adopt("palm", "d-1")
    with pytest.raises(ServiceError, match="is of skin 'palm', not of 'finger'"):
        client.skins.adopt("finger", diagnosis_id)
    queued = client.diagnoses.start(sent(server, campaign("later")))["id"]
    with pytest.raises(ServiceError, match="its state is queued"):
        client.skins.adopt("palm", queued)
    client.campaigns.exclude(campaign_id, "r0", "cable loose")
    with pytest.raises(ServiceError, match="recordings were excluded since"):
        client.skins.adopt("palm", diagnosis_id)


def test_a_model_whose_campaign_was_changed_serves_no_longer(server: Server, client: Client) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    client.skins.adopt("palm", diagnosis_id)
    client.campaigns.withdraw(campaign_id, "fell down")
    with pytest.raises(ServiceError, match="withdrawn: fell down"):
        client.frf(**PRESSED, d33_pc_per_n=D33, frequency_hz=FREQUENCY, adopted=Adopted("palm"))
    with pytest.raises(ServiceError, match="withdrawn: fell down"):
        client.skins.history("palm", model="adopted")
    assert client.skins.model("palm")["outdated"] == "withdrawn: fell down"
    _, newer = diagnosed(server, resonant("again"), report())
    client.skins.adopt("palm", newer)
    assert [(entry["version"], entry["outdated"]) for entry in client.skins.models("palm")] == [
        (2, None),
        (1, "withdrawn: fell down"),
    ]
    client.frf(**PRESSED, d33_pc_per_n=D33, frequency_hz=FREQUENCY, adopted=Adopted("palm"))


def test_joined_skins_have_one_model(server: Server, client: Client) -> None:
    for skin in ("a", "b"):
        _, diagnosis_id = diagnosed(server, resonant(skin), report(), skin)
        client.skins.adopt(skin, diagnosis_id)
    client.skins.join("a", "b", "one skin")
    assert client.skins.model("a") == client.skins.model("b")
    assert client.skins.model("a")["skin_id"] == "b"  # adopted last
    assert [entry["version"] for entry in client.skins.models("b")] == [1, 1]


def test_diagnoses_models_elsewhere_here(server: Server, elsewhere: Server, tmp_path: Path) -> None:
    """Diagnoses and models are elsewhere as they were here."""
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    with Client(str(server.http.base_url)) as here, Client(str(elsewhere.http.base_url)) as there:
        here.skins.adopt("palm", diagnosis_id)
        sent(server, campaign("other"))
        file = tmp_path / "palm.h5"
        here.skins.export("palm", file)
        assert there.skins.load(file)["kept"] == 2
        assert there.skins.load(file)["present"] == 2
        for ask in (
            lambda client: client.diagnoses.get(diagnosis_id),
            lambda client: client.skins.models("palm"),
            lambda client: client.skins.history("palm", model="adopted"),
            lambda client: list(client.diagnoses.all()),
        ):
            assert ask(there) == ask(here)
        assert there.diagnoses.start(campaign_id) == {"id": diagnosis_id, "state": "done"}
        newer = {**report(), "probability": 0.9}
        there.campaigns.withdraw(campaign_id, "elsewhere")
        _, second = diagnosed(server, resonant("again"), newer)
        here.skins.adopt("palm", second)
        here.skins.export("palm", file)
        with pytest.raises(ServiceError, match="is there already and differs"):
            there.skins.load(file)
        assert len(there.skins.models("palm")) == 1


def _spoil(report: dict[str, Any], part: str) -> dict[str, Any]:
    spoilt = {**report, "mechanisms": [dict(entry) for entry in report["mechanisms"]]}
    if part == "value":
        spoilt["mechanisms"][0]["parameters"] = [{"name": "tip_mass", "value": "x", "low": 1, "high": 2}]
    elif part == "d33":
        spoilt["d33"] = {"low": -1.0, "high": 0.0}
    else:
        del spoilt[part]
    return spoilt


def test_a_report_that_was_tampered_with_is_refused(server: Server, elsewhere: Server, tmp_path: Path) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    with Client(str(server.http.base_url)) as here, Client(str(elsewhere.http.base_url)) as there:
        here.skins.adopt("palm", diagnosis_id)
        file = tmp_path / "palm.h5"
        here.skins.export("palm", file)
        with h5py.File(file) as opened:
            rows = orjson.loads(opened["diagnoses"][()].tobytes())
        for part in ("value", "d33", "provenance"):
            spoilt = [{**row, "report": _spoil(row["report"], part)} for row in rows]
            with h5py.File(file, "r+") as opened:
                del opened["diagnoses"]
                opened["diagnoses"] = np.frombuffer(orjson.dumps(spoilt), np.uint8)
            with pytest.raises(ServiceError, match="422"):
                there.skins.load(file)
            assert list(there.campaigns.all(state="all")) == [], part

"""Campaigns that a diagnosis finds something in, made by the composed models, and their reports."""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import orjson

from service.store import database, diagnoses
from tests.support.lean_reports import beside, lean_fleet, lean_together
from tests.support.store_server import Server
from underskin import __version__, diagnose
from underskin.mechanisms import compose
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor, SkinDescription, parse, to_dict
from underskin.surrogate.sigma_table import SigmaTable, load_table

# What is left out where any report is to be had: of one campaign, and of several.
MOST = beside("contact_resonance")
_MOST_TOGETHER = beside("contact_resonance", "sensor_spread")

D33 = 14.0
TIP_MASS_G = 4.0
SKIN = SkinDescription(
    poisson_ratio=0.5,
    thickness_mm=2.5,
    youngs_modulus_mpa=2.0,
    sensor_radius_mm=1.5,
    sensors=(Sensor("s1", 0.0, 0.0), Sensor("s2", 8.0, 0.0)),
)


@cache
def table() -> SigmaTable:
    """The shipped table, read once."""
    return load_table()


def resonant(
    name: str, *, preloads: Sequence[float] = (0.5, 1.0, 2.0), lines: int = 12, seed: int = 11
) -> dict[str, Any]:
    """A tip that resonates on the contact: each sensor under two spheres and a few preloads."""
    return of_mechanisms(name, {"contact_resonance": (TIP_MASS_G, 0.05)}, preloads=preloads, lines=lines, seed=seed)


def of_mechanisms(
    name: str, mechanisms: dict[str, tuple[float, ...]], *, preloads: Sequence[float], lines: int, seed: int = 11
) -> dict[str, Any]:
    """A campaign with these mechanisms, the values of their parameters in order, and a rig's noise."""
    zeros = np.zeros(lines)
    design = [(sensor.id, radius, preload) for sensor in SKIN.sensors for radius in (4.0, 8.0) for preload in preloads]
    recordings = [
        FrfRecording(
            id=f"r{number}",
            sensor=sensor,
            indenter_radius_mm=radius,
            preload_n=preload,
            dynamic_force_n=0.05,
            recorded_at="2017-05-03T09:00:00Z",
            frequency_hz=np.geomspace(5, 800, lines).round(3),
            frf_re_pc_per_n=zeros,
            frf_im_pc_per_n=zeros,
        )
        for number, (sensor, radius, preload) in enumerate(design)
    ]
    campaign = Campaign(name, SKIN, tuple(recordings))
    model = compose(tuple(mechanisms), campaign, table())
    own = [value for values in mechanisms.values() for value in values]
    values = [*own, D33, 1.0, 1.0]
    fit = [parameter.to_fit(value) for parameter, value in zip(model.parameters, values, strict=True)]
    exact = 1e12 * model.predict(np.array(fit)).value
    random = np.random.default_rng(seed)
    gain = 1 + 0.01 * random.normal(size=len(recordings))
    noise = 0.005 * (random.normal(size=len(exact)) + 1j * random.normal(size=len(exact)))
    shown = (exact * gain[model.recording] * (1 + noise)).reshape(len(recordings), lines)
    return to_dict(
        replace(
            campaign,
            recordings=tuple(
                replace(entry, frf_re_pc_per_n=row.real, frf_im_pc_per_n=row.imag)
                for entry, row in zip(recordings, shown, strict=True)
            ),
        )
    )


@cache
def small() -> dict[str, Any]:
    """A campaign of the kind of `resonant` that takes little time to diagnose."""
    return resonant("small", preloads=(1.0,), lines=6)


@cache
def small_report(without: tuple[str, ...] = MOST) -> dict[str, Any]:
    """The report on `small` that a worker makes where it is `begun`."""
    made = diagnose(parse(small()), table(), without=without)
    return dict(orjson.loads(orjson.dumps(made.document, option=orjson.OPT_SERIALIZE_NUMPY)))


def sent(server: Server, document: dict[str, Any], skin: str = "palm") -> str:
    """The id of a campaign that was sent."""
    answer = server.http.post("/v1/campaigns", json=document, params={"skin": skin})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def asked(server: Server, campaign_id: str, **headers: str) -> str:
    """The id of a campaign's diagnosis."""
    answer = server.http.post(f"/v1/campaigns/{campaign_id}/diagnosis", headers=headers)
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def begun(server: Server, document: dict[str, Any], skin: str = "palm", without: tuple[str, ...] = MOST) -> str:
    """The id of a diagnosis, of few mechanisms, of a campaign that was sent."""
    campaign_id = sent(server, document, skin)
    answer = server.http.post(f"/v1/campaigns/{campaign_id}/diagnosis", json={"without": without})
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def found(server: Server, diagnosis_id: str) -> dict[str, Any]:
    """The diagnosis as it is."""
    answer = server.http.get(f"/v1/diagnoses/{diagnosis_id}")
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def awaited(server: Server, diagnosis_id: str, *states: str) -> dict[str, Any]:
    """The diagnosis once it is in one of these states; else once it has ended."""
    deadline = time.monotonic() + 240  # a machine may be busy
    pause = 0.1
    while time.monotonic() < deadline:
        diagnosis = found(server, diagnosis_id)
        if diagnosis["state"] in (states or ("done", "failed", "cancelled")):
            return diagnosis
        time.sleep(pause)
        pause = min(1.2 * pause, 1.0)  # asking takes the server and the test longer than waiting
    raise AssertionError(f"still {diagnosis}")


@cache
def report(without: tuple[str, ...] = MOST) -> dict[str, Any]:
    """The report on `resonant`, made here: what any worker makes of it, but for the headline, which is made of the rest
    where tests change that."""
    made = diagnose(parse(resonant("array")), table(), without=without)
    return {**orjson.loads(orjson.dumps(made.document, option=orjson.OPT_SERIALIZE_NUMPY)), "headline": ""}


@cache
def joint_reports() -> dict[str, dict[str, Any]]:
    """Reports on several campaigns like `resonant`, of a skin and of a fleet, by the kind of their diagnosis."""
    names = ("one", "two", "three")
    one, two, three = (parse(resonant(name, preloads=(1.0,), lines=6, seed=seed)) for seed, name in enumerate(names))
    fleet = {"a": [one], "b": [two], "c": [three]}
    made = {
        "skin": lean_together([one, two], table(), "several", _MOST_TOGETHER),
        "fleet": lean_fleet(fleet, table(), "fleet", _MOST_TOGETHER),
    }
    return dict(orjson.loads(orjson.dumps(made, option=orjson.OPT_SERIALIZE_NUMPY)))


def finished(server: Server) -> None:
    """End all that waits without a worker, each with a report of its kind."""
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        basis = diagnoses.Basis(table().sha256, __version__)
        while (row := diagnoses.claim(connection, "test", basis)) is not None:
            made = report() if row.kind == "campaign" else {**joint_reports()[row.kind], "campaign": row.name}
            assert diagnoses.finish(connection, row.number, "test", made)
    store.close()


def diagnosed(server: Server, document: dict[str, Any], made: dict[str, Any], skin: str = "palm") -> tuple[str, str]:
    """The ids of a campaign and of its diagnosis, done with the report `made` without a worker."""
    campaign_id = sent(server, document, skin)
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        basis = diagnoses.Basis(table().sha256, __version__)
        diagnosis_id = str(diagnoses.ask(connection, campaign_id, basis, None).id)
        claimed = diagnoses.claim(connection, "test", basis)
        assert claimed is not None
        assert claimed.id == diagnosis_id, "a server took it: start it with UNDERSKIN_DIAGNOSIS_WORKERS=0"
        assert diagnoses.finish(connection, claimed.number, "test", made)
    store.close()
    return campaign_id, diagnosis_id

"""Diagnoses that are done, without a worker that makes them."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import orjson

from service.store import database, diagnoses
from tests.support.diagnosed import MOST, asked, resonant, sent, table
from tests.support.store_server import Server
from underskin import __version__
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.figures import figures
from underskin.diagnosis.reporting.report import report
from underskin.recordings.campaign import parse

LINES = 30


@dataclass(frozen=True)
class Made:
    """What a worker would have made of a campaign."""

    report: dict[str, Any]
    figures: dict[str, str]


@cache
def made() -> Made:
    """Report and figures of `resonant`."""
    found = diagnose(parse(resonant("array", lines=LINES)), table(), without=MOST)
    told = report(found)
    plain = orjson.loads(orjson.dumps(told, option=orjson.OPT_SERIALIZE_NUMPY))
    return Made(plain, {name: figure.to_json() for name, figure in figures(found, told).items()})


def finish(server: Server, made: Made) -> None:
    """End all that waits without a worker."""
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        basis = diagnoses.Basis(table().sha256, __version__)
        while (claimed := diagnoses.claim(connection, "test", basis)) is not None:
            assert diagnoses.finish(connection, claimed.number, "test", made.report, made.figures)
    store.close()


def keep(server: Server, skin: str, made: Made, name: str = "") -> str:
    """The path of the page of a diagnosis that is done, of a campaign of this skin and name."""
    diagnosis_id = asked(server, sent(server, {**resonant(skin, lines=LINES), "name": name or skin}, skin))
    finish(server, made)
    return f"/diagnoses/{diagnosis_id}"

"""Diagnoses that are done, without a worker that makes them."""

from dataclasses import dataclass
from typing import Any

import orjson

from service.store import database, diagnoses
from tests.support.diagnosed import sent, table
from tests.support.store_server import Server
from underskin import __version__
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.figures import figures
from underskin.diagnosis.reporting.report import report
from underskin.recordings.campaign import parse


@dataclass(frozen=True)
class Made:
    """What a worker would have made of a campaign."""

    report: dict[str, Any]
    figures: dict[str, str]


def made_of(document: dict[str, Any]) -> Made:
    """Report and figures of a campaign."""
    found = diagnose(parse(document), table())
    made = report(found)
    plain = orjson.loads(orjson.dumps(made, option=orjson.OPT_SERIALIZE_NUMPY))
    return Made(plain, {name: figure.to_json() for name, figure in figures(found, made).items()})


def keep(server: Server, document: dict[str, Any], made: Made, skin: str) -> str:
    """The id of a diagnosis that is done."""
    campaign_id = sent(server, document, skin)
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        basis = diagnoses.Basis(table().sha256, __version__)
        row = diagnoses.ask(connection, campaign_id, basis, None)
        while (claimed := diagnoses.claim(connection, "test", basis)) is not None:
            assert diagnoses.finish(connection, claimed.number, "test", made.report, made.figures)
    store.close()
    return str(row.id)

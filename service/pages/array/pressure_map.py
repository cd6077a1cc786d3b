"""A measured pressure map on an array, and the charge on each of its sensors.

Nothing is stored: the map stays in the page's form.
"""

import base64
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from service.dependencies import Store
from service.ingest.reading import READING_SLOTS
from service.ingest.uploads import UploadFolder, received, texts
from service.pages.array import description
from service.pages.shared import same_request
from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.forms import TOKEN, require_form_token
from service.pages.shared.html import page
from service.pages.shared.wrong_fields import errors_together
from service.store import Database
from underskin.array_stress import pressure_map
from underskin.array_stress.answer import ArrayStress
from underskin.errors import UnderskinError, noting, out_of_range
from underskin.prediction.columns import to_spreadsheet
from underskin.recordings.readers import text

router = APIRouter(prefix="/loads/map")

_EXAMPLE = "map.csv"
_LARGEST_BYTES = 1_000_000
_LARGEST_BODY_BYTES = 2 * _LARGEST_BYTES + 100_000  # a file, the text of the last map, and the other fields
_LONGEST_FIELD = 1000  # bytes of a field other than the map
_MAP, _FILE, _SKIN = "map", "file", "skin"


@router.get("")
def view(request: Request, store: Store, skin: str | None = None) -> Response:
    """An example map, a finger pressing on the skin or on the paper's prototype."""
    example = (Path(__file__).parents[1] / "static" / _EXAMPLE).read_bytes()
    return _shown(request, store, {} if skin is None else {_SKIN: skin}, example, "the map")


@router.post("")
async def send(request: Request, store: Store) -> Response:
    """The map sent as a file, or else as text."""
    folder: UploadFolder = request.app.state.uploads
    async with received(request, folder, _LARGEST_BODY_BYTES) as sent:
        fields = [part for part in sent if part.field not in (_MAP, _FILE)]
        given = await folder.threads.run(partial(texts, fields, _LONGEST_FIELD))
        require_form_token(request, given.get(TOKEN, ""))
        file = next((part for part in sent if part.field == _FILE and part.label), None)
        typed = next((part for part in sent if part.field == _MAP), None)
        chosen = file or typed
        content = b"" if chosen is None else await folder.threads.run(partial(chosen.start, _LARGEST_BYTES + 1))
    name = "the map" if file is None or not file.label else file.label
    async with READING_SLOTS:
        return await run_in_threadpool(_shown, request, store, given, content, name)


def _shown(request: Request, store: Database, given: Mapping[str, str], content: bytes, name: str) -> Response:
    described = description.described(store, request.app.state.table, given, given.get(_SKIN))

    def document_of_map() -> dict[str, Any]:
        document: dict[str, Any] = {}
        with errors_together() as wrong:
            with noting(wrong):
                document = described.document()
            if len(content) > _LARGEST_BYTES:
                must = f"must have at most {_LARGEST_BYTES / 1e6:g} MB: make it coarser"
                raise out_of_range("pressure_map", name, must)
            return {**document, "pressure_map": pressure_map.parse(content, name)}

    document, answer, wrong = description.tried(request, document_of_map)
    return page(
        request,
        "pressure_map.html",
        array=described,
        map=_text(content[:_LARGEST_BYTES]),
        example=_EXAMPLE,
        wrong=wrong,
        answer=answer,
        findings=description.findings(answer),
        strained=description.finite_strain(answer),
        figures=[] if answer is None else _figures(document, answer),
        body=None if answer is None else _inside("application/json", orjson.dumps(document)),
        same=same_request.from_file(request, "/v1/stress", "request.json", "client.stress({})"),
    )


def _figures(document: Mapping[str, Any], answer: ArrayStress) -> list[Drawn]:
    from underskin.figures.loads import pressure_on_array

    columns, held = answer.columns, document["pressure_map"]
    places = list(zip(columns["x_mm"].tolist(), columns["y_mm"].tolist(), strict=True))
    pressed = pressure_on_array(held["x_mm"], held["y_mm"], held["pressure_mpa"], places, document["sensor_radius_mm"])
    as_map = {"y_mm \\ x_mm": held["y_mm"]} | {
        f"{x!r}": column for x, column in zip(held["x_mm"], zip(*held["pressure_mpa"], strict=True), strict=True)
    }
    return [
        drawn("pressure", pressed, "The map as it was read, and the sensors' outlines.", _csv(as_map)),
        description.charge_figure(answer, [], document["sensor_radius_mm"], _csv(description.charge_columns(answer))),
    ]


def _csv(columns: Mapping[str, Any]) -> str:
    return _inside("text/csv", to_spreadsheet(columns).encode())


def _inside(media_type: str, content: bytes) -> str:
    """An address (data URL) that contains the file itself."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


def _text(content: bytes) -> str:
    """The map for the form's text field; empty if it is not text, such as a spreadsheet file."""
    try:
        return text.decode(content, "")
    except UnderskinError:
        return ""

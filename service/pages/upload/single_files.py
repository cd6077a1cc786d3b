"""Values of single files of an upload: sensor, preload or time, if they differ from file to file."""

from collections.abc import Mapping, Sequence
from typing import Any

from service.ingest.field_words import RECORDING
from service.ingest.uploads import Upload
from service.pages.shared.forms import number_or_text
from service.pages.upload import recorded_time, typed_values
from underskin.errors import InvalidInput

MOST = 100  # files that the form has a row for
_DIFFERING = (
    *("sensor", "indenter_radius_mm", "preload_n", "sample_height_mm", "sample_diameter_mm"),
    recorded_time.FIELD,
)
FIELDS = tuple(field for field in RECORDING if field[0] in _DIFFERING)
_FIELD_WORDS = {name: words for name, words, *_ in FIELDS}
_TEXTS = ("sensor", recorded_time.FIELD)

Typed = Mapping[int, Mapping[str, str]]  # by the number of the file, by field, as it was typed


def typed(form: Mapping[str, str], files: Sequence[Upload]) -> dict[int, dict[str, str]]:
    """What a form says of each file."""
    names = [name for name, *_ in FIELDS]
    rows = {
        number: {name: text for name in names if (text := form.get(f"file-{number}-{name}", "").strip())}
        for number in range(min(len(files), MOST))
    }
    return {number: row for number, row in rows.items() if row}


def values_of(
    rows: Typed, files: Sequence[Upload], kind: str, *, units_checked: bool
) -> tuple[dict[int, dict[str, Any]], list[InvalidInput]]:
    """The fields among them that recordings of a kind have, and what is wrong with them, each with its file's name."""
    names = {name for name, _, _, kinds in FIELDS if kind in kinds}
    values: dict[int, dict[str, Any]] = {}
    wrong: list[InvalidInput] = []
    for number, typed_of_it in rows.items():
        row = {name: text for name, text in typed_of_it.items() if name in names}
        values[number] = {name: text if name in _TEXTS else number_or_text(text) for name, text in row.items()}
        refused = typed_values.of_recording(kind, values[number], units_checked=units_checked)
        wrong += [error.at(field_of(files[number].label, error.field)) for error in refused]
        try:
            values[number] |= {name: recorded_time.said(row[name]) for name in row.keys() & {recorded_time.FIELD}}
        except InvalidInput as error:
            wrong.append(error.at(field_of(files[number].label, recorded_time.FIELD)))
    return values, wrong


def field_of(file: str | None, name: str) -> str:
    """What errors call a field of one file."""
    return f"{file}: {_FIELD_WORDS[name]}"

"""The options for rig description, estimator and contact, and reading with them."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from underskin.errors import InvalidInput, UnderskinError

if TYPE_CHECKING:
    from underskin.recordings.frf.estimators import Estimator
    from underskin.recordings.reading import Reading
    from underskin.recordings.rig_description import RigDescription


RigOption = Annotated[Path | None, typer.Option(help="Rig description, for files that hold channels.")]
EstimatorOption = Annotated[
    Literal["H1", "H2", "Hv"] | None,
    typer.Option(
        help="FRFs of time series, whatever files or rig say; unbiased by noise in charge (H1), force (H2), both (Hv)."
    ),
]


def rig_description_in(rig: Path) -> "RigDescription":
    """The rig description in a file; raises UnderskinError that names the file."""
    from underskin.recordings import rig_description

    try:
        return rig_description.parse(rig.read_bytes(), str(rig))
    except InvalidInput as error:
        raise UnderskinError(f"{rig}: {error}") from error
    except OSError as error:
        raise UnderskinError(f"{rig}: cannot be opened: {error.strerror}") from error


def read_by(file: Path, rig: "RigDescription | None", estimator: "Estimator | None") -> "Reading":
    """Read a file with a rig description and an estimator; raises as `read_file`."""
    from underskin.recordings import read_file

    return read_file(file, file.name, rig).with_estimator(estimator)


def reading_notes(reading: "Reading") -> list[str]:
    """Assumptions in reading, a line for each field, and warnings."""
    mappings = [f"read {field or 'the text as'}: {how}" for field, how in reading.taken.items()]
    return [*mappings, *(f"look at: {warning}" for warning in reading.warnings)]


class Contact(StrEnum):
    """How the sphere touches the layer, as `ContactName` has it."""

    PAPER = "paper"
    SOLVED = "solved"


ContactOption = Annotated[
    Contact,
    typer.Option(
        help="Hertz' pressure of a half space on the layer, as a dead load; or contact with the layer itself, solved."
    ),
]

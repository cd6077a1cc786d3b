"""The rig description that a command was given, and what was read by it."""

from pathlib import Path
from typing import TYPE_CHECKING

from underskin.errors import InvalidInput, UnderskinError

if TYPE_CHECKING:
    from underskin.recordings.reading import Reading
    from underskin.recordings.rig_description import RigDescription


def rig_description_in(rig: Path) -> "RigDescription":
    """The rig description in a file; raises UnderskinError that names the file."""
    from underskin.recordings import rig_description

    try:
        return rig_description.parse(rig.read_bytes(), str(rig))
    except InvalidInput as error:
        raise UnderskinError(f"{rig}: {error}") from error
    except OSError as error:
        raise UnderskinError(f"{rig}: cannot be opened: {error.strerror}") from error


def reading_notes(reading: "Reading") -> list[str]:
    """What was taken for what, a line a field, and what to look at."""
    taken = [f"read {field or 'the text as'}: {how}" for field, how in reading.taken.items()]
    return [*taken, *(f"look at: {warning}" for warning in reading.warnings)]

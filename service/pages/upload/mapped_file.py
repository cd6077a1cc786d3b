"""What a mapping makes of a file before the file can be kept: in use, or else guessed."""

from service.ingest.reading import InspectedFile
from service.pages.upload import mapping
from service.pages.upload.file_summary import FileSummary
from underskin.errors import FileError, InvalidInput
from underskin.recordings import rig_description, rig_mapping
from underskin.recordings.rig_description import RigDescription
from underskin.recordings.rig_mapping import MappedFile


def mapped_file(look: InspectedFile, summary: FileSummary, rig: RigDescription | None) -> MappedFile | None:
    """The campaign document of a file and what was taken for what, by the rig description or, without one, as the form
    guesses it; None where that cannot be."""
    if look.contents is None:
        return None
    try:
        if rig is None:
            rig = rig_description.from_dict(mapping.guessed(summary.channels, summary.properties, {}))
        return rig_mapping.apply(rig, look.contents, summary.label)
    except (FileError, InvalidInput):
        return None

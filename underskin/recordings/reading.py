"""From a lab's file, of whatever format, to a campaign."""

import io
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

from underskin.errors import FileError
from underskin.recordings import curve_signs, rig_mapping
from underskin.recordings.campaign import Campaign, FrfRecording, Recording, RecordingProblem, from_dict
from underskin.recordings.channels import Contents, Document
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.readers import formats, template_columns
from underskin.recordings.readers.polar_columns import MAGNITUDE, PARTS
from underskin.recordings.readers.sandbox import call_apart, parse_apart
from underskin.recordings.rig_description import RigDescription

_SHEET_TEXT = "underskin.recordings.readers.xlsx_file:sheet_text"
LARGEST_TEXT = 8_000_000  # larger tables are parsed under the limits of binary files
_TEMPLATE = "; below lines about the skin, the first of them schema,campaign/1, it would be the CSV template"


@dataclass(frozen=True)
class Reading:
    """A file's campaign with its good recordings, what is wrong with the others, what the user should know, and by
    field which channel a rig description took for it, in words (under no field how a text was read)."""

    campaign: Campaign
    problems: list[RecordingProblem]
    warnings: list[str]
    taken: Mapping[str, str] = field(default_factory=dict)

    def with_estimator(self, estimator: Estimator | None) -> "Reading":
        """The same with the FRFs of all time series estimated so, whatever was said before; None changes nothing.

        A warning counts the recordings that it does not apply to.
        """
        if estimator is None:
            return self
        recordings: list[Recording] = []
        others = 0
        for recording in self.campaign.recordings:
            if isinstance(recording, FrfRecording) and recording.sample_rate_hz is not None:
                recordings.append(replace(recording, estimator=estimator))
            else:
                recordings.append(recording)
                others += 1
        told = [f"{estimator} is for time series, which {others} of {len(recordings)} recordings are not"]
        campaign = replace(self.campaign, recordings=tuple(recordings))
        return replace(self, campaign=campaign, warnings=[*self.warnings, *(told if others else [])])

    def with_curves_turned(self) -> "Reading":
        """The same with force and displacement turned in curves that count pressing negative; a warning says so."""
        campaign, changed = curve_signs.turned(self.campaign)
        if not changed:
            return self
        told = f"force or displacement of {changed} recordings, counted negative as they were pressed, were turned"
        return replace(self, campaign=campaign, warnings=[*self.warnings, told])


def read_file(source: Path | str | bytes, name: str, rig: RigDescription | None = None) -> Reading:
    """The campaign in a file, of which `source` is the place on this machine or the bytes, and `name` what to call it.

    The content decides the format, of another package's formats the name. Files that hold channels, not campaigns,
    need a rig description. Raises FileError that names the file and the place, InvalidInput where the campaign itself
    or its skin cannot be used.
    """
    return understood(read_contents(source, name), name, rig)


def understood(contents: Contents | Document, name: str, rig: RigDescription | None = None) -> Reading:
    """The campaign in what `read_contents` has read; raises as `read_file`."""
    if isinstance(contents, Document):
        return Reading(*from_dict(contents.campaign), list(contents.warnings))
    if rig is None:
        layout = f" ({contents.layout})" if contents.layout else ""
        reason = f"a rig description must say what its channels are; it has {contents.described()}{layout}"
        raise FileError(name, "", f"{reason}{_TEMPLATE}" if _holds_frfs(contents) else reason)
    mapped = rig_mapping.apply(rig, contents, name)
    return Reading(*from_dict(mapped.document), mapped.warnings, mapped.taken)


def _holds_frfs(contents: Contents) -> bool:
    """Whether a channel is headed as the FRF of the CSV template is."""
    names = {channel.name for block in contents.blocks for channel in block.channels}
    meant = [template_columns.field_of(one, PARTS) for one in names]
    return any(one is not None and one[0] in (MAGNITUDE, *PARTS) for one in meant)


def read_contents(source: Path | str | bytes, name: str) -> Contents | Document:
    """A file's channels, or its campaign document, before a rig description is applied; raises FileError."""
    with _opened(source, name) as stream:
        kind = formats.detect(stream, name)
        size = stream.seek(0, io.SEEK_END)
        if formats.is_parsed_apart(kind) or (kind != "JSON" and size > LARGEST_TEXT):
            return parse_apart(kind, stream, name)
        return formats.parse(kind, stream, name)


def sheet_text(content: bytes, name: str, sheet: str | None = None) -> str:
    """A sheet of a workbook as text, cells separated by tabs: that of a name, or the only one; raises FileError."""
    with _opened(content, name) as stream:
        return str(call_apart(_SHEET_TEXT, stream, name, *([] if sheet is None else [sheet]), what="XLSX")["text"])


@contextmanager
def _opened(source: Path | str | bytes, name: str) -> Iterator[BinaryIO]:
    """An open file; bytes go into one without a name."""
    if isinstance(source, bytes):
        with tempfile.TemporaryFile() as stream:
            stream.write(source)
            stream.flush()
            yield stream
        return
    try:
        opened = Path(source).open("rb")  # noqa: SIM115 (closed below)
    except OSError as error:
        raise FileError(name, "", f"cannot be opened: {error.strerror}") from None
    with opened:
        yield opened

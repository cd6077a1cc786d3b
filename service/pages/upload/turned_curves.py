"""Curves of a file with channels inverted that count pressing negative."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from underskin.recordings.curve_preparation import falling
from underskin.recordings.rig_mapping import MappedFile, range_of


def counted_negative(recording: Mapping[str, Any]) -> Sequence[str]:
    """Those of `force_n` and `displacement_mm` that decrease while a curve is pressed."""
    if recording["kind"] == "frf" or not {"force_n", "displacement_mm"} <= recording.keys():
        return ()
    columns = np.asarray(recording["force_n"]), np.asarray(recording["displacement_mm"])
    return falling(*columns, sphere=recording["kind"] == "indentation")


def turned(columns: Mapping[str, Any], fields: Sequence[str]) -> dict[str, Any]:
    """The columns, with those of `fields` inverted."""
    return {name: -np.asarray(column) if name in fields else column for name, column in columns.items()}


def with_curves_turned(mapped: MappedFile) -> MappedFile:
    """A file with every such curve inverted; the note on each channel says so, with the range of the first curve."""
    before: Sequence[dict[str, Any]] = mapped.document["recordings"]
    recordings = [turned(recording, counted_negative(recording)) for recording in before]
    taken = dict(mapped.taken)
    for field in counted_negative(before[0]) if before else ():
        channel = taken[field].rpartition(": ")[0]  # before the range that it came in
        taken[field] = f"{channel}, turned round: {range_of(field, recordings[0][field])}"
    return replace(mapped, document={**mapped.document, "recordings": recordings}, taken=taken)

"""Recordings of a lab, in the formats of its instruments, as one campaign model.

reading = read_file("palm.tdms", "palm.tdms", rig=rig_description.parse(rig_bytes, "rig.yaml"))
reading.campaign.recordings
day = join("Monday", [("1.tdms", first), ("2.tdms", second)])  # files of one rig as one campaign
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from underskin.recordings.reading import Reading, join, read_contents, read_file

__all__ = ["Reading", "join", "read_contents", "read_file"]

if not TYPE_CHECKING:  # or a type checker would believe in every name

    def __getattr__(name: str) -> Any:
        """On first use: a process that parses a file needs its reader alone, and would take twice as long to start."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module("underskin.recordings.reading"), name)

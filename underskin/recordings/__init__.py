"""Recordings of a lab, in the formats of its instruments, as one campaign model.

reading = read_file("palm.tdms", "palm.tdms", rig=rig_description.parse(rig_bytes, "rig.yaml"))
reading.campaign.recordings
day = join("Monday", [("1.tdms", first), ("2.tdms", second)])  # files of one rig as one campaign
"""

from underskin.recordings.reading import Reading, join, read_contents, read_file

__all__ = ["Reading", "join", "read_contents", "read_file"]

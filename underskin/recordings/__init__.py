"""What a lab records, in the formats its instruments write, as one campaign model.

reading = read_file("palm.tdms", "palm.tdms", rig=rig_description.parse(rig_bytes, "rig.yaml"))
reading.campaign.recordings
"""

from underskin.recordings.reading import Reading, read_contents, read_file

__all__ = ["Reading", "read_contents", "read_file"]

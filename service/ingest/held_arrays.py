"""Memory taken by the arrays of a request's campaigns, which are all held until they are stored together."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from service.ingest.reading import ReadCampaign
from service.problems import Refusal


class HeldArrays:
    """Total size of the arrays of the campaigns read so far; at most `most_bytes`."""

    def __init__(self, most_bytes: int) -> None:
        """Nothing was read yet."""
        self._most_bytes = most_bytes
        self._bytes = 0
        self._counted: set[int] = set()  # arrays that own their numbers: recordings may share one, or parts of it

    def add(self, campaigns: Iterable[ReadCampaign]) -> None:
        """Add the arrays of a campaign; raises Refusal (413) beyond the limit."""
        for array in _arrays(campaigns):
            owner = array
            while isinstance(owner.base, np.ndarray):
                owner = owner.base
            if id(owner) not in self._counted:
                self._counted.add(id(owner))
                self._bytes += owner.nbytes
        if self._bytes > self._most_bytes:
            raise Refusal(
                413,
                f"Unfolded, the files have more than the {self._most_bytes / 1e6:g} MB that one request may bring: "
                "four times UNDERSKIN_MAX_UPLOAD_MB, or UNDERSKIN_READING_MEMORY_MB where that is more. Send them in "
                "several requests, or raise UNDERSKIN_MAX_UPLOAD_MB. Nothing was kept.",
            )


def _arrays(campaigns: Iterable[ReadCampaign]) -> Iterator[NDArray[np.generic]]:
    for campaign in campaigns:
        if campaign.reading is not None:
            for recording in campaign.reading.campaign.recordings:
                yield from (value for value in vars(recording).values() if isinstance(value, np.ndarray))

"""What tests of the proof share: digests of sources, which take seconds."""

import hashlib
import json
from collections.abc import Iterator, Mapping

import pytest

from proof import stored


@pytest.fixture(scope="module")
def quick_digests() -> Iterator[None]:
    """Sources are digested as they are, their names and comments too (test_source_digest.py: without them)."""

    def quick(sources: Mapping[str, str]) -> str:
        return hashlib.sha256(json.dumps(sources, sort_keys=True).encode()).hexdigest()

    digests = stored.sources, stored.of_diagnosis
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stored, "source_digest", quick)
        for digest in digests:
            digest.cache_clear()
        yield
    for digest in digests:
        digest.cache_clear()

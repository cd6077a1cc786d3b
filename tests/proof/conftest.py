"""What tests of the proof share: digests of sources, which take seconds."""

from collections.abc import Iterator, Mapping

import pytest

from underskin.source_digest import source_digest


@pytest.fixture(scope="module")
def sources_digested_once() -> Iterator[None]:
    """The same sources are digested for the first run of a module: the same texts give the same digest
    (test_source_digest.py)."""
    made: dict[frozenset[tuple[str, str]], str] = {}

    def once(sources: Mapping[str, str]) -> str:
        key = frozenset(sources.items())
        if key not in made:
            made[key] = source_digest(sources)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("proof.stored.source_digest", once)
        yield

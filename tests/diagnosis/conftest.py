"""What tests of the diagnosis share: the table of σ, and diagnoses of campaigns that several of them put together."""

from collections.abc import Callable, Collection, Iterator

import pytest

from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.recordings.campaign import Campaign
from underskin.recordings.readers import json_file
from underskin.surrogate.sigma_table import SigmaTable, load_table


@pytest.fixture(scope="session")
def table() -> SigmaTable:
    """The one that comes with the library."""
    return load_table()


@pytest.fixture(scope="module")
def skins_diagnosed_once() -> Iterator[Callable[..., DiagnosisResult]]:
    """A campaign that several fleets of a module have, or several dates of a skin, is diagnosed for the first of them:
    the same recordings give the same diagnosis (test_diagnosis_report.py). Tests that ask for it diagnose by it too."""
    made: dict[tuple[bytes, frozenset[str]], DiagnosisResult] = {}

    def once(campaign: Campaign, table: SigmaTable, *, without: Collection[str] = ()) -> DiagnosisResult:
        key = json_file.write(campaign), frozenset(without)
        if key not in made:
            made[key] = diagnose(campaign, table, without=without)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("underskin.diagnosis.several.fleet.diagnose", once)
        patch.setattr("underskin.diagnosis.several.campaigns.diagnose", once)
        yield once

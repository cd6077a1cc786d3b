"""Diagnoses of searches among fewer mechanisms, where what is hidden is found among those that are left as well."""

from typing import Any

from bench.soak import SOAK
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.report import DiagnosisResult, report
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

# What a search on curves takes longest with: sets that hold one of them are four fifths of its time.
COSTLY = ("adhesion", "contact_creep", "compressible_layer")


def lean_diagnosis(campaign: Campaign, table: SigmaTable, *left_out: str) -> DiagnosisResult:
    """The diagnosis of a campaign without the mechanisms `left_out`; in `make soak` with all."""
    return diagnose(campaign, table, without=() if SOAK else left_out)


def lean_report(campaign: Campaign, table: SigmaTable, *left_out: str) -> dict[str, Any]:
    """Its report."""
    return report(lean_diagnosis(campaign, table, *left_out))

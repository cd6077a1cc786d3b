"""Diagnoses of searches among fewer mechanisms, where what is hidden is found among those that are left as well."""

from collections.abc import Mapping, Sequence
from typing import Any

from bench.soak import SOAK
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.report import DiagnosisResult, report
from underskin.diagnosis.several.campaigns import diagnose_together
from underskin.diagnosis.several.fleet import diagnose_fleet
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

# What a search on curves takes longest with: sets that hold one of them are four fifths of its time.
COSTLY = ("adhesion", "contact_creep", "compressible_layer")

# What FRFs of skins that differ in d33, E or h, or have a tip that resonates, are searched for longest beside those.
BESIDE_SKINS = (
    *COSTLY,
    *("interface_slip", "layered_contact", "moving_contact_edge", "instrument_compliance", "sensor_relaxation"),
    *("amplifier_high_pass", "amplitude_nonlinearity", "crosstalk", "timing_delay"),
)


def lean_diagnosis(campaign: Campaign, table: SigmaTable, *left_out: str) -> DiagnosisResult:
    """The diagnosis of a campaign without the mechanisms `left_out`; in `make soak` with all."""
    return diagnose(campaign, table, without=() if SOAK else left_out)


def lean_report(campaign: Campaign, table: SigmaTable, *left_out: str) -> dict[str, Any]:
    """Its report."""
    return report(lean_diagnosis(campaign, table, *left_out))


def lean_together(campaigns: Sequence[Campaign], table: SigmaTable, name: str) -> dict[str, Any]:
    """The report on campaigns of a skin without `BESIDE_SKINS`; in `make soak` with all."""
    return diagnose_together(campaigns, table, name, () if SOAK else BESIDE_SKINS)


def lean_fleet(skins: Mapping[str, Sequence[Campaign]], table: SigmaTable, name: str) -> dict[str, Any]:
    """The report on a fleet, likewise."""
    return diagnose_fleet(skins, table, name, () if SOAK else BESIDE_SKINS)

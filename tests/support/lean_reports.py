"""Reports of searches among fewer mechanisms, where what is hidden is found among those that are left as well.

Each report that a test asks for here is also held to what all reports promise.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import underskin
from bench.soak import SOAK
from underskin.mechanisms import CATALOGUE
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

# What a search on curves takes longest with: sets that hold one of them are four fifths of its time.
COSTLY = ("adhesion", "contact_creep", "compressible_layer")

# What FRFs of skins that differ in d33, E or h, or have a tip that resonates, are searched for longest beside those.
BESIDE_SKINS = (
    *COSTLY,
    *("interface_slip", "layered_contact", "moving_contact_edge", "instrument_compliance", "sensor_relaxation"),
    *("amplifier_high_pass", "crosstalk", "timing_delay"),
)

EVERY = tuple(CATALOGUE)  # what is wrong with recordings themselves is found without a mechanism
_MOST_SENTENCES, _MOST_WORDS = 3, 20


def beside(*mechanisms: str) -> tuple[str, ...]:
    """All mechanisms but these."""
    return tuple(name for name in EVERY if name not in mechanisms)


def sentences(statement: str) -> list[str]:
    """Split after a mark that ends a sentence: before a capital, and after any full stop with a space behind it."""
    return re.split(r"(?<=[.!?]) +(?=[\"'(]?[A-Z])|(?<=\.) +", statement)


def held(report: Mapping[str, Any]) -> dict[str, Any]:
    """The report, held to what all promise: a headline of 20 words with the number to quote, three sentences, and
    probabilities of answers that exclude one another."""
    headline, quoted = report["headline"], report["d33"] if (report["d33"] or {}).get("quotable") else None
    assert 1 <= len(headline.split()) <= _MOST_WORDS, headline
    assert "_" not in headline, headline
    assert quoted is None or f"{quoted['value']:.3g}" in headline, headline
    assert 1 <= len(sentences(report["statement"])) <= _MOST_SENTENCES, report["statement"]
    answers = [report["probability"], *(entry["probability"] for entry in report["alternatives"])]
    assert all(0 <= probability <= 1 for probability in answers)
    intervals = [entry for mechanism in report["mechanisms"] for entry in mechanism["parameters"]]
    assert all(entry["low"] <= entry["value"] <= entry["high"] for entry in intervals)
    return dict(report)


def whole_report(campaign: Campaign, table: SigmaTable | None = None, *left_out: str) -> dict[str, Any]:
    """The report on a campaign without the mechanisms `left_out`, in `make soak` too."""
    return held(underskin.diagnose(campaign, table, without=left_out))


# What bends a curve on ordinary benches
_BENDS = ("strain_stiffening", "instrument_compliance", "layered_contact", "modulus_error")


def quick_diagnosis(campaign: Campaign, *kept: str) -> underskin.Report:
    """The report of a search on curves among what commonly bends them and these; in `make soak` among all."""
    return underskin.diagnose(campaign, without=() if SOAK else beside(*_BENDS, *kept))


def lean_report(campaign: Campaign, table: SigmaTable, *left_out: str) -> dict[str, Any]:
    """The report on a campaign without the mechanisms `left_out`; in `make soak` with all."""
    return whole_report(campaign, table, *(() if SOAK else left_out))


def lean_together(
    campaigns: Sequence[Campaign], table: SigmaTable, name: str, left_out: Sequence[str] = BESIDE_SKINS
) -> dict[str, Any]:
    """The report on campaigns of a skin without the mechanisms `left_out`; in `make soak` with all."""
    return held(underskin.diagnose_together(campaigns, name, table, without=() if SOAK else left_out))


def lean_fleet(
    skins: Mapping[str, Sequence[Campaign]], table: SigmaTable, name: str, left_out: Sequence[str] = BESIDE_SKINS
) -> dict[str, Any]:
    """The report on a fleet, likewise."""
    return held(underskin.diagnose_fleet(skins, name, table, without=() if SOAK else left_out))

"""Diagnoses in Python: of one campaign, of several of a skin, of the skins of a fleet; each answers with a `Report`.

>>> reading = underskin.read_file("palm-3.csv", "palm-3.csv")
>>> report = underskin.diagnose(reading)
>>> report.verdict, [mechanism.name for mechanism in report.mechanisms]
('explained', ['contact_resonance'])
"""

from collections.abc import Callable, Collection, Mapping, Sequence

from underskin.client.documents import Report
from underskin.diagnosis import pipeline
from underskin.diagnosis.planning.rig_limits import RigLimits
from underskin.diagnosis.reporting.report import report as report_document
from underskin.diagnosis.several import campaigns as several
from underskin.diagnosis.several import fleet
from underskin.recordings.campaign import Campaign
from underskin.recordings.reading import Reading
from underskin.surrogate.sigma_table import SigmaTable, load_table

Progress = Callable[[float], None]


def diagnose(
    campaign: Campaign | Reading,
    table: SigmaTable | None = None,
    *,
    without: Collection[str] = (),
    limits: RigLimits = pipeline.NO_LIMITS,
    progress: Progress = lambda _: None,
) -> Report:
    """The report (`report/1`) on where recordings and model disagree, and which physics the model lacks.

    FRFs are diagnosed where the campaign has any, else its indentation curves, else its compressions; recordings of the
    other kinds are used as well. The same input gives the same report.

    Parameters
    ----------
    campaign
        A campaign, or the result of `read_file`: then recordings that were refused are among the findings.
    table
        σ table; default: the shipped one.
    without
        Mechanisms to leave out of the catalogue.
    limits
        Capabilities of the rig, for the experiment to make next.
    progress
        Called with the completed share, 0 to 1.

    Raises
    ------
    InvalidInput
        A mechanism in `without` that is not in the catalogue.
    """
    campaign, refused = (campaign.campaign, campaign.problems) if isinstance(campaign, Reading) else (campaign, [])
    result = pipeline.diagnose(campaign, table or load_table(), progress, limits, without)
    return Report.from_json(report_document(pipeline.with_refused(result, refused)))


def diagnose_together(
    campaigns: Sequence[Campaign | Reading],
    name: str,
    table: SigmaTable | None = None,
    *,
    without: Collection[str] = (),
    progress: Progress = lambda _: None,
) -> Report:
    """The report on campaigns of one skin: what acts in all of them, and since when; parameters as for `diagnose`.

    Parameters
    ----------
    campaigns
        At least two. Parts of one, such as a file for each sensor or press, are diagnosed as one campaign, and so are
        curves without FRFs.
    name
        The campaigns' common name in the report.

    Raises
    ------
    InvalidInput
        Fewer than two campaigns, skins that are declared differently, or FRFs in two campaigns.
    """
    campaigns_read = [_campaign(campaign) for campaign in campaigns]
    document = several.diagnose_together(campaigns_read, table or load_table(), name, without, progress)
    return _with_refused(document, campaigns)


def diagnose_fleet(
    skins: Mapping[str, Sequence[Campaign | Reading]],
    name: str,
    table: SigmaTable | None = None,
    *,
    without: Collection[str] = (),
    progress: Progress = lambda _: None,
) -> Report:
    """The report on skins of one make, by their ids: what they share, and which deviate; parameters as for `diagnose`.

    Raises
    ------
    InvalidInput
        Fewer than three skins, one without campaigns of FRFs, or FRFs in two campaigns.
    """
    campaigns_by_skin = {skin: [_campaign(campaign) for campaign in campaigns] for skin, campaigns in skins.items()}
    document = fleet.diagnose_fleet(campaigns_by_skin, table or load_table(), name, without, progress)
    return _with_refused(document, [campaign for campaigns in skins.values() for campaign in campaigns])


def _campaign(campaign: Campaign | Reading) -> Campaign:
    return campaign.campaign if isinstance(campaign, Reading) else campaign


def _with_refused(document: Mapping[str, object], campaigns: Sequence[Campaign | Reading]) -> Report:
    """The report with recordings that were refused on reading first among its findings, with their campaign."""
    refused = []
    for reading in [campaign for campaign in campaigns if isinstance(campaign, Reading)]:
        refusals = (finding.in_report() for finding in pipeline.refused(reading.problems))
        refused += [
            {**finding, "statement": f"{reading.campaign.name}: {finding['statement']}"} for finding in refusals
        ]
    findings = document["findings"]
    assert isinstance(findings, list)
    return Report.from_json({**document, "findings": [*refused, *findings]})

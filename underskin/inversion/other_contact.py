"""The d33 of an array by the contact model that was not asked for, where the two say different things."""

from underskin.errors import InvalidInput
from underskin.inversion.invert import Inversion, invert
from underskin.inversion.mixed_model import Estimate
from underskin.prediction.answers import OTHER, STATED
from underskin.recordings.campaign import Campaign
from underskin.surrogate.contact_model import ContactName
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model


def array_d33_by_other(
    campaign: Campaign,
    table: SigmaTable,
    band_hz: tuple[float, float] | None,
    inversion: Inversion,
    asked_for: ContactName = "paper",
) -> Estimate | None:
    """`absolute_d33` by the other contact; None where there is none, or it differs by 1 % at most.

    Parameters
    ----------
    campaign, band_hz
        Of which `inversion` is, by the contact `asked_for`.
    table
        The σ table, with the contact table beside it; raises TableError where that cannot be read.
    """
    found = inversion.absolute_d33
    if found is None:
        return None
    try:
        other = invert(campaign, contact_model(table, OTHER[asked_for]), band_hz).absolute_d33
    except InvalidInput:  # which lies outside its domain as a whole
        return None
    return other if other is not None and abs(other.value / found.value - 1) > STATED else None

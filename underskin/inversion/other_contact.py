"""The d33 of an array by the other contact model, where both differ."""

from underskin.errors import InvalidInput
from underskin.inversion.invert import Inversion, invert
from underskin.inversion.mixed_model import Estimate
from underskin.prediction.answers import OTHER, STATED
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import ContactName, SigmaTable
from underskin.surrogate.solved_contact import contact_model


def array_d33_by_other(
    campaign: Campaign,
    table: SigmaTable,
    band_hz: tuple[float, float] | None,
    inversion: Inversion,
    requested: ContactName = "paper",
) -> Estimate | None:
    """`absolute_d33` by the other contact model; None where there is none, or it differs by at most 1 %.

    Parameters
    ----------
    campaign, band_hz
        The data of `inversion`, which used the contact model `requested`.
    table
        The σ table, with the contact table in the same folder; raises TableError where that cannot be read.
    """
    estimate = inversion.absolute_d33
    if estimate is None:
        return None
    try:
        other = invert(campaign, contact_model(table, OTHER[requested]), band_hz).absolute_d33
    except InvalidInput:  # all recordings lie outside its domain
        return None
    return other if other is not None and abs(other.value / estimate.value - 1) > STATED else None

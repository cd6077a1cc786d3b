"""The axes on which a campaign's recordings differ."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.screening.inspection import inspect
from underskin.findings.codes import FindingCode
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable


def with_dynamic_forces(original: Campaign, spread: float) -> Campaign:
    """Of which each is off from the first by up to `spread`, as a shaker without a closed loop gives them."""
    entries = [entry for entry in original.recordings if isinstance(entry, FrfRecording)]
    forces = entries[0].dynamic_force_n * np.linspace(1, 1 + spread, len(entries))
    varied = [replace(entry, dynamic_force_n=float(force)) for entry, force in zip(entries, forces, strict=True)]
    return replace(original, recordings=tuple(varied))


@pytest.mark.parametrize(("spread", "differs"), [(0.0, False), (1e-4, False), (0.009, False), (0.02, True)])
def test_forces_within_a_percent_are_one_force(table: SigmaTable, spread: float, differs: bool) -> None:
    made = with_dynamic_forces(campaign(Made(sensors=3, repeats=2), table), spread)
    assert ("dynamic_force_n" in recording_axes(made)) is differs
    constant = {entry.field for entry in inspect(made, table).findings if entry.code == FindingCode.CONSTANT_AXIS}
    assert ("dynamic_force_n" in constant) is not differs

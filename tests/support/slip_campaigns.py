"""Campaigns with a slip of a lab, recording by recording, and what the screening names in them."""

from collections.abc import Callable
from dataclasses import replace

from tests.support.diagnosis_campaigns import Made
from underskin.diagnosis.data.inspected import Inspected
from underskin.findings.codes import FindingCode, Reason
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings

MADE = Made(sensors=3, repeats=2, lines=20)
SLIPS = {
    *(FindingCode.CONJUGATED, FindingCode.SENSORS_EXCHANGED, FindingCode.GAIN_STEPS, FindingCode.WARM_UP),
    *(FindingCode.WEAK, FindingCode.STRONG, FindingCode.SIGN_FLIPPED),
}
Change = Callable[[FrfRecording, int], FrfRecording]


def times(entry: FrfRecording, real: float, imaginary: float | None = None) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    other = real if imaginary is None else imaginary
    return replace(entry, frf_re_pc_per_n=real * entry.frf_re_pc_per_n, frf_im_pc_per_n=other * entry.frf_im_pc_per_n)


def changed(made: Campaign, change: Change) -> Campaign:
    entries = frf_recordings(made)
    return replace(made, recordings=tuple(change(entry, number) for number, entry in enumerate(entries)))


def named(inspected: Inspected) -> list[Reason]:
    return [entry.reason for entry in inspected.findings if entry.code in SLIPS]

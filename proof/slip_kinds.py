"""Slips that a lab makes, applied to a campaign of the rig: what the recordings say then, and by how much χ² changes.

χ² counts what the slip adds to the recordings' levels over gain, position and line scatter, or to their phases over
line scatter. Where a slip changes nothing that a campaign can show, it is 0. Of levels and phases it is also worked out
what of this no other cause can explain (`slip_rivals`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from proof.slip_rivals import LevelRivals, conjugated_residual, over_one_sign
from rig.recorded import RecordedLines
from underskin.findings.codes import Reason
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Case:
    """A campaign of the rig, its known properties, and the scatter of each recording's level (recordings,)."""

    campaign: Campaign
    recorded: RecordedLines
    scatter: Floats

    @cached_property
    def rivals(self) -> LevelRivals:
        """Other causes that can change the levels."""
        return LevelRivals(self.recorded, self.scatter)

    @property
    def entries(self) -> list[FrfRecording]:
        """Its recordings."""
        return list(frf_recordings(self.campaign))

    def with_entries(self, entries: Sequence[FrfRecording]) -> Campaign:
        """The campaign with other recordings."""
        return replace(self.campaign, recordings=tuple(entries))


@dataclass(frozen=True)
class Slip:
    """The campaign with a slip, the χ² that it adds, and the part of it that no other cause explains (None: all)."""

    campaign: Campaign
    chi2: float
    over_rivals: float | None = None


MakeSlip = Callable[[Case, np.random.Generator], Slip | None]


def _scaled(case: Case, logarithm: Floats) -> Slip:
    """Levels times e^`logarithm` (recordings,)."""
    weight = case.scatter**-2.0
    weight = np.where(np.isfinite(weight), weight, 0.0)
    mean = float((weight * logarithm).sum() / weight.sum())
    factors = np.exp(logarithm)
    entries = [_times(recording, float(factor)) for recording, factor in zip(case.entries, factors, strict=True)]
    chi2 = float((weight * (logarithm - mean) ** 2).sum())
    return Slip(case.with_entries(entries), chi2, min(chi2, case.rivals.least_residual(logarithm)))


def _times(recording: FrfRecording, factor: float, conjugate: float = 1.0) -> FrfRecording:
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    real, imaginary = factor * recording.frf_re_pc_per_n, factor * conjugate * recording.frf_im_pc_per_n
    return replace(recording, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)


def _some(case: Case, random: np.random.Generator, share: float) -> Mask:
    return random.random(len(case.entries)) < share


def _sensors(case: Case) -> list[str]:
    return list(dict.fromkeys(recording.sensor for recording in case.entries))


def labels(case: Case, random: np.random.Generator) -> Slip | None:
    """Two sensors' labels exchanged in all recordings; the positions stay."""
    return _exchanged(case, random, 0.0)


def cables(case: Case, random: np.random.Generator) -> Slip | None:
    """Two sensors' labels exchanged from some recording on."""
    return _exchanged(case, random, float(random.uniform(0.2, 0.8)))


def _exchanged(case: Case, random: np.random.Generator, since: float) -> Slip | None:
    names = _sensors(case)
    if len(names) < 2:
        return None
    first, second = random.choice(names, 2, replace=False).tolist()
    late = recording_order(case.entries) >= since * len(case.entries)
    turned = np.array([recording.sensor in (first, second) for recording in case.entries]) & late
    if not turned.any():
        return None
    entries = [
        replace(recording, sensor=second if recording.sensor == first else first) if wrong else recording
        for recording, wrong in zip(case.entries, turned, strict=True)
    ]
    wrong = case.with_entries(entries)
    if case.entries[0].position_mm is not None:
        return Slip(wrong, _of_places(case, turned))
    gains = _of_gains(case, turned, first, second) if since else (0.0, 0.0)
    return Slip(wrong, sum(gains), min(gains))  # a step of either sensor, of any size, leaves the other one's


def _of_places(case: Case, turned: Mask) -> float:
    """Σ |FRF|² over its variance: the wrong sensor would show almost nothing."""
    return float((np.minimum(case.scatter, 1.0)[turned] ** -2.0).sum())


def _of_gains(case: Case, turned: Mask, first: str, second: str) -> tuple[float, float]:
    """What each of two sensors of unequal gains scatters about its mean, by the labels given."""
    gains = case.recorded.response.sensor_gains
    ids = [sensor.id for sensor in case.campaign.skin.sensors]
    step = float(np.log(gains[ids.index(first)] / gains[ids.index(second)]))
    labels = np.array([recording.sensor for recording in case.entries])
    written_as = np.where(turned, np.where(labels == first, second, first), labels)

    def scattered(name: str) -> float:
        of_sensor = (written_as == name) & np.isfinite(case.scatter)
        weight = case.scatter[of_sensor] ** -2.0
        was_turned = turned[of_sensor].astype(float)
        return (
            float(step**2 * (weight * (was_turned - np.average(was_turned, weights=weight)) ** 2).sum())
            if of_sensor.any()
            else 0.0
        )

    return scattered(first), scattered(second)


def conjugated(share: float) -> MakeSlip:
    """FRFs in the other sign convention."""

    def make_slip(case: Case, random: np.random.Generator) -> Slip | None:
        turned = _some(case, random, share)
        if not turned.any() or (share < 1 and 2 * turned.sum() >= len(turned)):
            return None
        entries = [
            _times(recording, 1.0, -1.0) if wrong else recording
            for recording, wrong in zip(case.entries, turned, strict=True)
        ]
        phase = 4 * case.recorded.exact.imag**2 / case.recorded.line_variance
        chi2 = float(phase[turned].sum())
        rivals = conjugated_residual(case.recorded) if turned.all() else over_one_sign(case.recorded, turned, share)
        return Slip(case.with_entries(entries), chi2, min(chi2, rivals))

    return make_slip


def polarity(case: Case, random: np.random.Generator) -> Slip | None:
    """Reversed at random in about a third of the recordings."""
    turned = _some(case, random, 1 / 3)
    entries = [
        _times(recording, -1.0) if wrong else recording for recording, wrong in zip(case.entries, turned, strict=True)
    ]
    return Slip(case.with_entries(entries), _of_places(case, turned)) if turned.any() else None


def weak(case: Case, random: np.random.Generator) -> Slip | None:
    """One sensor at a tenth of its gain."""
    names = _sensors(case)
    if len(names) < 2:
        return None
    name = str(random.choice(names))
    return _scaled(case, np.array([np.log(0.1) * (recording.sensor == name) for recording in case.entries]))


def dead(case: Case, random: np.random.Generator) -> Slip | None:
    """One sensor that gives noise only."""
    names = _sensors(case)
    if len(names) < 2:
        return None
    name = str(random.choice(names))
    floor = case.recorded.response.experiment.noise.floor_pc_per_n
    entries, of_sensor = [], np.array([recording.sensor == name for recording in case.entries])
    for recording, off in zip(case.entries, of_sensor, strict=True):
        size = len(np.asarray(recording.frequency_hz))
        noise = floor * random.normal(size=(2, size))
        entries.append(replace(recording, frf_re_pc_per_n=noise[0], frf_im_pc_per_n=noise[1]) if off else recording)
    return Slip(case.with_entries(entries), _of_places(case, of_sensor))


def warm_up(amplitude: float) -> MakeSlip:
    """The first recordings' gain 1 + A e^(−j/τ); a fall only where no load cycles are noted."""

    def make_slip(case: Case, random: np.random.Generator) -> Slip | None:
        if amplitude > 0 and all(recording.load_cycles is not None for recording in case.entries):
            return None  # `ageing` explains it as well
        order = recording_order(case.entries)
        return _scaled(case, np.log(1 + amplitude * np.exp(-order / float(random.uniform(1.0, 4.0)))))

    return make_slip


def factor(value: float) -> MakeSlip:
    """A third of the recordings multiplied by a factor: peak-to-peak or rms instead of peak."""

    def make_slip(case: Case, random: np.random.Generator) -> Slip | None:
        off = _some(case, random, 1 / 3)
        return None if 2 * off.sum() >= len(off) else _scaled(case, np.log(value) * off)

    return make_slip


# Each slip, and the reasons of findings that name it.
SLIPS: Mapping[str, tuple[MakeSlip, tuple[Reason, ...]]] = {
    "labels exchanged": (labels, (Reason.LABELS_EXCHANGED,)),
    "cables exchanged": (cables, (Reason.CABLES_EXCHANGED, Reason.LABELS_EXCHANGED)),
    "all conjugated": (conjugated(1.0), (Reason.ALL_CONJUGATED,)),
    "a third conjugated": (conjugated(1 / 3), (Reason.RECORDINGS_CONJUGATED,)),
    "polarity at random": (
        polarity,
        (Reason.RECORDINGS_REVERSED, Reason.RECORDING_REVERSED, Reason.SENSOR_REVERSED, Reason.ALL_REVERSED),
    ),
    # A tenth is a range of an amplifier too: one sensor of four may then be the one that is right.
    "sensor at a tenth": (weak, (Reason.WEAK_SENSOR, Reason.TWO_GROUPS)),
    "dead sensor": (dead, (Reason.SILENT_SENSOR, Reason.SILENT_RECORDING)),
    "warm-up, rising": (warm_up(-0.2), (Reason.WARM_UP,)),
    "warm-up, falling": (warm_up(0.3), (Reason.WARM_UP,)),
    "charge peak-to-peak": (factor(2.0), (Reason.AMPLITUDE_FACTOR,)),
    "force peak-to-peak": (factor(0.5), (Reason.AMPLITUDE_FACTOR,)),
    "force rms": (factor(2.0**0.5), (Reason.AMPLITUDE_FACTOR,)),
    "charge rms": (factor(0.5**0.5), (Reason.AMPLITUDE_FACTOR,)),
}

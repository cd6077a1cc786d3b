"""d33 of an array from a campaign's FRF recordings: per recording, per sensor × indenter × preload, per sensor, and for
the campaign (Seminara 2018, section 3.2 and equation 15).

Each recording's Re FRF, corrected for the common delay or phase and the bias by noise, is averaged over the flat zone
and divided by (3/2) ρ² σ, σ at the commanded offset; the mixed model then estimates the scatter of recordings, and so
the precision of each d33. These intervals are relative: they hold for the declared skin and the base model.
`declared_percent` is the standard deviation of all d33 together by the tolerances of the declared thickness, sensor
radius and modulus; `absolute_d33` includes it.

A sensor's channel also takes up a share of the charge under the contact (cross-talk, pick-up), which is an error of
that size in its own (`PICK_UP`): recordings of sensors off the contact count for less, and those that feel less of it
than that are not used.

Recordings far off the others of their sensor (a slip of units, a wrong range) are left out, since the mixed model
assumes log-normal recordings about their sensor's d33. What a skin may show is no outlier: an effect of a condition on
all sensors, the scatter of the array, and the effect of a misplaced sphere. Sensors are flagged with the reason where
they are dead, inverted, behind a filter, noisy, non-linear in preload (bent), or differ from the median of the others
by 5 % and three deviations of their error and the array's spread together (weak, strong); far off, they are left out of
the array's d33. Findings are used.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc, stdtr

from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.inversion import mixed_model
from underskin.inversion.mixed_model import ROBUST, Estimate, LevelRows, MixedModel
from underskin.inversion.noted_conditions import NotedConditions, noted_conditions
from underskin.inversion.sensor_flags import (
    ENOUGH,
    Flag,
    difference_flags,
    is_alive,
    population_flags,
    typical_size,
    without_groups,
)
from underskin.physics.charge_response import Indenter, gain
from underskin.prediction import pressed_skin
from underskin.prediction.answers import OTHER, STATED
from underskin.prediction.pressed_skin import (
    DECLARED,
    PICK_UP,
    contact_offsets,
    declared_skin,
    exchanged_values,
    far_contacts,
    log_slopes,
    share_of_contact,
    transmission,
    usable,
)
from underskin.recordings import plausibility
from underskin.recordings.campaign import Campaign, FrfRecording, Tolerances, excesses
from underskin.recordings.frf.estimation import exchanged_channels
from underskin.recordings.frf.flat_zone import (
    FlatZone,
    RollOff,
    band_average,
    flat_zone,
    lower_half,
    roll_off,
    without_chain_phase,
)
from underskin.recordings.frf.line_choice import excited_at_mains, gain_findings, noise_findings
from underskin.recordings.frf.series_lines import at_two_levels, chosen_lines, of_spoilt
from underskin.recordings.frf.spectra import Frf, Stack, left_out_of, mean_of, stacked
from underskin.recordings.plausibility import UNUSED_FOR_D33, at_reading, unlikely
from underskin.surrogate.off_centre_sigma import positioned_sigma
from underskin.surrogate.sigma_table import ContactModel, ContactName, SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import Floats, Indices, Mask, force_unit, to_lab, to_si, unusual

_NOISY = 3.0  # times the array's
_LEAST_CURVATURE = 0.05  # of d33
_FALSE_ALARMS = 1e-3  # per array


def scatter_flags(
    ids: tuple[str, ...], sensor: Indices, rows: "RecordingD33", good: Indices, pilot: Floats, expected: Floats
) -> list[Flag]:
    """Sensors whose lines or recordings scatter, or whose d33 is non-linear in preload, beyond their array's.

    `good` are the rows considered; `sensor` and `expected`, the relative scatter of each recording by the mixed model,
    are theirs.
    """
    numbers, member = np.unique(sensor, return_inverse=True)
    level = rows.d33[good] / pilot[sensor]
    lines = rows.line_scatter[good] * np.abs(level)
    line_of = np.array([np.median(lines[member == index]) for index in range(len(numbers))])
    usual = float(np.median(line_of))
    relative = level / np.array([np.median(level[member == index]) for index in range(len(numbers))])[member]
    residual = relative - _common(member, rows.condition[good], relative, 1.0)
    alarm = _FALSE_ALARMS / len(numbers)
    flags = []
    for index, name in enumerate(ids[sensor_index] for sensor_index in numbers):
        of_sensor = member == index
        curvature, chance, scatter, freedom = _curvature(
            residual[of_sensor], rows.preload[good][of_sensor], expected[of_sensor]
        )
        if chance < alarm and abs(curvature) > _LEAST_CURVATURE:
            flags.append(Flag(name, Reason.BENT, {"percent": 100 * curvature}))
        if len(numbers) > 2 and line_of[index] > _NOISY * usual:
            flags.append(Flag(name, Reason.NOISY_LINES, {"times": float(line_of[index] / usual)}))
        elif scatter > _NOISY and chdtrc(freedom, freedom * scatter**2) < alarm:
            flags.append(Flag(name, Reason.NOISY_RECORDINGS, {"times": scatter}))
    return flags


def _curvature(residual: Floats, preload: Floats, expected: Floats) -> tuple[float, float, float, int]:
    """Curvature over the range of preloads, its p-value, the scatter about the curve over the expected one, and its
    degrees of freedom."""
    if len(residual) < 6 or len(np.unique(preload)) < 3:
        freedom = max(1, len(residual) - 1)
        return 0.0, 1.0, float(np.sqrt(np.sum((residual / expected) ** 2) / freedom)), freedom
    x = (2 * preload - preload.min() - preload.max()) / (preload.max() - preload.min())
    basis = np.column_stack([np.ones_like(x), x, (3 * x**2 - 1) / 2]) / expected[:, None]
    coefficients = np.linalg.lstsq(basis, residual / expected, rcond=None)[0]
    freedom = len(residual) - 3
    scatter = float(np.sqrt(np.sum((residual / expected - basis @ coefficients) ** 2) / freedom))
    deviation = max(scatter, 1.0) * float(np.sqrt(np.linalg.pinv(basis.T @ basis)[2, 2]))
    chance = 2 * stdtr(freedom, -abs(coefficients[2]) / deviation)
    return 1.5 * float(coefficients[2]), float(chance), scatter, freedom


_AGAINST_ARRAY = {Reason.TWO_GROUPS, Reason.SCATTER_AT_LIMIT, Reason.GAIN_OVER_FREQUENCY}  # no d33 of the array
_FAR = 8.0  # deviations
_LEAST_DEVIATION = 0.1  # of the array's d33: only recordings that are off by 80 % or more are considered


def outlying(rows: "RecordingD33", position: Floats) -> Indices:
    """The recordings inside that lie more than 8 robust deviations from their sensor's d33, less the effect of their
    condition; `position` (recordings,): the relative deviation of each for a sphere misplaced as far as is usual.

    A sensor may have been dead, or inverted, on one of several dates: its d33 is that of the recordings that are not
    `_silent`, and no usual misplacement hides those that are. Where all recordings of a sensor are far, it is off and
    none of its recordings is an outlier.
    """
    good = np.flatnonzero(rows.inside)
    sensor, d33 = rows.sensor[good], rows.d33[good]
    array = typical_size(d33)
    expected = np.hypot(np.hypot(_LEAST_DEVIATION, position[good]), rows.d33_uncertainty[good] / array)
    silent: Mask = np.zeros(len(good), dtype=bool)
    for _ in range(2):  # noise may be more than each recording's lines tell: the scatter decides what is silent
        relative = _over_usual(sensor, d33, ~silent, array)
        residual = relative - _common(sensor, rows.condition[good], relative, float(np.median(relative)))
        deviation = np.maximum(ROBUST * float(np.median(np.abs(residual))), expected)
        silent = _silent(sensor, d33, deviation * array)
    far: Mask = np.abs(residual) > _FAR * deviation
    far |= silent & (relative < -residual)  # nearer to none than to what the others have of its condition
    for index in np.unique(sensor[far]):
        if far[sensor == index].all():
            far[sensor == index] = False
    return good[far]


def _silent(sensor: Indices, d33: Floats, deviation: Floats) -> Mask:
    """The recordings (recordings,) that none of the sensor's response explains, or the opposite, and not noise.

    With m the d33 of a sensor for which each of its recordings lies nearest to m, 0 or −m, by the sum of squares over
    the variances s² (`deviation`, and at least the scatter about m), d is silent where 0 is more likely than m by
    ln(N/α) nats,
        (d − m)² − d² > 2 s² ln(N/α),
    for N recordings: noise alone then makes one so in less than α of arrays, since d is |d − m| > 2 s √(ln(N/α)/2) off
    for any m. A sensor with fewer than half of its recordings and than a median needs at m has none.
    """
    silent = np.zeros(len(d33), dtype=bool)
    signed = d33 * (1.0 if np.median(d33) >= 0 else -1.0)
    least = 2 * np.log(len(d33) / _FALSE_ALARMS)
    for index in np.unique(sensor):
        same = sensor == index
        value, weight = signed[same], 1 / deviation[same] ** 2
        levels = value[value > 0]
        if not len(levels):
            continue
        nearest = np.min([(value - sign * levels[:, None]) ** 2 for sign in (-1, 0, 1)], axis=0)
        level = levels[np.argmin(nearest @ weight)]
        at_level = value > level / 2
        level = np.average(value[at_level], weights=weight[at_level])
        own_scatter = ROBUST * float(np.median(np.abs(value[at_level] - level)))
        of_sensor = (value - level) ** 2 - value**2 > least * np.maximum(deviation[same], own_scatter) ** 2
        responding = np.count_nonzero(~of_sensor)
        if responding >= ENOUGH or 2 * responding >= len(value):
            silent[same] = of_sensor
    return silent


def _over_usual(sensor: Indices, d33: Floats, usual: Mask, array: float) -> Floats:
    """Each recording over the median of its sensor's `usual` ones, or over the array's where it has few recordings.

    A dead sensor's recordings are 1 + their distance from its median, in units of the array's d33.
    """
    over = d33 / array
    for index in np.unique(sensor):
        same = sensor == index
        if same.sum() >= ENOUGH:
            middle = float(np.median(d33[same & usual]))
            over[same] = 1 + (d33[same] - middle) / (middle if abs(middle) > _LEAST_DEVIATION * array else array)
    return over


def _common(sensor: Indices, condition: Indices, relative: Floats, otherwise: float) -> Floats:
    """The median over sensors for the condition of each recording; `otherwise` for conditions with few sensors."""
    common = np.full(len(relative), otherwise)
    for index in np.unique(condition):
        of_condition = condition == index
        if len(np.unique(sensor[of_condition])) >= ENOUGH:
            common[of_condition] = np.median(relative[of_condition])
    return common


def _far_off(ids: tuple[str, ...], rows: "RecordingD33", outliers: Indices) -> list[Finding]:
    """The findings on outliers: those without charge, those of the other sign, and the others with their d33."""
    findings, kept = [], np.setdiff1d(np.flatnonzero(rows.inside), outliers)
    alive = np.zeros(len(rows.d33), dtype=bool)
    alive[rows.inside] = is_alive(rows.d33[rows.inside], rows.d33_uncertainty[rows.inside])
    for row in outliers.tolist():
        others = kept[(rows.sensor[kept] == rows.sensor[row]) & alive[kept]]
        reason, name = Reason.OUTLIER, ids[rows.sensor[row]]
        if len(others) and not alive[row]:
            reason = Reason.OUTLIER_SILENT
        elif len(others) and float(np.median(rows.d33[others])) * rows.d33[row] < 0:
            reason = Reason.OUTLIER_INVERTED
        value = float(to_lab("d33_pc_per_n", rows.d33[row]))
        findings.append(Finding(reason, rows.ids[row], "d33_pc_per_n", {"d33_pc_per_n": value, "sensor": name}))
    return findings


_CONTRADICTS = 3.0  # times


def findings_of(
    recorded: Sequence[FrfRecording],
    measured: Sequence[Frf],
    level: Floats,
    array: Estimate | None,
    *,
    units_checked: bool,
) -> tuple[Finding, ...]:
    """Findings on time series: defects, bias by noise, and a mean force that contradicts the preload; and on errors of
    units and sign of the level [C/N] and of the array's d33."""
    defects = [
        finding for item, frf in zip(recorded, measured, strict=True) for finding in left_out_of(item.id, frf.defects)
    ]
    typical = to_lab("frf_pc_per_n", np.nanmedian(np.abs(level)))
    unit_errors = [replace(finding, reason=Reason.UNUSUAL_MEDIAN_FRF) for finding in unusual("frf_pc_per_n", typical)]
    implausible = []
    if array is not None:
        d33 = float(to_lab("d33_pc_per_n", array.value))
        implausible = plausibility.of_array(Reason.D33_OF_ARRAY, d33, units_checked=units_checked)
    preloads = [finding for recording in recorded if (finding := _preload_contradiction(recording)) is not None]
    of_gain = gain_findings(dict(zip((item.id for item in recorded), measured, strict=True)))
    return (*defects, *of_gain, *noise_findings(measured), *preloads, *unit_errors, *implausible)


def of_roll_off(behind: RollOff | None, zone: FlatZone) -> list[Finding]:
    """A finding where the band of d33 lies behind a filter."""
    if behind is None:
        return []
    arguments = {**behind.arguments, "low_hz": zone.low_hz, "high_hz": zone.high_hz}
    return [Finding(Reason.BEHIND_FILTER, "", "d33_pc_per_n", arguments)]


def _own_filters(ids: Sequence[str], sensor: Indices, levels: "Levels") -> dict[int, Flag]:
    """By its number, each sensor of several whose lines scatter more than those of the others because they lie behind
    a filter of its own."""
    of_sensors = [np.abs(levels.level * levels.scatter)[sensor == index] for index in range(len(ids))]
    of_line = np.array([np.median(lines) for lines in of_sensors])
    usual = float(np.sort(of_line)[(len(ids) - 1) // 2])
    flags = {}
    for index in np.flatnonzero(of_line > _NOISY * usual).tolist():
        behind = roll_off([one.of(sensor[one.rows] == index) for one in levels.stacks], levels.zone, levels.level)
        if behind is not None:
            flags[index] = Flag(ids[index], Reason.SENSOR_BEHIND_FILTER, behind.arguments)
    return flags


def _preload_contradiction(recording: FrfRecording) -> Finding | None:
    """The finding on a recording whose force has a mean that contradicts the preload."""
    mean = None if recording.force_n is None else mean_of(recording.force_n)
    if mean is None or 1 / _CONTRADICTS <= abs(mean) / recording.preload_n <= _CONTRADICTS:
        return None
    guess = force_unit(mean, recording.preload_n)
    arguments = {"mean_n": mean, "preload_n": recording.preload_n, "guess": guess}
    return Finding(Reason.FORCE_CONTRADICTS_PRELOAD, recording.id, "force_n", arguments)


_LEAST_CHARGE = 1e-24  # least FRF of a measurement [C/N]
_MOST_REASONS = 3  # quoted where no recording can be used


class NoD33(InvalidInput):
    """A campaign from which no d33 can be computed; as text it is the reason."""

    def __str__(self) -> str:
        return self.allowed


@dataclass(frozen=True)
class RecordingD33:
    """Columns (recordings,) in SI: measured level, σ, d33 and its uncertainty by line noise and pick-up; NaN where not
    `inside`."""

    ids: tuple[str, ...]
    sensor: Indices  # number of the sensor in Inversion.sensor_ids
    indenter_radius: Floats
    preload: Floats
    frf: Floats
    frf_uncertainty: Floats
    line_scatter: Floats  # relative
    sigma: Floats
    rel_error: Floats  # of σ, the table's bound
    d33: Floats
    d33_uncertainty: Floats
    inside: Mask  # contact in the table's domain, not far from the sensor; a line in the band with a charge that can be

    @cached_property
    def condition(self) -> Indices:
        """The index of each recording's condition (indenter and preload)."""
        both = np.column_stack([self.indenter_radius, self.preload])
        return np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)


@dataclass(frozen=True)
class Cells:
    """d33 per sensor × indenter × preload that was recorded; arrays over the cells, SI."""

    sensor: Indices
    indenter_radius: Floats
    preload: Floats
    recordings: Indices
    d33: Estimate


@dataclass(frozen=True)
class Levels:
    """What recordings show whatever the contact: Re FRF of each usable one, averaged over the flat zone.

    Attributes
    ----------
    recorded, measured : sequences
        The usable recordings and their lines.
    stacks : sequence of Stack
        These lines without the phase of the charge's chain, of which `phase` [rad] was constant.
    level, noise, scatter : ndarray, (recordings,)
        As `band_average` has them, `scatter` relative, the others [C/N].
    left_out, findings : sequences of Finding
        On recordings that are not used, and on those that are used all the same.
    """

    recorded: Sequence[FrfRecording]
    measured: Sequence[Frf]
    stacks: Sequence[Stack]
    phase: float
    zone: FlatZone
    level: Floats
    noise: Floats
    scatter: Floats
    left_out: Sequence[Finding]
    findings: Sequence[Finding]

    @cached_property
    def behind(self) -> RollOff | None:
        """The filters that attenuate the whole band."""
        return roll_off(self.stacks, self.zone, self.level)


@dataclass(frozen=True)
class Inversion:
    """The array's d33. `campaign_d33` (its interval is relative), `spread` (relative, over sensors), `gain` and
    `position` [m] come from the sensors that are neither dead, inverted, weak, strong nor behind a filter of
    their own; None where there is no such sensor, `campaign_d33` also where it cannot be told."""

    sensor_ids: tuple[str, ...]
    recordings: RecordingD33
    cells: Cells
    sensors: Estimate  # one entry a sensor id, NaN without a usable recording
    flags: tuple[Flag, ...]
    zone: FlatZone
    campaign_d33: Estimate | None
    spread: Estimate | None
    gain: Estimate | None
    position: Estimate | None
    left_out: tuple[Finding | Flag, ...]  # each recording or sensor that the campaign's d33 does without
    findings: tuple[Finding, ...]  # suspicious data that are used all the same
    declared_percent: float  # standard deviation of all d33 together by the tolerances of the skin
    levels: "Levels"

    @property
    def absolute_d33(self) -> Estimate | None:
        """`campaign_d33` with the tolerances of the declared skin, independent of the scatter."""
        return None if self.campaign_d33 is None else self.campaign_d33.wider(self.declared_percent / 100)

    def wider(self, relative: float) -> "Inversion":
        """With a further relative uncertainty common to all its d33."""
        array = None if self.campaign_d33 is None else self.campaign_d33.wider(relative)
        cells = replace(self.cells, d33=self.cells.d33.wider(relative))
        return replace(self, cells=cells, sensors=self.sensors.wider(relative), campaign_d33=array)


def invert(campaign: Campaign, contact_model: ContactModel, band_hz: tuple[float, float] | None = None) -> Inversion:
    """The d33 of an array, Re FRF / ((3/2) ρ² σ) with ρ = rT/h, from the `frf` recordings of a campaign.

    Parameters
    ----------
    campaign : Campaign
        The skin and its recordings.
    contact_model : ContactModel
        The σ table, or the solved contact.
    band_hz : (low, high), optional
        The band that Re FRF is averaged over [Hz]; without it the flat zone.

    Returns
    -------
    Inversion
        d33 of recordings, cells, sensors and array in SI, the recordings and sensors left out, and findings.

    Raises
    ------
    InvalidInput
        No line lies in the band.
    NoD33
        No frf recording lies within the domain of the table, has a line in the flat zone, and any charge.
    """
    return _inverted(campaign, contact_model, _levels(campaign, band_hz))


def _levels(campaign: Campaign, band_hz: tuple[float, float] | None) -> Levels:
    recorded = campaign.of(FrfRecording)
    if not recorded:
        raise NoD33("recordings", campaign.name, "it holds no frequency responses (FRFs), from which d33 is calculated")
    for excess in excesses(campaign.skin):
        raise NoD33(f"skin.{excess.field}", excess.largest, f"skin.{excess.error}")
    measured, recorded, left_out, findings = _measured(recorded, units_checked=campaign.units_checked)
    if not recorded:
        raise _none_usable(campaign, left_out)
    conditions = [(item.indenter_radius_mm, item.preload_n) for item in recorded]
    stacks, delay, phase = without_chain_phase(stacked(measured), conditions)
    zone = flat_zone(stacks, conditions, band_hz)
    level, noise, scatter = band_average(stacks, zone)
    zone = replace(zone, reason=zone.reason + lower_half(stacks, zone, level, noise) + _delayed(delay))
    return Levels(recorded, measured, stacks, phase, zone, level, noise, scatter, left_out, findings)


def _inverted(campaign: Campaign, contact_model: ContactModel, levels: Levels) -> Inversion:
    recorded, measured, zone = levels.recorded, levels.measured, levels.zone
    level, noise = levels.level, levels.noise
    unusual_values = unlikely(campaign, recorded, [frf.frequency for frf in measured])
    slips = [*exchanged_values(campaign.skin, recorded, contact_model), *unusual_values]
    deciding = next((slip for slip in slips if slip.field not in UNUSED_FOR_D33), None)
    if deciding is not None and not campaign.units_checked:
        reason = f"{deciding.field}: {deciding.statement} (if it is meant, set units_checked to true)"
        raise NoD33(deciding.field, campaign.name, reason)
    contact = _Contact(campaign, recorded, contact_model)
    inside = usable(level, noise, contact.positioned.sigma, contact.transmitted)
    reasons = pressed_skin.reasons(recorded, campaign.skin, contact.transmitted, level, contact_model)
    far, of_far = far_contacts(recorded, level, contact.share)
    of_rows = [reason for reason, used in zip(reasons, inside | far, strict=True) if not used]
    left_out = [*levels.left_out, *of_rows, *of_far]
    inside &= ~far
    if not inside.any():
        raise _none_usable(campaign, left_out)
    if np.abs(level[inside]).max() < _LEAST_CHARGE:
        raise NoD33("recordings", campaign.name, "there is no charge in any recording")
    response = gain(contact.positioned.sigma, contact.transmitted.rt_over_h)
    d33 = level / response
    picked_up = (
        PICK_UP * typical_size(d33[inside]) * np.sqrt(np.maximum(np.where(inside, contact.share, 1.0) ** -2 - 1, 0.0))
    )
    uncertainty = np.hypot(noise / np.abs(response), picked_up)
    ids = tuple(dict.fromkeys(item.sensor for item in recorded))
    sensor = np.array([ids.index(item.sensor) for item in recorded])
    rows = RecordingD33(
        ids=tuple(item.id for item in recorded),
        sensor=sensor,
        indenter_radius=to_si("indenter_radius_mm", [item.indenter_radius_mm for item in recorded]),
        preload=to_si("preload_n", [item.preload_n for item in recorded]),
        frf=level,
        frf_uncertainty=noise,
        line_scatter=levels.scatter,
        sigma=np.where(inside, contact.positioned.sigma, np.nan),
        rel_error=contact.transmitted.rel_error,
        d33=np.where(inside, d33, np.nan),
        d33_uncertainty=np.where(inside, uncertainty, np.nan),
        inside=inside,
    )
    common_uncertainty = float(np.median([frf.bias_unsure for frf, good in zip(measured, inside, strict=True) if good]))
    own_filters = {} if levels.behind else _own_filters(ids, sensor, levels)
    noted = noted_conditions(recorded)
    inversion = _estimated(ids, rows, contact, levels, own_filters, noted).wider(common_uncertainty)
    filtered = of_roll_off(levels.behind, zone)
    others = findings_of(recorded, measured, level, inversion.campaign_d33, units_checked=campaign.units_checked)
    at_start = (*at_reading(campaign), *unusual_values, *levels.findings, *_rotated(levels.phase))
    findings = (*at_start, *filtered, *inversion.findings, *others)
    return replace(inversion, left_out=(*left_out, *inversion.left_out), findings=findings)


def _rotated(phase: float) -> list[Finding]:
    """A finding on the constant phase [rad] that was removed; none for 0."""
    degrees = float(np.rad2deg(phase))
    lost = {"phase_deg": degrees, "lost_percent": 100 * (1 - float(np.cos(phase)))}
    return [Finding(Reason.CONSTANT_PHASE, "", "frf_im_pc_per_n", lost)] if phase else []


def _delayed(delay: float) -> str:
    """In words, the removed delay [s], which phases cannot distinguish from a filter; empty without one."""
    if delay == 0.0:
        return ""
    late = "charge" if delay > 0 else "force"
    late_by = f"{in_digits(1e3 * abs(delay), 3)} ms late"
    return f"; the phases turn as if the {late} came {late_by} (a delay, a filter or a resonance), which is taken off"


def _none_usable(campaign: Campaign, left_out: Sequence[Finding]) -> NoD33:
    """The error for a campaign whose recordings are all left out, with the first distinct reasons."""
    by_reason = {finding.statement: finding.sentence for finding in reversed(left_out)}
    reasons = list(by_reason.values())[::-1][:_MOST_REASONS]
    more = f"; and {len(left_out) - len(reasons)} more" if len(left_out) > len(reasons) else ""
    allowed = f"none of the {len(left_out)} recordings can be used: {'; '.join(reasons)}{more}"
    return NoD33("recordings", campaign.name, allowed)


def _measured(
    recorded: Sequence[FrfRecording], *, units_checked: bool
) -> tuple[list[Frf], list[FrfRecording], list[Finding], list[Finding]]:
    """The usable lines of each recording with an FRF, these recordings, findings on the others, and findings on those
    that are used: channels that look exchanged although the units were checked, and forces at the mains alone."""
    recordings, left_out, findings = list[FrfRecording](), list[Finding](), list[Finding]()
    for recording in recorded:
        exchanged = exchanged_channels(recording)
        if exchanged is not None and units_checked:
            findings.append(exchanged)
        elif exchanged is not None:
            left_out.append(replace(exchanged, arguments={**exchanged.arguments, "left_out": True}))
            continue
        slip = _preload_contradiction(recording)
        if slip is not None and slip.arguments["guess"] is not None and not units_checked:
            left_out.append(replace(slip, arguments={**slip.arguments, "left_out": True}))
            continue
        beyond = next((excess for excess in excesses(recording) if not excess.is_faint), None)
        if beyond is not None:
            arguments = {"largest": beyond.largest, "low": beyond.low, "high": beyond.high}
            left_out.append(Finding(Reason.IMPOSSIBLE_RECORDING, recording.id, beyond.field, arguments))
            continue
        recordings.append(recording)
    chosen, refused = chosen_lines(recordings, Reason.NO_FRF)
    spoilt = {name: why for name, lines in chosen.items() if (why := of_spoilt(name, lines)) is not None}
    chosen = {name: lines for name, lines in chosen.items() if name not in spoilt}
    of_each, of_levels = at_two_levels(chosen)
    left_out += [*refused, *spoilt.values(), *of_each.values()]
    chosen = {name: lines for name, lines in chosen.items() if name not in of_each}
    findings += [*of_levels, *excited_at_mains(chosen)]
    used = [recording for recording in recordings if recording.id in chosen]
    return [lines.frf for lines in chosen.values()], used, left_out, findings


class _Contact:
    """The base model's contact of each recording; `declared_percent`: standard deviation of its FRF by the tolerances
    of the skin."""

    def __init__(self, campaign: Campaign, recorded: Sequence[FrfRecording], contact_model: ContactModel) -> None:
        described = campaign.skin
        skin = declared_skin(described)
        indenter = Indenter(to_si("indenter_radius_mm", [item.indenter_radius_mm for item in recorded]))
        preload = to_si("preload_n", [item.preload_n for item in recorded])
        self.transmitted = transmitted = transmission(contact_model, skin, indenter, preload)
        self.thickness = thickness = float(skin.thickness)
        self.positioned = positioned_sigma(
            contact_model,
            transmitted.small_strain_a_over_h,
            float(skin.rt_over_h),
            transmitted.load_parameter,
            contact_offsets(described, recorded) / thickness,
            float(mixed_model.POSITIONS[-1]) / thickness,
        )
        self.share = share_of_contact(self.positioned.sigma, transmitted)  # of the response under the contact
        slopes = log_slopes(contact_model, skin, indenter, preload)
        off = described.tolerances or Tolerances()
        changes = [slopes[name] * getattr(off, f"{name}_percent") for name in DECLARED]
        self.declared_percent = np.linalg.norm(changes, axis=0)


def _estimated(
    ids: tuple[str, ...],
    rows: RecordingD33,
    contact: _Contact,
    levels: Levels,
    filtered: Mapping[int, Flag],
    noted: NotedConditions,
) -> Inversion:
    moments = [contact.positioned.scattered(p / contact.thickness) for p in mixed_model.POSITIONS]
    mean, variance = (np.array(part) for part in zip(*moments, strict=True))
    outliers = outlying(rows, np.sqrt((mean[-1] - 1) ** 2 + np.maximum(variance[-1], 0)))
    far_off = _far_off(ids, rows, outliers)
    good = np.setdiff1d(np.flatnonzero(rows.inside), outliers)
    sensor, d33, noise = rows.sensor[good], rows.d33[good], rows.d33_uncertainty[good]
    unfit, pilot, factor, of_groups = without_groups(
        ids, sensor, d33, noise, *population_flags(ids, sensor, d33, noise)
    )
    beyond_filter = [index for index, flag in unfit.items() if flag.flagged_for != Reason.WEAK]
    unfit |= {index: flag for index, flag in filtered.items() if index not in beyond_filter}
    mean, variance = mean[:, good], variance[:, good]
    plain = np.array([index not in unfit for index in sensor])
    effects = noted.fitted(good[plain], sensor[plain], rows.condition, d33[plain])
    measured = LevelRows(d33 / effects.gain(good, sensor, len(ids)), noise, pilot[sensor], mean, variance)
    model = None
    if plain.any():
        numbered = np.unique(sensor[plain], return_inverse=True)[1]
        over = factor[sensor]
        alike = replace(measured, z=measured.z / over, line=noise / over, pilot=pilot[sensor] / over)
        model = mixed_model.fit(alike.part(plain), numbered)
    scatter = model.scatter if model else mixed_model.prior_scatter()
    cell, where, count = _cells(rows, good)
    unsure = effects.unsure(good, sensor, len(ids))
    sensors = scatter.d33(measured, sensor, len(ids)).wider(unsure)
    flags = [*unfit.values(), *([] if of_groups else difference_flags(ids, sensors, unfit))]
    if model:
        expected = _expected_scatter(model, measured)[plain]
        flags += scatter_flags(ids, sensor[plain], rows, good[plain], pilot, expected)
    of_scatter = _scatter_finding(model) if model else None
    of_array = {finding.reason for finding in (*of_groups, *levels.findings, *([of_scatter] if of_scatter else []))}
    return Inversion(
        sensor_ids=ids,
        recordings=rows,
        cells=Cells(
            rows.sensor[where], rows.indenter_radius[where], rows.preload[where], count,
            scatter.d33(measured, cell, len(where)).wider(unsure[rows.sensor[where]]),
        ),
        sensors=sensors,
        flags=tuple(flags),
        zone=levels.zone,
        campaign_d33=model.mean if model and of_array.isdisjoint(_AGAINST_ARRAY) else None,
        spread=model.spread if model and not of_groups and len(set(sensor[plain])) > 1 else None,
        gain=model.gain if model else None,
        position=model.position if model else None,
        left_out=(*far_off, *unfit.values()),
        findings=(*of_groups, *effects.findings(good, sensor, len(ids)), *([of_scatter] if of_scatter else [])),
        declared_percent=float(np.nanmedian(contact.declared_percent[good])),
        levels=levels,
    )  # fmt: skip


def _scatter_finding(model: MixedModel) -> Finding | None:
    """The finding on a gain that scatters by more than on a poor rig, or up to the most that is considered."""
    percent, usual = 100 * float(model.gain.value), mixed_model.GAIN_RANGE[1]
    if float(model.gain.high) >= mixed_model.GAINS[-1]:
        return Finding(Reason.SCATTER_AT_LIMIT, "", "frf", {"percent": percent})
    arguments = {"percent": percent, "usual": 100 * usual}
    return Finding(Reason.UNUSUAL_SCATTER, "", "frf", arguments) if float(model.gain.low) > usual else None


def _expected_scatter(model: MixedModel, rows: LevelRows) -> Floats:
    """The relative scatter of each recording, line noise included."""
    nearest = int(np.argmin(np.abs(mixed_model.POSITIONS - float(model.position.value))))
    position = np.maximum(rows.position_variance[nearest], 0)
    return np.sqrt(float(model.gain.value) ** 2 + position + (rows.line / rows.pilot) ** 2)


def _cells(rows: RecordingD33, good: Indices) -> tuple[Indices, Indices, Indices]:
    """The cell of each good row; for each cell a representative row, and its number of recordings."""
    keys = np.column_stack([rows.sensor, rows.indenter_radius, rows.preload])[good]
    _, where, cell, count = np.unique(keys, axis=0, return_index=True, return_inverse=True, return_counts=True)
    return cell.reshape(-1), good[where], count


def array_d33_by_other(
    campaign: Campaign, table: SigmaTable, inversion: Inversion, requested: ContactName = "paper"
) -> Estimate | None:
    """`absolute_d33` by the other contact model; None where there is none, or it differs by at most 1 %.

    Parameters
    ----------
    campaign
        The data of `inversion`, which used the contact model `requested`.
    table
        The σ table, with the contact table in the same folder; raises TableError where that cannot be read.
    """
    estimate = inversion.absolute_d33
    if estimate is None:
        return None
    try:
        other = _inverted(campaign, contact_model(table, OTHER[requested]), inversion.levels).absolute_d33
    except InvalidInput:  # all recordings lie outside its domain
        return None
    return other if other is not None and abs(other.value / estimate.value - 1) > STATED else None

"""What a campaign declares of its skin, and of all its recordings alike, that no skin and no rig has.

An unlikely magnitude looks like a slip of units: nothing in the campaign says otherwise, and every law of contact would
be tried on a wrong force or modulus. It is named in any case, and nothing is concluded from it, until it is corrected
or `units_checked` says that it is meant.
"""

from collections.abc import Sequence

import numpy as np

from underskin import units
from underskin.diagnosis.data.axes import hours
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.finding import Finding
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.plausibility import pitch_mm

_PRELOADS_N = (0.01, 150.0)  # the highest preload of a campaign, and the lowest
_FREQUENCIES_HZ = (0.5, 2e4)  # the highest line of a campaign
_LEAST_PAUSE_S = 5.0  # no sweep is made in less
_SLOW_HZ = (0.02, 5.0)  # a sweep from below the one to no more than the other: a minute and more for each period
_ELASTOMERS_MPA = (0.02, 300.0)  # from gels to the hardest polyurethanes
_WIDEST_PITCH_MM = 300.0
_GEOMETRY = ("thickness_mm", "sensor_radius_mm", "width_mm", "length_mm")
_SLIP = 1000.0


def unlikely(campaign: Campaign, entries: Sequence[FrfRecording]) -> list[Finding]:
    """Magnitudes of the skin, and shared by all recordings, that look like a slip of units."""
    return [*_of_skin(campaign), *_of_recordings(entries)]


def _of_skin(campaign: Campaign) -> list[Finding]:
    skin = campaign.skin
    assert skin.youngs_modulus_mpa is not None
    found = []
    low, high = _ELASTOMERS_MPA
    modulus = skin.youngs_modulus_mpa
    if not low <= modulus <= high:
        word, guess = ("stiffer", "kPa") if modulus > high else ("softer", "GPa")
        text = f"{modulus:g} MPa is {word} than elastomers are ({low:g} to {high:g} MPa): was it given in {guess}?"
        found.append(_slip("skin.youngs_modulus_mpa", text))
    for name in _GEOMETRY:
        value = getattr(skin, name)
        found += [_slip(f"skin.{name}", entry.statement) for entry in units.findings(name, value or 1.0)]
    pitch = pitch_mm(campaign)
    if pitch is not None and pitch > _WIDEST_PITCH_MM:
        found.append(_slip("skin.sensors", f"no two sensors lie nearer than {pitch:g} mm: were places given in µm?"))
    return found


def _of_recordings(entries: Sequence[FrfRecording]) -> list[Finding]:
    preload = np.array([entry.preload_n for entry in entries])
    found = []
    if preload.max() < _PRELOADS_N[0]:
        text = f"no preload is above {preload.max():g} N: they look 1000 × too small; were they given in kN?"
        found.append(_slip("preload_n", text))
    if preload.min() > _PRELOADS_N[1]:
        text = f"no preload is below {preload.min():g} N: they look 1000 × too large; were they given in mN?"
        found.append(_slip("preload_n", text))
    sphere = float(np.median([entry.indenter_radius_mm for entry in entries]))
    found += [_slip("indenter_radius_mm", entry.statement) for entry in units.findings("indenter_radius_mm", sphere)]
    return [*found, *_of_frequencies(entries)]


def _of_frequencies(entries: Sequence[FrfRecording]) -> list[Finding]:
    lines = [lines_of(entry).frequency for entry in entries]
    lowest, highest = min(float(own.min()) for own in lines), max(float(own.max()) for own in lines)
    slow = lowest < _SLOW_HZ[0] and highest < _SLOW_HZ[1]
    for wrong, word, unit in (
        (highest > _FREQUENCIES_HZ[1], "large", "mHz"),
        (slow or highest < _FREQUENCIES_HZ[0], "small", "kHz"),
    ):
        if wrong:
            text = (
                f"frequencies are {lowest:g} to {highest:g} Hz: they look 1000 × too {word}; were they given in {unit}?"
            )
            return [_slip("frequency_hz", text)]
    pause = _pause_s(entries)
    if pause is not None and pause * lowest < 1 and _SLIP * highest <= _FREQUENCIES_HZ[1]:
        text = (
            f"no period of {lowest:g} Hz fits into the {pause:.3g} s after which, by recorded_at, the next recording "
            "follows: are they 1000 × too small, given in kHz?"
        )
        return [_slip("frequency_hz", text)]
    return []


def _pause_s(entries: Sequence[FrfRecording]) -> float | None:
    """From one recording of a sensor to its next, as a rule; what is stamped within seconds was made together."""
    times = [entry.recorded_at for entry in entries]
    if None in times:
        return None
    seconds = 3600 * hours(times)
    sensors = np.array([entry.sensor for entry in entries])
    steps = np.concatenate([np.diff(np.sort(seconds[sensors == name])) for name in np.unique(sensors)])
    pauses = steps[steps >= _LEAST_PAUSE_S]
    return float(np.median(pauses)) if len(pauses) else None


def _slip(field: str, text: str) -> Finding:
    return Finding("units_off_by_1000", "", field, text)

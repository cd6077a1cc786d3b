"""English sentences of findings whose words depend on their arguments, for the table in `english`.

Also the types of arguments that are more than a number or a name.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from underskin.findings.formatting import in_digits, significant


@dataclass(frozen=True)
class UnitGuess:
    """The slip of units that explains an unusual magnitude.

    `size` in the field's `unit` is corrected to each value of `meant`, in that unit, if it was given in the paired
    unit; or to the only value, paired with an empty unit, if it is off by ten to the power of `off_by`. If empty, no
    slip explains it; a size of 0 is a measured value of 0.
    """

    size: float
    unit: str
    meant: tuple[tuple[float, str], ...] = ()
    off_by: int = 0


class ImplausibleD33(StrEnum):
    """Why a d33 is implausible."""

    TOO_LARGE = "too_large"
    TOO_SMALL = "too_small"
    NEGATIVE = "negative"
    NOT_PVDF = "not_pvdf"


class DefectKind(StrEnum):
    """The kind of damage of a run of samples."""

    OVERLOAD = "overload"
    HELD_SAMPLES = "held_samples"
    JUMP = "jump"


_MOST_SENSORS = 3  # named one by one
_MOST_LISTED = 6

IMPLAUSIBLE_D33: Mapping[ImplausibleD33, str] = {
    ImplausibleD33.TOO_LARGE: "more than sensors have: was mV/pC meant, not mV/nC, or N, not mN, or fC, not pC?",
    ImplausibleD33.TOO_SMALL: "less than sensors have: was mV/nC meant, not mV/pC, or mN, not N, or nC, not pC?",
    ImplausibleD33.NEGATIVE: "negative: is the sign of charge or force turned?",
    ImplausibleD33.NOT_PVDF: "which PVDF cannot have: it and its copolymers have 10 to 40",
}
DEFECTS: Mapping[DefectKind, str] = {
    DefectKind.OVERLOAD: "stay at the end of the range: overload",
    DefectKind.HELD_SAMPLES: "repeat one value: samples were dropped and the last one held",
    DefectKind.JUMP: "break the signal's course: samples were dropped, or a spike",
}


def unit_guess(guess: UnitGuess) -> str:
    """The slip that would explain an unusual magnitude, in words."""
    if guess.size == 0:
        return "a dead sensor?"
    if not guess.meant:
        return "no unit that we know explains it"
    if guess.off_by:
        return f"off by a factor of 10^{guess.off_by}? {guess.meant[0][0]:g} {guess.unit} would be usual"
    was = ", ".join(f"{guess.size:g} {given_in} is {meant:g} {guess.unit}" for meant, given_in in guess.meant)
    return f"{was}: was it given in {' or '.join(given_in for _, given_in in guess.meant)}?"


def defect(kind: DefectKind, channel: str, samples: int, first_sample: int) -> str:
    """A run of damaged samples."""
    return f"{channel}: {samples} samples from sample {first_sample} {DEFECTS[kind]}"


def defects_left_out(kind: DefectKind, channel: str, samples: int, first_sample: int, more: int) -> str:
    """The first of several runs of damaged samples, and the number of further ones."""
    others = f"; {more} more like it" if more else ""
    return f"{defect(kind, channel, samples, first_sample)}{others}: those parts were left out"


def counted_negative(fields: Sequence[str], more: int, may_be_pulled: bool) -> str:
    """Force, displacement or both fall during loading."""
    named = " and ".join({"force_n": "force", "displacement_mm": "displacement"}[name] for name in fields)
    are, channel = ("are", "those channels") if len(fields) > 1 else ("is", "that channel")
    negative = f"{named} {are} counted negative as it is pressed, where compression and depth count positive"
    unless = (
        ": right for a sample that is pulled, else reverse the signs of both channels"
        if may_be_pulled
        else f"; turned round here, reverse the sign of {channel}"
    )
    return f"{negative}{unless}{more_alike(more, 'recording')}"


def rows_reversed(is_timed: bool) -> str:
    """A curve whose rows start at its deep end."""
    times = ", without its times, since a way out alone does not tell what relaxes" if is_timed else ""
    return f"its rows begin where it is deepest and end in the air: it was read from the last row to the first{times}"


def force_saturates(percent: float, samples: int, limits_n: Sequence[float]) -> str:
    """A force channel at the end of its range."""
    limits = " or ".join(f"{limit:.4g} N" for limit in limits_n)
    return (
        f"the force channel saturates: {samples} samples, {percent:.2g} % of all, read {limits} while the travel goes "
        "on; they were left out (record with a larger range)"
    )


def thickness_unknown(answer: str, is_tried: bool) -> str:
    """An undeclared thickness, and what it leaves open."""
    layer = "a thin layer on a stiff base (layered contact)"
    undeclared = "the thickness of the sample is not declared"
    if answer == "layered contact":
        alike = "a thick sample that stiffens with strain can look alike"
        return f"{undeclared}: that of {layer} was fitted, and {alike}; declare thickness_mm"
    tried = "whose thickness was fitted" if is_tried else "which was not tried"
    return f"{undeclared}, and {layer}, {tried}, stiffens a curve much like {answer}: declare thickness_mm"


def size(too_large: bool) -> str:
    """The direction of a slip."""
    return "large" if too_large else "small"


def more_alike(count: int, noun: str) -> str:
    """The number of further cases, in brackets; empty for 0."""
    return f" ({count} more {noun}{'s' if count > 1 else ''} like it)" if count else ""


def more_rows(count: int, noun: str = "rows") -> str:
    """The number of further rows, in brackets; empty for 0."""
    return f" ({count} more {noun} like it)" if count else ""


def listed_sensors(ids: Sequence[str]) -> str:
    """Some sensors by their ids."""
    if len(ids) > _MOST_SENSORS:
        return f"sensors {', '.join(ids[:_MOST_SENSORS])} and {len(ids) - _MOST_SENSORS} more"
    return f"sensors {', '.join(ids[:-1])} and {ids[-1]}"


def listed(ids: Sequence[str], noun: str) -> str:
    """The first ids of a list, and the number of further ones."""
    if len(ids) > _MOST_LISTED:
        return f"{noun} {', '.join(ids[:_MOST_LISTED])} and {len(ids) - _MOST_LISTED} more"
    return f"{noun if len(ids) > 1 else noun.removesuffix('s')} {', '.join(ids)}"


def all_conjugated(lag_us: float | None) -> str:
    """All FRFs in the other sign convention, or a force channel that lags."""
    if lag_us is not None:
        return (
            "the phase over frequency leads: either the FRFs are conjugated, in the convention e^(-iωt), or the force "
            f"channel lags by {float(f'{lag_us:.2g}'):g} µs; these recordings cannot tell which, and nothing was "
            "changed"
        )
    return (
        "the phase over frequency is one that no sensor or amplifier can have unless its sign is reversed: the FRFs "
        "look conjugated, in the convention e^(-iωt); all were conjugated back"
    )


def amplitude_factor(factor: float, meant: str, of: Sequence[str], recordings: int, left_out: int) -> str:
    """Some recordings that differ from the others by a fixed factor."""
    untold = f"; {left_out} that do not tell were left out" if left_out else ""
    return (
        f"the response of {len(of)} of {recordings} recordings is {factor:.3g} times the others': is their dynamic "
        f"force or charge given as {meant} instead of peak? Put right by this factor ({listed(of, 'recordings')})"
        f"{untold}"
    )


def unusual(value: float, unit: str, guess: UnitGuess, more: int) -> str:
    """A value of unusual magnitude."""
    return f"{value:g} {unit} is unusual: {unit_guess(guess)}{more_rows(more)}"


def elastomer(modulus_mpa: float, low_mpa: float, high_mpa: float, guess: UnitGuess) -> str:
    """A modulus that no elastomer has."""
    word = "stiffer" if modulus_mpa > high_mpa else "softer"
    usual = f"({low_mpa:g} to {high_mpa:g} MPa)"
    return f"{modulus_mpa:g} MPa is {word} than elastomers are {usual}: {unit_guess(guess)}"


def needed_modulus(against: str) -> Callable[..., str]:
    """Words for curves whose apparent modulus is far from `against`."""

    def words(modulus_mpa: float, slips: Sequence[str], **bounds: float) -> str:
        guess = f"{', or '.join(slips)}?" if slips else "are force, displacement and size in the units that were said?"
        needed = f"force and displacement would need a modulus of about {modulus_mpa:.2g} MPa"
        return f"{needed}: {guess} {against.format(**bounds)}"

    return words


def periodic_error(period_mm: float, amplitude_n: float, percent: float, frequency_hz: float | None = None) -> str:
    """A sine over the travel in the force; for a monotonic curve, `frequency_hz` is its frequency in time."""
    or_hum = "" if frequency_hz is None else f"; or hum, or a vibration of {frequency_hz:.3g} Hz"
    return (
        "the force carries an error that is periodic in the travel, in the air as well: period "
        f"{period_mm:.3g} mm, amplitude {amplitude_n:.2g} N, {percent:.2g} % of the range of force (optical "
        f"interference, a screw or an encoder{or_hum}); it was subtracted"
    )


def preload_and_radius_exchanged(beyond: int, recordings: int) -> str:
    """Loads beyond the tables that would lie within them with preload and sphere exchanged."""
    return (
        "the spheres are pressed harder than the tables hold, or preload_n and indenter_radius_mm are exchanged: "
        f"L = F/(R²E) of {beyond} of {recordings} contacts is beyond the tables, and within if they are exchanged"
    )


def frequencies(lowest_hz: float, highest_hz: float, too_large: bool, given_in: str) -> str:
    """Frequencies of an unlikely magnitude."""
    range_ = f"frequencies are {lowest_hz:g} to {highest_hz:g} Hz"
    return f"{range_}: they look 1000 × too {size(too_large)}; were they given in {given_in}?"


def response_slip(too_large: bool) -> str:
    """A response of the wrong magnitude."""
    return "1000 × too large: pC taken for nC, or N for mN?" if too_large else "1000 × too small: nC taken for pC?"


def d33_needed(d33_pc_per_n: float, declared_pc_per_n: float | None, too_large: bool) -> str:
    """A d33 that the response would need."""
    declared = f", where {declared_pc_per_n:g} is declared" if declared_pc_per_n else ""
    needed = f"charge over force would need a d33 of {d33_pc_per_n:.3g} pC/N{declared}"
    return f"{needed}; it looks {response_slip(too_large)}"


def thousandfold(too_small: bool) -> str:
    """The factor that corrects a place."""
    return "a thousandfold" if too_small else "divided by 1000"


def within_tables(larger: bool, given_in: str) -> str:
    """A field that would bring the contacts within the tables."""
    word = "larger" if larger else "smaller"
    return f"were it 1000 × {word}, contacts would lie within the tables: was it given in {given_in}?"


def beside_others(value: float, too_large: bool, given_in: str) -> str:
    """A value of another magnitude than those of the other recordings."""
    return f"{value:g} looks 1000 × too {size(too_large)} beside the others: was it given in {given_in}? Left out"


def of_series(words: Callable[..., str]) -> Callable[..., str]:
    """Words for a contradiction within a time series: of a rejected recording, of a used one, or of all as in an
    `example`."""

    def in_scope(*, left_out: bool = False, example: str = "", **arguments: Any) -> str:
        text = words(**arguments)
        return f"in all recordings, as in {example}: {text}" if example else f"{text} Left out" if left_out else text

    return in_scope


def swapped(force_mean_n: float, charge_mean_pc: float, preload_n: float) -> str:
    """Force and charge exchanged."""
    return (
        f"its mean is {force_mean_n:.3g} N, and that of charge_pc {charge_mean_pc:.3g}, where preload_n is "
        f"{preload_n:g}: force and charge look exchanged."
    )


def series_force(oscillation_n: float, dynamic_force_n: float, too_large: bool, given_in: str) -> str:
    """A force whose oscillation contradicts the dynamic force."""
    text = f"it is shaken by {oscillation_n:.3g} N, where dynamic_force_n is {dynamic_force_n:g}"
    return f"{text}: it looks 1000 × too {size(too_large)}; was it given in {given_in}?"


def series_dynamic_force(dynamic_force_n: float, too_large: bool, given_in: str) -> str:
    """A dynamic force that contradicts the recorded force."""
    text = f"{dynamic_force_n:g} N looks 1000 × too {size(too_large)} beside the recorded force"
    return f"{text}: was it given in {given_in}?"


def series_preload(preload_n: float, mean_n: float, too_large: bool, given_in: str) -> str:
    """A preload that contradicts the recorded force."""
    reference = f"beside the recorded force's mean of {mean_n:.3g} N"
    return f"{preload_n:g} N looks 1000 × too {size(too_large)} {reference}: was it given in {given_in}?"


def one_place(sensors: Sequence[str], x_mm: float, y_mm: float, more: int) -> str:
    """Sensors at one place."""
    position = f"x {x_mm:g} mm, y {y_mm:g} mm"
    return f"{listed_sensors(sensors)} lie at one place, {position}: is it a slip?{more_alike(more, 'place')}"


def too_near(sensors: Sequence[str], radius_mm: float, pitch_mm: float, in_metres: bool) -> str:
    """Sensors nearer to each other than their radius allows."""
    guess = "were their places given in m" if in_metres else "is it the diameter"
    return f"{listed_sensors(sensors)} of {radius_mm:g} mm radius cannot lie {pitch_mm:g} mm apart: {guess}, or a slip?"


def lines_left_out(faint: int, measured: int, recordings: int, beside: int) -> str:
    """Lines where the force has little power."""
    of = "one recording" if recordings == 1 else f"{recordings} recordings"
    beyond = f"; so are {beside} whose noise the next line shares" if beside else ""
    why = "the force has little power there, or the charge does not follow it"
    return f"{faint} of {measured} lines of {of} are left out: {why}{beyond}"


def mains_in_charge(affected: int, recordings: int, mains_hz: float, charge_pc: float) -> str:
    """Mains on the charge."""
    return (
        f"in {affected} of {recordings} recordings the charge stands out at {mains_hz:g} Hz or a multiple of it by "
        f"about {significant(charge_pc, 2)} pC, and the force does not: mains pickup? The lines there are left out"
    )


def noise_in_frf(percent: float, estimator: str, unsure_percent: float) -> str:
    """Noise that biases an estimator."""
    channel = {"H1": "the force", "H2": "the charge", "Hv": "force and charge"}[estimator]
    size = "small" if percent < 0 else "large"
    text = f"noise in {channel} makes {estimator} too {size} by {in_digits(abs(percent), 2)} %: that was taken off"
    return f"{text}; ± {in_digits(unsure_percent, 2)} % of the FRFs stays open" if unsure_percent >= 0.1 else text


def behind_filter(high_pass_hz: float, low_pass_hz: float, percent: float, low_hz: float, high_hz: float) -> str:
    """A band behind filters."""
    filters = [f"a high-pass of about {in_digits(high_pass_hz, 2)} Hz"] if high_pass_hz > 0 else []
    filters += [f"a low-pass of about {in_digits(low_pass_hz, 2)} Hz"] if low_pass_hz < float("inf") else []
    return (
        f"from {low_hz:.4g} to {high_hz:.4g} Hz the response is that behind {' and '.join(filters)}, and does not "
        f"reach its plateau: d33 is too small by about {in_digits(percent, 2)} %, and not to be quoted; a diagnosis "
        "takes the filter into account, or record a band further off its corner"
    )


def parameter_at_bound(mechanism: str, parameter: str, low: float, high: float, unit: str) -> str:
    """A parameter at the end of its range."""
    limits = f"{low:g} to {high:g} {unit.strip('-')}".rstrip()
    called = parameter.replace("_", " ")
    return f"{mechanism}: {called} lies at or beyond an end of its search ({limits}), which is no result"


def line_noise(level: float) -> str:
    """Lines that scatter more about the answer than about their neighbours."""
    return (
        f"the lines scatter {in_digits(level, 2)} times more about the stated answer than about their own neighbours: "
        "part of the misfit along frequency may have been taken for noise"
    )


def held_out(groups: Sequence[str], mechanisms: Sequence[str], before_percent: float, after_percent: float) -> str:
    """Mechanisms that predict held-out groups no better."""
    omitted = " and ".join(groups) if len(groups) <= 2 else f"each of {len(groups)} parts in turn"
    before, after = (float(f"{percent:.4g}") for percent in (before_percent, after_percent))  # as the report has them
    return (
        f"what was left out ({omitted}) is predicted no better with {' and '.join(mechanisms)}: "
        f"{before:.3g} % before, {after:.3g} % after; do not extrapolate with it"
    )


def no_simple_law(
    tried: int, law: str = "", part: str = "", after_percent: float = 0.0, before_percent: float = 0.0
) -> str:
    """The held-out prediction by the best of the laws of one form over one axis."""
    if not law:
        return f"none of {tried} simple laws of one quantity over one axis gains anything"
    if after_percent >= before_percent:
        return (
            f"none of {tried} simple laws of one quantity over one axis predicts {part} held out better than without "
            f"it: the nearest, {law}, predicts them to {after_percent:.2g} % instead of {before_percent:.2g} %"
        )
    return (
        f"none of {tried} simple laws of one quantity over one axis stands out enough to be stated: the nearest, "
        f"{law}, predicts {part} held out to {after_percent:.2g} % instead of {before_percent:.2g} %"
    )


def load_not_linear(load_parameter: float, more: int) -> str:
    """A load beyond the linear layer."""
    return (
        f"L = F/(R²E) is {load_parameter:.2g}: the layer is linear here, and finite strain is left out; it adds up to "
        f"1.3 % at L = 0.01 and 3 % at L = 0.1 to the stress on a sensor beneath a sphere{more_rows(more, 'contacts')}"
    )


def contact_slips(ratio: float, more: int) -> str:
    """A tangential force above the normal one."""
    text = f"the tangential force is {ratio:.3g} times the normal one: it slips unless friction is stronger"
    return f"{text}{more_rows(more, 'contacts')}"


def contacts_kept(contacts: int, recordings: int, declared_mpa: float, found_mpa: float | None, answer: str) -> str:
    """Contacts within the tables by the fitted values and not by the declared ones; `found_mpa` is None where no
    modulus was fitted."""
    condition = f"with the values found for {answer}" if found_mpa is None else f"at the {found_mpa:.3g} MPa found"
    number = f"{contacts} of {recordings} contacts"
    return f"by the declared {declared_mpa:g} MPa {number} lie beyond the tables, {condition} they lie within: kept"


_AS_A_SLIP = 0.05  # largest difference of the logarithm of a factor from that of 2 or 1/2


def sensor_alone(sensor: str, share: float, recordings: int) -> str:
    """A sensor whose level differs from the common one of the others."""
    doubled = min(abs(math.log(share / 2)), abs(math.log(2 * share))) < _AS_A_SLIP
    causes = "its own d33, its cable, or peak-to-peak beside amplitudes" if doubled else "its own d33 or its cable"
    return (
        f"sensor {sensor!r} responds with {share:.2f} times the others' charge, and they are alike: {causes}; "
        f"taken to their level by this factor ({recordings} recordings)"
    )


def cables_exchanged(first: str, second: str, since: str, recordings: int) -> str:
    """Two sensors' cables exchanged from some recording on."""
    text = f"from recording {since!r} on, in the order of time, sensors {first!r} and {second!r} answer as each other"
    return f"{text}: their cables look exchanged; put right ({recordings} recordings)"


def labels_permuted(sensors: Sequence[str], places: Sequence[str], since: str | None, recordings: int) -> str:
    """More than two sensors, each of which answers where another one was pressed."""
    start = f"from recording {since!r} on, in the order of time, " if since else ""
    moved = ", ".join(f"{sensor!r} where {place!r} was pressed" for sensor, place in zip(sensors, places, strict=True))
    return (
        f"{start}{len(sensors)} sensors answer where another one of them was pressed ({moved}): their labels or "
        f"cables look rotated, as by a plug that is off by one; put right ({recordings} recordings)"
    )


def labels_contradict_places(sensors: Sequence[str], recordings: int) -> str:
    """Sensors that respond where others were pressed, without an exchange that explains all of it."""
    answer = f"{listed(sensors, 'sensors')} answer{'s' if len(sensors) == 1 else ''} where others were pressed"
    return f"{answer}, and no exchange explains it: labels or places are wrong; left out ({recordings} recordings)"


def silent_together(first: str, second: str, since: str, recordings: int) -> str:
    """Two sensors that show no response from some recording on."""
    return (
        f"sensors {first!r} and {second!r} both show no response since recording {since!r}, in the order of time: "
        f"cables exchanged, or a connector or amplifier that they share; left out ({recordings} recordings)"
    )

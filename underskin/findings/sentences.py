"""Sentences of findings whose words depend on the arguments, and the types of arguments that say their own words."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from underskin.findings.formatting import in_digits


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

    @property
    def units(self) -> tuple[str, ...]:
        """The units in which it may have been given."""
        return tuple(unit for _, unit in self.meant if unit)

    def __str__(self) -> str:
        """The slip in words."""
        if self.size == 0:
            return "a dead sensor?"
        if not self.meant:
            return "no unit that we know explains it"
        if self.off_by:
            return f"off by a factor of 10^{self.off_by}? {self.meant[0][0]:g} {self.unit} would be usual"
        was = ", ".join(f"{self.size:g} {given_in} is {meant:g} {self.unit}" for meant, given_in in self.meant)
        return f"{was}: was it given in {' or '.join(given_in for _, given_in in self.meant)}?"


class ImplausibleD33(StrEnum):
    """Why a d33 is implausible."""

    TOO_LARGE = "too_large"
    TOO_SMALL = "too_small"
    NEGATIVE = "negative"
    NOT_PVDF = "not_pvdf"

    @property
    def words(self) -> str:
        """Why, and what may be wrong."""
        return {
            self.TOO_LARGE: "more than sensors have: was mV/pC meant, not mV/nC, or N, not mN, or fC, not pC?",
            self.TOO_SMALL: "less than sensors have: was mV/nC meant, not mV/pC, or mN, not N, or nC, not pC?",
            self.NEGATIVE: "negative: is the sign of charge or force turned?",
            self.NOT_PVDF: "which PVDF cannot have (it and its copolymers have 10 to 40), and not to be quoted unless "
            "units_checked confirms it",
        }[self]


class DefectKind(StrEnum):
    """What a run of damaged samples does."""

    OVERLOAD = "overload"
    LIMITED = "limited"
    ONE_VALUE = "one_value"
    HELD_SAMPLES = "held_samples"
    JUMP = "jump"

    @property
    def words(self) -> str:
        """What the samples do."""
        return {
            DefectKind.OVERLOAD: "stay at the end of the range: overload",
            DefectKind.LIMITED: "follow the force less the further they go, as behind a limit: overload",
            DefectKind.ONE_VALUE: "are all one value: a dead sensor, or a channel that is not connected",
            DefectKind.HELD_SAMPLES: "repeat one value: samples were dropped and the last one held",
            DefectKind.JUMP: "break the signal's course: samples were dropped, or a spike",
        }[self]


_MOST_CURVES = 6  # with their moduli, in a sentence
_MOST_LISTED = 6


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


def force_saturates(percent: float, samples: int, limits_n: Sequence[float]) -> str:
    """A force channel at the end of its range."""
    limits = " or ".join(f"{limit:.4g} N" for limit in limits_n)
    return (
        f"the force channel saturates: {samples} samples, {percent:.2g} % of all, read {limits} while the travel goes "
        "on; they were left out (record with a larger range)"
    )


def contact_events(events: Mapping[str, Mapping[str, float | None]]) -> str:
    """Snap-in and pull-off of a sphere, with place, time and force."""
    parts = []
    for name, verb, how in (("snap_in", "snaps in", "to"), ("pull_off", "comes off", "from")):
        if name in events:
            at = events[name]
            time = "" if at["time_s"] is None else f" ({at['time_s']:.4g} s)"
            parts.append(f"{verb} at {at['displacement_mm']:.6g} mm{time}, {how} {at['force_n']:.3g} N against the air")
    return f"the sphere {' and '.join(parts)}: the samples of these events count for no law"


def far_contacts(recordings: int, expected_percent: float, read_percent: float, pick_up_percent: float) -> str:
    """Recordings of sensors that feel less of the contact than usual pick-up."""
    are, they, sensors = ("are", "they read", "sensors") if recordings > 1 else ("is", "it reads", "a sensor")
    read = "" if math.isnan(read_percent) else f"; {they} {in_digits(read_percent, 2)} %"
    return (
        f"{recordings} recording{'s' * (recordings > 1)} of {sensors} far from the contact {are} not used: by the "
        f"model at most {in_digits(expected_percent, 2)} % of the response under the contact arrives there, less than "
        f"usual cross-talk and pick-up ({pick_up_percent:.2g} %){read}; cross-talk is not fitted to them"
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


def thickness_differs(
    declared_mm: float, value_mm: float, low_mm: float, high_mm: float, modulus_mpa: float, *, better: bool
) -> str:
    """A layer of another thickness than the declared one, which the curves show as well."""
    value, low, high = (in_digits(end, 3) for end in (value_mm, low_mm, high_mm))
    how = "better than" if better else "about as well as"
    return (
        f"the thickness may not be the declared {declared_mm:g} mm: a layer of {value} mm ({low} to {high}) on a stiff "
        f"base describes these curves {how} the stated answer, with a Young's modulus of {modulus_mpa:.3g} MPa"
    )


def curves_differ(ids: Sequence[str], factors: Sequence[float], remedies: Sequence[str]) -> str:
    """Curves whose moduli contradict each other."""
    why = (
        f"they agree if {' or if '.join(remedies)}"
        if remedies
        else "the sample differs from place to place, or a radius, a size or a range is not what is declared"
    )
    return f"the moduli of the curves differ by more than a poor rig scatters ({_times_mean(ids, factors)}): {why}"


def specimens_differ(ids: Sequence[str], factors: Sequence[float]) -> str:
    """Blocks of several shapes whose moduli differ as specimens may, and as held ends make them."""
    return (
        f"the moduli of the blocks differ ({_times_mean(ids, factors)}): specimens of one elastomer may, and platens "
        "that hold the ends raise those of the flatter ones: press samples of three heights, or oil the ends"
    )


def _times_mean(ids: Sequence[str], factors: Sequence[float]) -> str:
    each = ", ".join(f"{name} {factor:.2f}" for name, factor in zip(ids[:_MOST_CURVES], factors, strict=False))
    return f"times their mean: {each}{' …' if len(ids) > _MOST_CURVES else ''}"


def more_alike(count: int, noun: str) -> str:
    """The number of further cases, in brackets; empty for 0."""
    return f" ({count} more {noun}{'s' if count > 1 else ''} like it)" if count else ""


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


def elastomer(modulus_mpa: float, low_mpa: float, high_mpa: float, guess: UnitGuess) -> str:
    """A modulus that no elastomer has."""
    word = "stiffer" if modulus_mpa > high_mpa else "softer"
    usual = f"({low_mpa:g} to {high_mpa:g} MPa)"
    return f"{modulus_mpa:g} MPa is {word} than elastomers are {usual}: {guess}"


def lines_left_out(faint: int, measured: int, recordings: int, beside: int) -> str:
    """Lines where the force has little power."""
    of = "one recording" if recordings == 1 else f"{recordings} recordings"
    beyond = f"; so are {beside} whose noise the next line shares" if beside else ""
    why = "the force has little power there, or the charge does not follow it"
    return f"{faint} of {measured} lines of {of} are left out: {why}{beyond}"


_STATED_PERCENT = 0.1  # of an FRF: less is not worth a word


def noise_in_frf(percent: float, estimator: str, unsure_percent: float) -> str:
    """Noise that biases an estimator."""
    channel = {"H1": "the force", "H2": "the charge", "Hv": "force and charge"}[estimator]
    size = "small" if percent < 0 else "large"
    if abs(percent) < _STATED_PERCENT:
        either = "noise in force or charge, which these lines do not tell apart, may bias"
        return f"{either} {estimator}: ± {in_digits(unsure_percent, 2)} % of the FRFs stays open"
    changed = "raised" if percent < 0 else "lowered"
    by = f"{in_digits(abs(percent), 2)} %"
    text = f"noise in {channel} makes {estimator} too {size}: FRFs and d33 were {changed} by {by}"
    return (
        f"{text}; ± {in_digits(unsure_percent, 2)} % of the FRFs stays open"
        if unsure_percent >= _STATED_PERCENT
        else text
    )


def _filters(high_pass_hz: float, low_pass_hz: float) -> str:
    filters = [f"a high-pass of about {in_digits(high_pass_hz, 2)} Hz"] if high_pass_hz > 0 else []
    filters += [f"a low-pass of about {in_digits(low_pass_hz, 2)} Hz"] if low_pass_hz < float("inf") else []
    return " and ".join(filters)


def behind_filter(high_pass_hz: float, low_pass_hz: float, percent: float, low_hz: float, high_hz: float) -> str:
    """A band behind filters."""
    return (
        f"from {low_hz:.4g} to {high_hz:.4g} Hz the response is that behind {_filters(high_pass_hz, low_pass_hz)}, and "
        f"does not reach its plateau: d33 is too small by about {in_digits(percent, 2)} %, and not to be quoted; a "
        "diagnosis takes the filter into account, or record a band further off its corner"
    )


def sensor_behind_filter(high_pass_hz: float, low_pass_hz: float, percent: float) -> str:
    """A sensor behind filters that the others are not behind."""
    return (
        f"behind {_filters(high_pass_hz, low_pass_hz)} that the others are not behind: its d33 is too small by about "
        f"{in_digits(percent, 2)} %, and not to be quoted"
    )


def parameter_at_bound(mechanism: str, parameter: str, low: float, high: float, unit: str) -> str:
    """A parameter at the end of its range."""
    limits = f"{low:g} to {high:g} {unit.strip('-')}".rstrip()
    called = parameter.replace("_", " ")
    return f"{mechanism}: {called} lies at or beyond an end of its search ({limits}), which is no result"


def held_out(
    groups: Sequence[str], mechanisms: Sequence[str], before_percent: float, after_percent: float, *, shows: bool
) -> str:
    """Mechanisms that predict held-out groups no better; `shows`: whether the remaining rows show one of them."""
    omitted = " and ".join(groups) if len(groups) <= 2 else f"each of {len(groups)} parts in turn"
    named = " and ".join(mechanisms)
    if not shows:
        return f"without what was left out ({omitted}) the rest shows no {named}: do not extrapolate with it"
    before, after = (float(f"{percent:.4g}") for percent in (before_percent, after_percent))  # as the report has them
    return (
        f"what was left out ({omitted}) is predicted no better with {named}: "
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
        f"none of {tried} simple laws of one quantity over one axis is clear enough to be stated: the nearest, "
        f"{law}, predicts {part} held out to {after_percent:.2g} % instead of {before_percent:.2g} %"
    )


_AS_A_SLIP = 0.05  # largest difference of the logarithm of a factor from that of 2 or 1/2


def sensor_alone(sensor: str, share: float, recordings: int) -> str:
    """A sensor whose level differs from the common one of the others."""
    doubled = min(abs(math.log(share / 2)), abs(math.log(2 * share))) < _AS_A_SLIP
    causes = "its own d33, its cable, or peak-to-peak for amplitudes" if doubled else "its own d33 or its cable"
    return (
        f"sensor {sensor!r} responds with {share:.2f} times the others' charge, and they are alike: {causes}; "
        f"taken to their level by this factor ({recordings} recordings)"
    )


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

"""The sentences of findings in English: for each reason a template, or a function where words depend on the arguments.

This is the one place that knows them; another language is another such table.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from underskin.findings.arguments import D33Doubt, DefectKind, UnitGuess
from underskin.findings.codes import Reason
from underskin.findings.lacking import Lack, Lacking
from underskin.formatting import in_digits, significant

Words = str | Callable[..., str]
_MOST_SENSORS = 3  # named one by one

D33_DOUBTS: Mapping[D33Doubt, str] = {
    D33Doubt.TOO_LARGE: "more than sensors have: was mV/pC meant, not mV/nC, or N, not mN, or fC, not pC?",
    D33Doubt.TOO_SMALL: "less than sensors have: was mV/nC meant, not mV/pC, or mN, not N, or nC, not pC?",
    D33Doubt.NEGATIVE: "negative: is the sign of charge or force turned?",
    D33Doubt.NOT_PVDF: "which PVDF cannot have: it and its copolymers have 10 to 40",
}
DEFECTS: Mapping[DefectKind, str] = {
    DefectKind.OVERLOAD: "stay at the end of the range: overload",
    DefectKind.HELD_SAMPLES: "repeat one value: samples were dropped and the last one held",
    DefectKind.JUMP: "break the signal's course: samples were dropped, or a spike",
}


def statement(reason: Reason, arguments: Mapping[str, Any]) -> str:
    """The sentence of a reason with its arguments."""
    words = ENGLISH[reason]
    return words.format(**arguments) if isinstance(words, str) else words(**arguments)


def lacking(what: Lacking) -> str:
    """What is lacking, as the end of a sentence."""
    words = LACKING[what.lack]
    text = words.format(**what.arguments) if isinstance(words, str) else words(**what.arguments)
    if not what.refused_recordings:
        return text
    fields = " and ".join(what.refused_fields)
    return f"{what.refused_recordings} recording(s) were refused for their {fields} (see findings), which leaves {text}"


def _impossible_declaration(fields: Sequence[str], confirmable: bool) -> str:
    meant = "; if it is meant, say units_checked" if confirmable else ""
    return f"{' and '.join(fields)} cannot be right as declared (see findings){meant}"


def unit_guess(guess: UnitGuess) -> str:
    """The slip that would explain an unusual magnitude."""
    if guess.size == 0:
        return "a dead sensor?"
    if guess.given_in:
        was = f"{guess.size:g} {guess.given_in} is {guess.meant:g} {guess.unit}"
        return f"{was}: was it given in {guess.given_in}?"
    if guess.off_by:
        return f"off by a factor of 10^{guess.off_by}? {guess.meant:g} {guess.unit} would be usual"
    return "no unit that we know explains it"


def defect(kind: DefectKind, channel: str, samples: int, first_sample: int) -> str:
    """A run of damaged samples."""
    return f"{channel}: {samples} samples from sample {first_sample} {DEFECTS[kind]}"


def _defects_left_out(kind: DefectKind, channel: str, samples: int, first_sample: int, more: int) -> str:
    others = f"; {more} more like it" if more else ""
    return f"{defect(kind, channel, samples, first_sample)}{others}: those parts were left out"


def _size(too_large: bool) -> str:
    return "large" if too_large else "small"


def _more(count: int, noun: str) -> str:
    return f" ({count} more {noun}{'s' if count > 1 else ''} like it)" if count else ""


def _more_rows(count: int, noun: str = "rows") -> str:
    return f" ({count} more {noun} like it)" if count else ""


def _sensors(ids: Sequence[str]) -> str:
    if len(ids) > _MOST_SENSORS:
        return f"sensors {', '.join(ids[:_MOST_SENSORS])} and {len(ids) - _MOST_SENSORS} more"
    return f"sensors {', '.join(ids[:-1])} and {ids[-1]}"


def _unusual(value: float, unit: str, guess: UnitGuess, more: int) -> str:
    return f"{value:g} {unit} is unusual: {unit_guess(guess)}{_more_rows(more)}"


def _elastomer(modulus_mpa: float, low_mpa: float, high_mpa: float, given_in: str) -> str:
    word = "stiffer" if modulus_mpa > high_mpa else "softer"
    usual = f"({low_mpa:g} to {high_mpa:g} MPa)"
    return f"{modulus_mpa:g} MPa is {word} than elastomers are {usual}: was it given in {given_in}?"


def _needed_modulus(against: str) -> Callable[..., str]:
    def words(modulus_mpa: float, too_large: bool, **bounds: float) -> str:
        guess = "N for mN, or mm for m" if too_large else "mN for N, or m for mm"
        needed = f"force and displacement would need a modulus of about {modulus_mpa:.2g} MPa"
        return f"{needed}, where {against.format(**bounds)}: off by 1000 ({guess})?"

    return words


def _frequencies(lowest_hz: float, highest_hz: float, too_large: bool, given_in: str) -> str:
    range_ = f"frequencies are {lowest_hz:g} to {highest_hz:g} Hz"
    return f"{range_}: they look 1000 × too {_size(too_large)}; were they given in {given_in}?"


def _response_slip(too_large: bool) -> str:
    return "1000 × too large: pC taken for nC, or N for mN?" if too_large else "1000 × too small: nC taken for pC?"


def _d33_needed(d33_pc_per_n: float, declared_pc_per_n: float | None, too_large: bool) -> str:
    known = f", where {declared_pc_per_n:g} is declared" if declared_pc_per_n else ""
    needed = f"charge over force would need a d33 of {d33_pc_per_n:.3g} pC/N{known}"
    return f"{needed}; it looks {_response_slip(too_large)}"


def _thousandfold(too_small: bool) -> str:
    return "a thousandfold" if too_small else "divided by 1000"


def _within_tables(larger: bool, given_in: str) -> str:
    word = "larger" if larger else "smaller"
    return f"were it 1000 × {word}, contacts would lie within the tables: was it given in {given_in}?"


def _beside_others(value: float, too_large: bool, given_in: str) -> str:
    return f"{value:g} looks 1000 × too {_size(too_large)} beside the others: was it given in {given_in}? Left out"


def _of_series(words: Callable[..., str]) -> Callable[..., str]:
    """A contradiction within a time series: of a recording left out, of one used, or of all as in an `example`."""

    def in_scope(*, left_out: bool = False, example: str = "", **arguments: Any) -> str:
        text = words(**arguments)
        return f"in all recordings, as in {example}: {text}" if example else f"{text} Left out" if left_out else text

    return in_scope


def _swapped(force_mean_n: float, charge_mean_pc: float, preload_n: float) -> str:
    return (
        f"its mean is {force_mean_n:.3g} N, and that of charge_pc {charge_mean_pc:.3g}, where preload_n is "
        f"{preload_n:g}: force and charge look exchanged."
    )


def _series_force(oscillation_n: float, dynamic_force_n: float, too_large: bool, given_in: str) -> str:
    text = f"it is shaken by {oscillation_n:.3g} N, where dynamic_force_n is {dynamic_force_n:g}"
    return f"{text}: it looks 1000 × too {_size(too_large)}; was it given in {given_in}?"


def _series_dynamic_force(dynamic_force_n: float, too_large: bool, given_in: str) -> str:
    text = f"{dynamic_force_n:g} N looks 1000 × too {_size(too_large)} beside the recorded force"
    return f"{text}: was it given in {given_in}?"


def _series_preload(preload_n: float, mean_n: float, too_large: bool, given_in: str) -> str:
    beside = f"beside the recorded force's mean of {mean_n:.3g} N"
    return f"{preload_n:g} N looks 1000 × too {_size(too_large)} {beside}: was it given in {given_in}?"


def _one_place(sensors: Sequence[str], x_mm: float, y_mm: float, more: int) -> str:
    return f"{_sensors(sensors)} lie at one place, x {x_mm:g} mm, y {y_mm:g} mm: is it a slip?{_more(more, 'place')}"


def _too_near(sensors: Sequence[str], radius_mm: float, pitch_mm: float, in_metres: bool) -> str:
    guess = "were their places given in m" if in_metres else "is it the diameter"
    return f"{_sensors(sensors)} of {radius_mm:g} mm radius cannot lie {pitch_mm:g} mm apart: {guess}, or a slip?"


def _lines_left_out(faint: int, measured: int, recordings: int, beside: int) -> str:
    text = f"{faint} of {measured} lines of {recordings} recordings are left out: the force has little power there"
    shared = f", and {beside} that share their noise with the next one" if beside else ""
    return f"{text} and charge does not follow it{shared}"


def _mains_in_charge(affected: int, recordings: int, mains_hz: float, charge_pc: float) -> str:
    return (
        f"in {affected} of {recordings} recordings the charge stands out at {mains_hz:g} Hz or a multiple of it by "
        f"about {significant(charge_pc, 2)} pC, and the force does not: mains pickup? The lines there are left out"
    )


def _parameter_at_bound(mechanism: str, parameter: str, low: float, high: float, unit: str) -> str:
    limits = f"{low:g} to {high:g} {unit.strip('-')}".rstrip()
    return f"{mechanism}: {parameter} lies at an end of what is held possible ({limits})"


def _line_noise(level: float) -> str:
    return (
        f"the lines scatter {in_digits(level, 2)} times more about the stated answer than about their own neighbours: "
        "part of the misfit along frequency may have been taken for noise"
    )


def _held_out(groups: Sequence[str], mechanisms: Sequence[str], before_percent: float, after_percent: float) -> str:
    return (
        f"what was left out ({', '.join(groups)}) is predicted no better with {' and '.join(mechanisms)}: "
        f"{before_percent:.3g} % before, {after_percent:.3g} % after; do not extrapolate with it"
    )


def _load_not_linear(load_parameter: float, more: int) -> str:
    return (
        f"L = F/(R²E) is {load_parameter:.2g}: the layer is linear here, and finite strain is left out; it adds up to "
        f"1.3 % at L = 0.01 and 3 % at L = 0.1 to the stress on a sensor beneath a sphere{_more_rows(more, 'contacts')}"
    )


def _contact_slips(ratio: float, more: int) -> str:
    text = f"the tangential force is {ratio:.3g} times the normal one: it slips unless friction is stronger"
    return f"{text}{_more_rows(more, 'contacts')}"


_IMPOSSIBLE = "{largest:.3g} is no number that can be meant ({low:g} to {high:g} in magnitude)"
_OF_ARRAY = "{percent:.0f} % of the array's d33"

LACKING: Mapping[Lack, Words] = {
    Lack.CURVES_CONTRADICT: "force, displacement and modulus cannot all be right as declared (see findings); if they "
    "are meant, say units_checked",
    Lack.NO_CURVE: "no curve can be used (see findings)",
    Lack.NO_RECORDING: "no recording can be used",
    Lack.NO_RESPONSE: "no recording shows a response above its own noise",
    Lack.TWO_RECORDINGS_CONTRADICT: "two recordings that contradict each other (see findings); a third would tell "
    "which is off",
    Lack.FEW_RECORDINGS: "usable recordings: {recordings}; at least {least} are needed, better at different preloads "
    "or spheres",
    Lack.MADE_ALIKE: "all recordings were made alike, at one frequency; different preloads, spheres or places are "
    "needed",
    Lack.IMPOSSIBLE_DECLARATION: _impossible_declaration,
    Lack.NOISE: "a response that stands out of its noise, which is {floor_percent:.0f} % of what is predicted",
}
ENGLISH: Mapping[Reason, Words] = {
    Reason.REFUSED: "{field} = {value!r}: {allowed}; left out",
    Reason.NO_FRF: "{refusal}",
    Reason.IMPOSSIBLE_SKIN: _IMPOSSIBLE,
    Reason.IMPOSSIBLE_SENSOR_RADIUS: "{radius_mm:g} mm is beyond {thicknesses:g} thicknesses",
    Reason.IMPOSSIBLE_RECORDING: f"{_IMPOSSIBLE}: left out",
    Reason.IMPOSSIBLE_FRF: "its FRF of {frf_pc_per_n:.3g} pC/N, not below 1 C/N, can be none",
    Reason.NO_FINITE_LINE: "no line is finite: left out",
    Reason.NO_LINE_IN_BAND: "it has no line in the band",
    Reason.LINES_NOT_FINITE: "{lines} lines left out",
    Reason.SILENT_CAMPAIGN: "none of the {recordings} recordings shows a response above its noise: is the sensor "
    "connected?",
    Reason.SILENT_SENSOR: "none of the {recordings} recordings of sensor {sensor!r} shows a response above its noise: "
    "left out",
    Reason.SILENT_RECORDING: "no response above its noise, where the other recordings let expect one: left out",
    Reason.ZERO_LINES: "every line is 0: left out",
    Reason.INCOHERENT: "charge follows force at no frequency: left out",
    Reason.MAINS_SPOIL_ALL: "mains of {mains_hz:g} Hz may spoil all lines where the force has its power: left out",
    Reason.DUPLICATED_RECORDING: "the same numbers as recording {original!r}: left out",
    Reason.SERIES_NOT_USABLE: "{refusal}: left out",
    Reason.CURVE_NOT_USABLE: "{refusal}: left out",
    Reason.OUT_OF_TABLES_DECLARED: "its contact (radius {radius_mm:.3g} mm on a layer of {thickness_mm:g} mm, at its "
    "place beside the sensor) lies beyond the tables: left out",
    Reason.OUT_OF_TABLES_FITTED: "with the values found for {answer} its contact lies beyond the tables: its "
    "prediction is the table's edge",
    Reason.BEYOND_TABLE: "{limit}",
    Reason.PLACE_BEYOND_TABLE: "its position is farther from the sensor than the table reaches, or its lines scatter "
    "beyond measure",
    Reason.EXCLUDED: "Left out: {excluded_for}",
    Reason.OUTLIER: "its d33 of {d33_pc_per_n:.3g} pC/N is grossly off all others",
    Reason.CURVE_TOO_DEEP: "pressed {moved_mm:.3g} mm, more than {share:g} of its sample's height ({most_mm:.3g} mm): "
    "given in µm? Left out",
    Reason.SPHERE_TOO_DEEP: "pressed {moved_mm:.3g} mm, more than ten times the sphere's width ({most_mm:.3g} mm): "
    "given in µm? Left out",
    Reason.MODULUS_BESIDE_OTHERS: "its apparent modulus of {modulus_mpa:.3g} MPa is {ratio:.2g} times the others': a "
    "slip of units? Left out",
    Reason.TWO_MODULI: "the two curves' apparent moduli of {first_mpa:.2g} and {second_mpa:.2g} MPa contradict each "
    "other: is force or displacement of one of them off by 1000?",
    Reason.MODULUS_BESIDE_DECLARED: _needed_modulus("{declared_mpa:g} MPa is declared"),
    Reason.MODULUS_BESIDE_RUBBER: _needed_modulus("rubber has {low_mpa:g} to {high_mpa:g} MPa"),
    Reason.MODULUS_OF_NO_ELASTOMER: _elastomer,
    Reason.DECLARED_UNUSUAL: _unusual,
    Reason.WIDE_PITCH: "no two sensors lie nearer than {pitch_mm:g} mm: were places given in µm?",
    Reason.PRELOADS_SMALL: "no preload is above {highest_n:g} N: they look 1000 × too small; were they given in kN?",
    Reason.PRELOADS_LARGE: "no preload is below {lowest_n:g} N: they look 1000 × too large; were they given in mN?",
    Reason.FREQUENCIES: _frequencies,
    Reason.PERIODS_TOO_LONG: "no period of {lowest_hz:g} Hz fits into the {pause_s:.3g} s after which, by recorded_at, "
    "the next recording follows: are they 1000 × too small, given in kHz?",
    Reason.RESPONSE_BESIDE_OTHERS: lambda too_large: f"the response looks {_response_slip(too_large)} Left out",
    Reason.TWO_RESPONSES: "the two recordings' responses are {ratio:.3g} times as far apart as expected: a slip of "
    "units?",
    Reason.D33_NEEDED: _d33_needed,
    Reason.PLACES: lambda too_small, given_in, sensors_in: (
        f"places lie at their own sensors only {_thousandfold(too_small)}: were they given in {given_in}, or the "
        f"sensors in {sensors_in}?"
    ),
    Reason.PLACE: lambda too_small, given_in: (
        f"its place lies at its own sensor only {_thousandfold(too_small)}: was it given in {given_in}? Left out"
    ),
    Reason.PLACES_AT_SENSORS: "no place lies farther from its sensor than {farthest_mm:.2g} mm: were they given in m?",
    Reason.WITHIN_TABLES: _within_tables,
    Reason.SERIES_FORCE: _of_series(_series_force),
    Reason.SERIES_DYNAMIC_FORCE: _of_series(_series_dynamic_force),
    Reason.SERIES_PRELOAD: _of_series(_series_preload),
    Reason.BESIDE_OTHERS: _beside_others,
    Reason.DYNAMIC_FORCE_LARGE: "the dynamic force reaches the preload in all recordings, so the sphere would leave "
    "the skin: was it given in mN, or the preload in kN?",
    Reason.DYNAMIC_FORCE_SMALL: "it is at most {ratio:.1g} of the preload: it looks 1000 × too small; was it given in "
    "kN, or the preload in mN?",
    Reason.NARROW_MAP: "the map spans {span_mm:g} mm, on sensors {diameter_mm:g} mm across: is it in mm?",
    Reason.UNUSUAL_MAGNITUDE: _unusual,
    Reason.UNUSUAL_MEDIAN_FRF: lambda **arguments: f"FRF, median of the recordings: {_unusual(**arguments)}",
    Reason.CURVE_REVERSED: "its force falls as it is pressed, where compression counts positive: reversed",
    Reason.TWO_SIGNS: "the two recordings answer with opposite signs: one of them is reversed",
    Reason.ALL_REVERSED: "charge is negative in compression: all signs were reversed (a negative d33, or the amplifier "
    "inverts)",
    Reason.SENSOR_REVERSED: "sensor {sensor!r} answers with the opposite sign of the others: reversed",
    Reason.RECORDING_REVERSED: "its sign is the opposite of the others': reversed",
    Reason.CHANNELS_SWAPPED: _of_series(_swapped),
    Reason.FORCE_CONTRADICTS_PRELOAD: "force_n is {mean_n:.3g} N in the mean, but preload_n is {preload_n:g}: is one "
    "in another unit?",
    Reason.SENSORS_AT_ONE_PLACE: _one_place,
    Reason.SENSORS_TOO_NEAR: _too_near,
    Reason.SENSORS_OVERLAP: "{first} and {second} lie over one another, their centres {distance_mm:g} mm apart: are x "
    "and y in mm?",
    Reason.NO_CONTACT_WITHIN_TABLES: "no contact lies within the tables: contact radii would be {smallest:.3g} to "
    "{largest:.3g} of the thickness, or the places lie far from their sensors; are preload, sphere, thickness, modulus "
    "and places right?",
    Reason.TIME_TO_COME: lambda written, more: (
        f"recorded_at is {written}, which is still to come: is the year a slip?{_more(more, 'recording')}"
    ),
    Reason.TIME_TOO_OLD: lambda written, year, more: (
        f"recorded_at is {written}, before {year}: was the clock not set?{_more(more, 'recording')}"
    ),
    Reason.D33_FITTED: lambda d33_pc_per_n, doubt: f"d33 comes out as {d33_pc_per_n:.4g} pC/N, {D33_DOUBTS[doubt]}",
    Reason.D33_OF_ARRAY: lambda d33_pc_per_n, doubt: (
        f"d33 of the array is {d33_pc_per_n:.3g} pC/N, {D33_DOUBTS[doubt]}"
    ),
    Reason.D33_OF_ROW: lambda d33_pc_per_n, doubt, more: (
        f"d33 is {d33_pc_per_n:.3g} pC/N, {D33_DOUBTS[doubt]}{_more_rows(more)}"
    ),
    Reason.DEFECT: defect,
    Reason.DEFECTS_LEFT_OUT: _defects_left_out,
    Reason.LINES_LEFT_OUT: _lines_left_out,
    Reason.FORCE_ACTS_ONCE: "in {affected} of {recordings} recordings the force acts at each frequency once, as a "
    "single sweep or blow: the lowest lines are left out, and those beside a sharp resonance are off by parts of a "
    "percent; a drive that repeats itself at least four times gives them all",
    Reason.MAINS_IN_CHARGE: _mains_in_charge,
    Reason.CONSTANT_AXIS: "{axis} is the same in all recordings",
    Reason.ONE_LINE: "one line a recording: nothing can be said about frequency",
    Reason.PARAMETER_AT_BOUND: _parameter_at_bound,
    Reason.LINE_NOISE_LEVEL: _line_noise,
    Reason.REMAINDER: "a smooth part of about {percent:.2g} % of the largest force, {times:.0f} times a sample's "
    "noise, is left that no mechanism here describes",
    Reason.HELD_OUT_NO_BETTER: _held_out,
    Reason.SEATING: "only the first {percent:.0f} % of the displacement speaks for strain_stiffening: a platen that is "
    "tilted, or an uneven end, seats like that. It was left out; a small preload before zeroing avoids it",
    Reason.LOAD_NOT_LINEAR: _load_not_linear,
    Reason.PRESSURE_NOT_LINEAR: "{pressure_mpa:g} MPa is more than the layer's modulus, {modulus_mpa:g} MPa: it is far "
    "from linear there",
    Reason.CONTACT_SLIPS: _contact_slips,
    Reason.DEAD: f"dead: no charge beyond noise ({_OF_ARRAY})",
    Reason.INVERTED: f"inverted polarity: {_OF_ARRAY}",
    Reason.WEAK: f"weak: {_OF_ARRAY}",
    Reason.STRONG: f"strong: {_OF_ARRAY}",
    Reason.NOISY_LINES: "noisy: its lines scatter {times:.1f} times as much as those of the others",
    Reason.NOISY_RECORDINGS: "noisy: its recordings scatter {times:.1f} times as much as expected",
    Reason.BENT: "bent: its d33 curves by {percent:+.0f} % over the preloads",
}

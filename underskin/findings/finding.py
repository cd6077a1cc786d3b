"""A finding: something suspicious in data, or a limit of an answer, as a reason with arguments; and its English words.

For each reason there is a template, or a function of `sentences` where words depend on the arguments. Only these two
modules hold the words. Templates are those of `str.format` with further specifications (`_Template`).
"""

import dataclasses
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from underskin.findings.codes import FindingCode, Lack, Lacking, Reason
from underskin.findings.formatting import few, in_digits, significant
from underskin.findings.sentences import (
    DefectKind,
    ImplausibleD33,
    all_conjugated,
    behind_filter,
    contact_events,
    counted_negative,
    curves_differ,
    elastomer,
    far_contacts,
    force_saturates,
    held_out,
    labels_contradict_places,
    labels_permuted,
    lines_left_out,
    listed,
    more_alike,
    no_simple_law,
    noise_in_frf,
    parameter_at_bound,
    sensor_alone,
    sensor_behind_filter,
    specimens_differ,
    thickness_differs,
    thickness_unknown,
)

Words = str | Callable[..., str]
OPTIONAL: Mapping[str, Any] = {
    "left_out": False,
    "guess": None,
    "example": "",
    "frequency_hz": None,
    "others": True,
}  # arguments of some findings


class _Template(string.Formatter):
    """Python's format specifications, and some for words.

    `{value:yes|no}` is the first text, which may hold fields, if the value is true, else the second. `{value:digits 2}`
    never is a power of ten, `{value:significant 2}` no positive one. `{texts:or}` joins a list, `{ids:count}` is its
    length, `{ids:listed recordings}` and `{ids:sensors}` name its first ids, and `{more:more recording}` is a number of
    further cases in brackets. None is empty.
    """

    def format_field(self, value: Any, format_spec: str) -> str:
        """One field in words."""
        yes, bar, no = format_spec.rpartition("|")
        if bar:
            return yes if value else no
        if value is None:
            return ""
        name, _, argument = format_spec.partition(" ")
        if name in _WORDS:
            return _WORDS[name](value, argument)
        return str(super().format_field(value, format_spec))


_MOST_SENSORS = 3  # named one by one
_WORDS: Mapping[str, Callable[[Any, str], str]] = {
    "digits": lambda value, digits: in_digits(value, int(digits)),
    "significant": lambda value, digits: significant(value, int(digits)),
    "or": lambda texts, _: ", or ".join(texts),
    "count": lambda ids, _: str(len(ids)),
    "listed": listed,
    "sensors": lambda ids, _: f"sensors {few(ids, _MOST_SENSORS)}",
    "more": more_alike,
    "defect": lambda kind, _: DefectKind(kind).words,
    "implausible": lambda kind, _: ImplausibleD33(kind).words,
}


def in_english(words: Words, arguments: Mapping[str, Any]) -> str:
    """A template or a function with its arguments."""
    if isinstance(words, str):
        return _Template().vformat(words, (), {**OPTIONAL, **arguments})
    return words(**arguments)


def statement(reason: Reason, arguments: Mapping[str, Any]) -> str:
    """The sentence of a reason with its arguments."""
    return in_english(ENGLISH[reason], arguments)


def lacking(what: Lacking) -> str:
    """A lack in words, as the end of a sentence."""
    text = in_english(LACKING[what.lack], what.arguments)
    if not what.refused_recordings:
        return text
    fields = " and ".join(what.refused_fields)
    return f"{what.refused_recordings} recording(s) were refused for their {fields} (see findings), which leaves {text}"


def _impossible_declaration(fields: Sequence[str], confirmable: bool) -> str:
    meant = "; if it is meant, say units_checked" if confirmable else ""
    return f"{' and '.join(fields)} cannot be right as declared (see findings){meant}"


_IMPOSSIBLE = "{largest:.3g} is no number that can be meant ({low:g} to {high:g} in magnitude)"
_OF_ARRAY = "{percent:z.0f} % of the array's median"
_CHANGES = (
    ", at all frequencies and far beyond noise: another range of the amplifier, a loose plug or a cable? The FRF "
    "averages over it: its d33 is not to be quoted{more:more recording}"
)
_MORE_ROWS = "{more: ({more} more rows like it)|}"
_UNUSUAL = f"{{value:g}} {{unit}} is unusual: {{guess}}{_MORE_ROWS}"
_GIVEN_IN = "{units:; was charge over force given in {units:or}?|}"
_RESPONSE = "1000 × too {too_large:large: pC taken for nC, or N for mN?|small: nC taken for pC?}"
_NEEDED = (
    "force and displacement would need a modulus of about {modulus_mpa:.2g} MPa: "
    "{slips:{slips:or}?|are force, displacement and size in the units that were said?}"
)
_THOUSANDFOLD = "{too_small:a thousandfold|divided by 1000}"
_ALL_AS_IN, _LEFT_OUT = "{example:in all recordings, as in {example}: |}", "{left_out: Left out|}"  # of time series
DEFECT = "{channel}: {samples} samples from sample {first_sample} {kind:defect}"

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
    Lack.FEW_TO_AGREE: "{recordings} recordings agree with the model, but would do so with much missing, which d33 and "
    "their scatter take up; at least {least} are needed, better at different preloads or spheres",
    Lack.MADE_ALIKE: "all recordings were made alike, at one frequency; different preloads, spheres or places are "
    "needed",
    Lack.IMPOSSIBLE_DECLARATION: _impossible_declaration,
    Lack.NOISE: "a response above its noise, which is {floor_percent:.0f} % of what is predicted",
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
    Reason.SILENT_SENSOR: "sensor {sensor!r} shows no response above its noise in any of its {recordings} recordings: "
    "left out",
    Reason.SILENT_RECORDING: "no response above its noise, where the other recordings let expect one: left out",
    Reason.ZERO_LINES: "every line is 0: left out",
    Reason.INCOHERENT: "charge follows force at no frequency: left out",
    Reason.MAINS_SPOIL_ALL: "mains of {mains_hz:g} Hz may spoil all lines where the force has its power: left out",
    Reason.DUPLICATED_RECORDING: "the same numbers as recording {original!r}: left out",
    Reason.SERIES_NOT_USABLE: "{refusal}: left out",
    Reason.CURVE_NOT_USABLE: "{refusal}: left out",
    Reason.OUT_OF_TABLES_DECLARED: "its contact (radius {radius_mm:.3g} mm on a layer of {thickness_mm:g} mm, at its "
    "place off the sensor) lies beyond the tables: left out",
    Reason.OUT_OF_TABLES_UNLESS_STIFFER: "by the declared {declared_mpa:g} MPa its contact lies beyond the tables, by "
    "one up to {factor:g} times larger within; no answer that stands has such a modulus, so it was left out: a modulus "
    "that is declared too small is not ruled out",
    Reason.OUT_OF_TABLES_FITTED: "with the values found for {answer} its contact lies beyond the tables: its "
    "prediction is continued from the table's edge",
    Reason.CONTACTS_KEPT: "by the declared {declared_mpa:g} MPa {contacts} of {recordings} contacts lie beyond the "
    "tables, "
    "{found_mpa:at the {found_mpa:.3g} MPa found|with the values found for {answer}} they lie within: kept",
    Reason.BEYOND_TABLE: "{limit}",
    Reason.PLACE_BEYOND_TABLE: "its position is farther from the sensor than the table reaches, or its lines scatter "
    "beyond measure",
    Reason.FAR_CONTACTS: far_contacts,
    Reason.EXCLUDED: "Left out: {excluded_for}",
    Reason.OUTLIER: "its d33 of {d33_pc_per_n:.3g} pC/N is grossly off all others",
    Reason.OUTLIER_SILENT: "no charge beyond noise, while sensor {sensor!r} responds in other recordings: was it "
    "dead or not connected?",
    Reason.OUTLIER_INVERTED: "the charge has the opposite sign of other recordings of sensor {sensor!r}: was a cable, "
    "an amplifier or a sign changed between them?",
    Reason.CURVE_TOO_DEEP: "pressed {moved_mm:.3g} mm, more than {share:g} of its sample's height ({most_mm:.3g} mm): "
    "given in µm? Left out",
    Reason.SPHERE_TOO_DEEP: "pressed {moved_mm:.3g} mm, more than ten times the sphere's width ({most_mm:.3g} mm): "
    "given in µm? Left out",
    Reason.MODULUS_BESIDE_OTHERS: "its apparent modulus of {modulus_mpa:.3g} MPa is {ratio:.2g} times the others': a "
    "slip of units? Left out",
    Reason.TWO_MODULI: "the two curves' apparent moduli of {first_mpa:.2g} and {second_mpa:.2g} MPa contradict each "
    "other: is force or displacement of one of them off by 1000?",
    Reason.MODULUS_BESIDE_DECLARED: f"{_NEEDED} {{declared_mpa:g}} MPa is declared",
    Reason.MODULUS_BESIDE_RUBBER: f"{_NEEDED} Rubber has {{low_mpa:g}} to {{high_mpa:g}} MPa",
    Reason.MODULUS_OF_NO_ELASTOMER: elastomer,
    Reason.DECLARED_UNUSUAL: _UNUSUAL,
    Reason.WIDE_PITCH: "no two sensors lie nearer than {pitch_mm:g} mm: were places given in µm?",
    Reason.PRELOADS_SMALL: "no preload is above {highest_n:g} N: they look 1000 × too small; were they given in kN?",
    Reason.PRELOADS_LARGE: "no preload is below {lowest_n:g} N: they look 1000 × too large; were they given in mN?",
    Reason.COHERENCE_SMALL: "no coherence is above {largest:.2g}: does its heading say %, where it is a share of 1?",
    Reason.FREQUENCIES: "frequencies are {lowest_hz:g} to {highest_hz:g} Hz: they look 1000 × too "
    "{too_large:large|small}; {are_series:was the time of the series|were they} given in {given_in}?",
    Reason.PERIODS_TOO_LONG: "no period of {lowest_hz:g} Hz fits into the {pause_s:.3g} s after which, by recorded_at, "
    "the next recording follows: are they 1000 × too small, given in kHz?",
    Reason.RESPONSE_BESIDE_OTHERS: f"the response looks {_RESPONSE} Left out",
    Reason.TWO_RESPONSES: "the two recordings' responses are {ratio:.3g} times as far apart as expected: a slip of "
    "units?",
    Reason.D33_NEEDED: "charge over force would need a d33 of {d33_pc_per_n:.3g} pC/N"
    f"{{declared_pc_per_n:, where {{declared_pc_per_n:g}} is declared|}}{_GIVEN_IN}{{slip:: {{slip}}|}}",
    Reason.PLACES: f"places lie at their own sensors only {_THOUSANDFOLD}: were they given in {{given_in}}, or the "
    f"sensors in "
    "{sensors_in}?",
    Reason.PLACE: f"its place lies at its own sensor only {_THOUSANDFOLD}: was it given in {{given_in}}? Left out",
    Reason.PLACES_AT_SENSORS: "no place lies farther from its sensor than {farthest_mm:.2g} mm: were they given in m?",
    Reason.WITHIN_TABLES: "were it 1000 × {larger:larger|smaller}, contacts would lie within the tables: was it given "
    "in "
    "{given_in}?",
    Reason.SERIES_FORCE: f"{_ALL_AS_IN}it is shaken by {{oscillation_n:.3g}} N, where dynamic_force_n is "
    f"{{dynamic_force_n:g}}: it "
    f"looks 1000 × too {{too_large:large|small}}; was it given in {{given_in}}?{_LEFT_OUT}",
    Reason.SERIES_DYNAMIC_FORCE: f"{_ALL_AS_IN}{{dynamic_force_n:g}} N looks 1000 × too {{too_large:large|small}} "
    f"compared with the "
    f"recorded force: was it given in {{given_in}}?{_LEFT_OUT}",
    Reason.SERIES_PRELOAD: f"{_ALL_AS_IN}{{preload_n:g}} N looks 1000 × too {{too_large:large|small}} "
    f"compared with the recorded force's "
    f"mean of {{mean_n:.3g}} N: was it given in {{given_in}}?{_LEFT_OUT}",
    Reason.BESIDE_OTHERS: "{value:g} looks 1000 × too {too_large:large|small} against the others: was it given in "
    "{given_in}? "
    "Left out",
    Reason.DYNAMIC_FORCE_LARGE: "the dynamic force reaches the preload in all recordings, so the sphere would leave "
    "the skin: was it given in mN, or the preload in kN, or are the two exchanged?",
    Reason.DYNAMIC_FORCE_SMALL: "it is at most {ratio:.1g} of the preload: it looks 1000 × too small; was it given in "
    "kN, or the preload in mN?",
    Reason.NARROW_MAP: "the map spans {span_mm:g} mm, on sensors {diameter_mm:g} mm across: is it in mm?",
    Reason.UNUSUAL_MAGNITUDE: _UNUSUAL,
    Reason.UNUSUAL_MEDIAN_FRF: f"FRF, median of the recordings: {_UNUSUAL}",
    Reason.CURVE_COUNTED_NEGATIVE: counted_negative,
    Reason.COUNTED_AS_OTHER_LOAD: "force and displacement are counted as of a sample that is {pulled:pressed|pulled}, "
    "and the curve is that of one that is {pulled:pulled|pressed} ({why}): turned round "
    "here; compression counts positive and tension negative, so reverse the signs of both channels",
    Reason.PULLED_OR_PRESSED: "whether the sample was {pulled:pulled, as the signs say, or pressed|pressed, as the "
    "signs say, or pulled} is open: the curve could be of either; compression counts positive, tension negative",
    Reason.ROWS_REVERSED: "its rows begin where it is deepest and end in the air: it was read from the last row to "
    "the first"
    "{is_timed:, without its times, since a way out alone does not tell what relaxes|}",
    Reason.FORCE_SATURATES: force_saturates,
    Reason.FORCE_STEPS: "the force leaps from {from_n:.4g} to {to_n:.4g} N at {at_mm:.4g} mm while the travel goes on "
    "evenly: the sample tore or slipped, or the range or zero of the cell was changed; the {samples} samples after it "
    "are not of the same contact or grip and were left out",
    Reason.CONTACT_EVENTS: contact_events,
    Reason.READING_STEPS: "the displacement jumps by {step_mm:.3g} mm at sample {sample}{further:, and {further} times "
    "more|}, and the force stays: its reading jumps, as between the segments of a file, and not the stage; taken out",
    Reason.PERIODIC_ERROR: "the force carries an error that is periodic in the travel, in the air as well: period "
    "{period_mm:.3g} mm, amplitude {amplitude_n:.2g} N, {percent:.2g} % of the range of force (optical interference, a "
    "screw or an encoder{frequency_hz:; or hum, or a vibration of {frequency_hz:.3g} Hz|}); it was subtracted",
    Reason.TIP_SHAPE: "{refusal}",
    Reason.TWO_SIGNS: "the two recordings answer with opposite signs: one of them is reversed",
    Reason.ALL_REVERSED: "charge is negative in compression: all signs were reversed (a negative d33, or the amplifier "
    "inverts)",
    Reason.SENSOR_REVERSED: "sensor {sensor!r} answers with the opposite sign of the others: reversed",
    Reason.RECORDING_REVERSED: "its sign is the opposite of the others': reversed",
    Reason.RECORDINGS_REVERSED: "the sign of {reversed_recordings:count} of {recordings} recordings is the opposite "
    "of the "
    "others', with no order in it: reversed ({reversed_recordings:listed recordings})",
    Reason.ALL_CONJUGATED: all_conjugated,
    Reason.RECORDINGS_CONJUGATED: "the phase over frequency of {conjugated:count} of {recordings} recordings is that "
    "of the "
    "others with its sign turned: they look conjugated, and were conjugated back ({conjugated:listed recordings})",
    Reason.LEVELS_EXCHANGED: "since {since} {labels:sensors} each have the d33 that another of them had "
    "before: their labels or cables look exchanged, and each d33 since then belongs to that sensor",
    Reason.LABELS_EXCHANGED: "sensors {first!r} and {second!r} answer where the other one was pressed: their labels, "
    "or their places, look exchanged; put right",
    Reason.CABLES_EXCHANGED: "from recording {since!r} on, in the order of time, sensors {first!r} and {second!r} "
    "answer as each "
    "other: their cables look exchanged; put right ({recordings} recordings)",
    Reason.LABELS_PERMUTED: labels_permuted,
    Reason.LABELS_CONTRADICT_PLACES: labels_contradict_places,
    Reason.SILENT_TOGETHER: "sensors {first!r} and {second!r} both show no response since recording {since!r}, in the "
    "order of "
    "time: cables exchanged, or a connector or amplifier that they share; left out ({recordings} recordings)",
    Reason.AMPLITUDE_FACTOR: "the response of {of:count} of {recordings} recordings is {factor:.3g} times the "
    "others': is their "
    "dynamic force or charge given as {meant} instead of peak? Put right by this factor ({of:listed recordings})"
    "{left_out:; {left_out} that do not tell were left out|}",
    Reason.TWO_GROUPS: "{lower:listed sensors} and {higher:listed sensors} are two groups, alike within and "
    "{factor:.3g} times apart: was the charge of one not divided by its amplifier's range, or given in another unit or "
    "peak-to-peak? Which group is right shows in no recording: no d33 of the array is to be quoted",
    Reason.GAIN_STEP: "at about {step_s:.3g} s the charge per force changes to {ratio:.3g} times what it was before"
    f"{_CHANGES}",
    Reason.GAIN_DRIFTS: "the charge per force changes within the recording, from {lowest:.2f} to {highest:.2f} times "
    f"its mean{_CHANGES}",
    Reason.GAIN_OVER_FREQUENCY: "{is_step:between|from} {low_hz:.4g} {is_step:and|to} {high_hz:.4g} Hz the charge per "
    "force {is_step:{rises:rises|falls} by a factor of {factor:.3g}, and is level on either side|has two levels, a "
    "factor of {factor:.3g} apart}: another range of the amplifier, a loose plug, or a resonance narrower than the "
    "lines are apart{left_out:; left out|, and which level is right shows in no recording: no d33 is to be quoted}"
    "{more:more recording}",
    Reason.WARM_UP: "the response drifts by {percent:+z.0f} % over the first recordings, to the level of all later "
    "ones: warm-up of amplifier or sensor? The first {recordings} were left out",
    Reason.CHANNELS_SWAPPED: f"{_ALL_AS_IN}its mean is {{force_mean_n:.3g}} N, and that of charge_pc "
    f"{{charge_mean_pc:.3g}}, where "
    f"preload_n is {{preload_n:g}}: force and charge look exchanged.{_LEFT_OUT}",
    Reason.PRELOAD_AND_RADIUS_EXCHANGED: "the spheres are pressed harder than the tables hold, or preload_n and "
    "indenter_radius_mm "
    "are exchanged: L = F/(R²E) of {beyond} of {recordings} contacts is beyond the tables, and within if they are "
    "exchanged",
    Reason.FORCE_CONTRADICTS_PRELOAD: "the force is {mean_n:.3g} N in the mean, but the preload is {preload_n:g} N: "
    "{guess:{guess}|is one in another unit?}{left_out: Left out|}",
    Reason.SENSORS_AT_ONE_PLACE: "{sensors:sensors} lie at one place, x {x_mm:g} mm, y {y_mm:g} mm: is it a "
    "slip?{more:more place}",
    Reason.SENSORS_TOO_NEAR: "{sensors:sensors} of {radius_mm:g} mm radius cannot lie {pitch_mm:g} mm apart: "
    "{in_metres:were their places given in m|is it the diameter}, or a slip?",
    Reason.SENSORS_OVERLAP: "{first} and {second} lie over one another, their centres {distance_mm:g} mm apart: are x "
    "and y in mm?",
    Reason.NO_CONTACT_WITHIN_TABLES: "no contact lies within the tables: contact radii would be {smallest:.3g} to "
    "{largest:.3g} of the thickness, or the places lie far from their sensors; are preload, sphere, thickness, modulus "
    "and places right?",
    Reason.TIME_TO_COME: "recorded_at is {written}, which is still to come: is the year a slip?{more:more recording}",
    Reason.TIME_TOO_OLD: "recorded_at is {written}, before {year}: was the clock not set?{more:more recording}",
    Reason.D33_FITTED: f"d33 comes out as {{d33_pc_per_n:.4g}} pC/N, {{kind:implausible}}{_GIVEN_IN}",
    Reason.D33_OF_ARRAY: f"d33 of the array is {{d33_pc_per_n:.3g}} pC/N, {{kind:implausible}}{_GIVEN_IN}",
    Reason.D33_OF_ROW: f"d33 is {{d33_pc_per_n:.3g}} pC/N, {{kind:implausible}}{_MORE_ROWS}",
    Reason.DEFECT: DEFECT,
    Reason.DEFECTS_LEFT_OUT: f"{DEFECT}{{more:; {{more}} more like it|}}: those parts were left out",
    Reason.READINGS_MARKED: "{samples} readings of the force ({percent:.2g} %) are {value_n:.4g} N each, far off those "
    "next to them: the instrument's mark for no reading? They were left out",
    Reason.READINGS_BEYOND: "{samples} reading(s) of the force, up to {value_n:.4g} N, lie far beyond the range of all "
    "others and last no longer than a sample or two: damaged? They were left out",
    Reason.LINES_LEFT_OUT: lines_left_out,
    Reason.FORCE_ACTS_ONCE: "in {affected} of {recordings} recordings the force acts at each frequency once, as a "
    "single sweep or blow: the lowest lines are left out, and those near a sharp resonance are off by parts of a "
    "percent; a drive that repeats itself at least four times gives them all",
    Reason.MAINS_IN_CHARGE: "in {affected} of {recordings} recordings the charge is too large at {mains_hz:g} Hz or a "
    "multiple of it by about {charge_pc:significant 2} pC, and the force does not: mains pickup? The lines there "
    "are left out",
    Reason.EXCITED_AT_MAINS: "in {affected} of {recordings} recordings the force acts near a multiple of the mains "
    "frequency alone ({frequency_hz:.4g} Hz): mains pick-up in the charge and the response cannot be separated there, "
    "and d33 holds only if there is none; record at other frequencies",
    Reason.NOISE_IN_FRF: noise_in_frf,
    Reason.BEHIND_FILTER: behind_filter,
    Reason.SENSOR_BEHIND_FILTER: sensor_behind_filter,
    Reason.CONDITION_DIFFERS: "{name} differs between the sensors, {low:.15g} to {high:.15g}, and by the recordings of "
    "each sensor it changes d33 by {percent:+z.15g} ± {unsure:.2g} % per unit: the d33 of sensors are stated at its "
    "mean, {mean:.15g}, which leaves them unsure by up to {left_percent:.2g} %; measure all sensors under one "
    "condition",
    Reason.CONDITION_NOT_TOLD: "{name} differs between the sensors, {low:.15g} to {high:.15g}, and hardly within them: "
    "what it does to d33 cannot be separated from the sensors; measure all sensors under one condition",
    Reason.CONSTANT_PHASE: "the FRFs have a phase of {phase_deg:.0f}°, the same over frequency and more than any loss "
    "of a skin: the reference phase of a lock-in amplifier, or another shift in the chain; it was taken off, so that "
    "d33 is that of the magnitude (the real part alone would be {lost_percent:.2g} % less), and its sign is known but "
    "for half a turn",
    Reason.CONSTANT_AXIS: "{axis} is the same in all recordings",
    Reason.ONE_LINE: "one line a recording: nothing can be said about frequency",
    Reason.PARAMETER_AT_BOUND: parameter_at_bound,
    Reason.THICKNESS_UNKNOWN: thickness_unknown,
    Reason.DECLARED_LAYER: "with a layer of the declared {declared_mm:g} mm on a stiff base (layered contact) the "
    "recordings are {less} less probable: check the thickness, and that the sample is bonded",
    Reason.THICKNESS_DIFFERS: thickness_differs,
    Reason.LINE_NOISE_LEVEL: "the lines scatter {level:digits 2} times more about the stated answer than about their "
    "own "
    "neighbours: part of the misfit along frequency may have been taken for noise",
    Reason.REMAINDER: "a smooth part of about {percent:.2g} % of the largest force, {times:.0f} times a sample's "
    "noise, is left that no mechanism here describes",
    Reason.HELD_OUT_NO_BETTER: held_out,
    Reason.NO_SIMPLE_LAW: no_simple_law,
    Reason.UNUSUAL_SCATTER: "the gain of the recordings scatters by {percent:.2g} %, and by {usual:.2g} % on a poor "
    "rig: something that no recording states changes from one to the next",
    Reason.SCATTER_AT_LIMIT: "the gain of the recordings scatters by {percent:.2g} % or more, the most that is "
    "considered: something other than d33 decides what they read, and the array has no d33 to quote",
    Reason.CURVES_DIFFER: curves_differ,
    Reason.SPECIMENS_DIFFER: specimens_differ,
    Reason.CURVE_STANDS_OFF: "its modulus is {factor:.2f} times that of the others, which differ by {others:.2g} % "
    "(sd): the gain of a rig scatters so once in {once:.0f}{radius_mm:, and a sphere of {radius_mm:.3g} mm would "
    "agree|}; look at what is declared of it, and repeat it",
    Reason.LOAD_NOT_LINEAR: "L = F/(R²E) is {load_parameter:.2g}: the layer is linear here, and finite strain is left "
    "out; it "
    "adds up to 1.3 % at L = 0.01 and 3 % at L = 0.1 to the stress on a sensor beneath a sphere"
    "{more: ({more} more contacts like it)|}",
    Reason.PRESSURE_NOT_LINEAR: "{pressure_mpa:g} MPa is more than the layer's modulus, {modulus_mpa:g} MPa: it is far "
    "from linear there",
    Reason.CONTACT_SLIPS: "the tangential force is {ratio:.3g} times the normal one: it slips unless friction is "
    "stronger"
    "{more: ({more} more contacts like it)|}",
    Reason.DEAD: f"dead: no charge beyond noise{{others: ({_OF_ARRAY})|}}",
    Reason.INVERTED: f"inverted polarity: {_OF_ARRAY}",
    Reason.WEAK: f"weak: {_OF_ARRAY}",
    Reason.WEAK_SENSOR: "sensor {sensor!r} answers with {share:.2g} of the others' level: a fault of this sensor, its "
    "cable or its range, beyond any spread; left out ({recordings} recordings)",
    Reason.SENSOR_WEAKER: sensor_alone,
    Reason.SENSOR_STRONGER: sensor_alone,
    Reason.STRONG: f"strong: {_OF_ARRAY}",
    Reason.NOISY_LINES: "noisy: its lines scatter {times:.1f} times as much as those of the others",
    Reason.NOISY_RECORDINGS: "noisy: its recordings scatter {times:.1f} times as much as expected",
    Reason.BENT: "bent: its d33 curves by {percent:+z.0f} % over the preloads",
}


@dataclass(frozen=True)
class Finding:
    """A reason, its subject, and the values of its sentence.

    `recording` is an id, empty for the whole campaign; `field` is the name in the user's document; `index` is the row
    of a column, from 0. The sentences of `ENGLISH` define the names of the `arguments`.
    """

    reason: Reason
    recording: str = ""
    field: str = ""
    arguments: Mapping[str, Any] = dataclasses.field(default_factory=dict, hash=False)
    index: int | None = None

    @property
    def code(self) -> FindingCode:
        """The kind of finding, as users filter by it."""
        return self.reason.code

    @property
    def statement(self) -> str:
        """The finding in words, without the recording."""
        return statement(self.reason, self.arguments)

    def in_columns(self) -> dict[str, Any]:
        """The finding as answers in columns hold it, for JSON."""
        return {"code": str(self.code), "field": self.field, "index": self.index, "statement": self.statement}

    def in_report(self) -> dict[str, str]:
        """The finding as a diagnosis report holds it, for JSON."""
        return {"code": str(self.code), "recording": self.recording, "field": self.field, "statement": self.statement}

    @property
    def sentence(self) -> str:
        """The finding in words, preceded by the recording where it is about one."""
        return f"recording {self.recording}: {self.statement}" if self.recording else self.statement

"""A law that nobody listed in plain words: what it changes, by how much, what it is worth, what usually does it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.reporting.answer_statement import Around
from underskin.diagnosis.reporting.hints import CONSTANT_PHASE, TURNED, hint
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.diagnosis.reporting.sentences import of_clauses
from underskin.diagnosis.reporting.unnamed_law import SHOWN_AS_HOURS, LeadingLaw
from underskin.findings.formatting import in_digits, in_percent
from underskin.mechanisms.unnamed.curve_laws import TURN, CurveLaw
from underskin.mechanisms.unnamed.frequency_laws import FrequencyLaw
from underskin.mechanisms.unnamed.laws import LagLaw, RecordingLaw, UnnamedLaw
from underskin.mechanisms.unnamed.vocabulary import ACTS_ON, acted_on, followed
from underskin.recordings.time_zone import time_zone

_HERTZ = ("preload_n", "indenter_radius_mm")  # with whose cube root Hertz's contact radius grows
_DELAY = 0.5  # of the exponent of a phase, above which it is more like a delay than like a loss angle


def statement(
    probability: float,
    leading: LeadingLaw,
    document: Mapping[str, Any],
    floor: float,
    around: Around,
    left: str,
    *,
    outweighed: bool,
) -> str:
    """Three sentences at most: that no known mechanism describes this, after what decides how far that can be trusted;
    what is missing, with its numbers and what it is worth; its rivals, what usually does this, and what to quote.

    `left` says how far the base model goes on curves; the law may be `outweighed` by a course of no form.
    """
    law = leading.law
    acts_on = law.spoken.acts_on
    beside = tuple(name for name in leading.explanation.names if name != law.name)
    known = f" beside {_listed(beside)}" if beside else ""
    held = document["heldout_rmse_percent"]
    worth = _worth(held, floor, _held_out(law), f" and {_listed(beside)}" if beside else "")
    altered = [*_altered(law, document), *_order(law, document)]
    missing = [f"what is missing{known} {_does(leading)}{_follows(leading)}: {_size(leading)}", worth, *altered]
    rivals = [
        f"{acted_on(entry['acts_on'], entry['axis'])} over {followed(entry['axis'])}, {entry['form']} "
        f"({in_percent(entry['probability'])} of it)"
        for entry in document["rivals"][:2]
    ]
    also = [f"in these recordings this may also be {', or '.join(rivals)}"] if rivals else []
    if outweighed:
        also.append("more probable still is a course of no listed form: take this law as the nearest that has one")
    certain = probability * _same_place(document) >= EXPLAINED and not outweighed
    told = ""
    if certain and not (altered or leading.is_constant):
        told = hint(acts_on, _hinted(leading), leading.explanation.best.hypothesis.lines.kind)
    verdict = f"no known mechanism describes this (probability {in_percent(probability)})"
    return of_clauses(around.first(verdict), missing, [*also, told, left, *around.quoted])


def _same_place(document: Mapping[str, Any]) -> float:
    """The share of laws of any form that act on the same and follow the same."""
    same = (document["acts_on"], document["axis"])
    rivals = (one["probability"] for one in document["rivals"] if (one["acts_on"], one["axis"]) == same)
    return float(document["probability"] + sum(rivals))


def _hinted(leading: LeadingLaw) -> str:
    """What it follows, as hints have it."""
    law = leading.law
    if isinstance(law, CurveLaw) and law.shape.variant == TURN:
        return TURNED
    return CONSTANT_PHASE if leading.is_constant_phase else law.spoken.axis


def _listed(names: Sequence[str]) -> str:
    return " and ".join(name.replace("_", " ") for name in names)


def _altered(law: UnnamedLaw, document: Mapping[str, Any]) -> list[str]:
    """That a power law is one that is known with another exponent."""
    if law.spoken.form != "power":
        return []
    stated = {entry["name"]: entry for entry in document["parameters"]}
    if isinstance(law, RecordingLaw) and law.spoken.acts_on == "contact_radius" and law.axis.name in _HERTZ:
        value, low, high = (1 / 3 + stated["change"][name] for name in ("value", "low", "high"))
        power = f"{value:.2f} ({low:.2f} to {high:.2f}) in place of 1/3"
        grows = f"the contact radius grows with {followed(law.axis.name)} to the power {power}"
        return [f"this is Hertz's law with another exponent: {grows}"]
    exponent = stated.get("exponent")
    if isinstance(law, FrequencyLaw) and law.variant == "phase" and exponent and exponent["value"] > _DELAY:
        power = f"{exponent['value']:.2f} ({exponent['low']:.2f} to {exponent['high']:.2f}) in place of 1"
        return [f"this is a delay with another exponent: its phase grows with frequency to the power {power}"]
    return []


def _order(law: UnnamedLaw, document: Mapping[str, Any]) -> list[str]:
    """That lines fall off towards low frequencies as behind a high pass, of what order."""
    if not (isinstance(law, FrequencyLaw) and law.variant == "high_pass"):
        return []
    stated = {entry["name"]: entry for entry in document["parameters"]}
    value, low, high = (stated["exponent"][name] for name in ("value", "low", "high"))
    if value < 0:
        return []
    return [f"this is a high pass of order {value:.2f} ({low:.2f} to {high:.2f}), where an amplifier's is of order 1"]


def _held_out(law: UnnamedLaw) -> str:
    return "samples" if isinstance(law, CurveLaw) else "recordings"


def _does(leading: LeadingLaw) -> str:
    law = leading.law
    acts_on = law.spoken.acts_on
    of_curves = {
        "position": "moves the surface along the travel",
        "gain": "changes the gain of the cell",
        "force": "adds to the force that is read",
    }
    if leading.is_constant_phase:
        return "turns the frequency response"
    if isinstance(law, CurveLaw) and acts_on in of_curves:
        return of_curves[acts_on]
    return {
        "position": "moves the place of the contact",
        "frequency_response": "changes the frequency response",
        "gain": "changes the gain",
        "force": "changes the force on the skin",
    }.get(acts_on, f"changes the {ACTS_ON[acts_on][0]}")


def _follows(leading: LeadingLaw) -> str:
    if leading.is_constant_phase:
        return " by the same angle at all frequencies"
    return ", the same in all recordings" if leading.is_constant else f" with {_axis_words(leading)}"


def _axis_words(leading: LeadingLaw) -> str:
    words = followed(leading.law.spoken.axis)
    if leading.axis is not None and leading.axis.relative:
        return f"{words} over its own"
    if leading.law.spoken.axis in SHOWN_AS_HOURS:
        return f"{words} ({time_zone()})"
    return words


def _size(leading: LeadingLaw) -> str:
    """−8 % (−10 to −6) at 14:00."""
    at, size, deviation = leading.largest()
    law = leading.law
    where = f" {place}" if (place := _where(leading, at)) else ""
    half = SDS_OF_95 * deviation
    if law.spoken.acts_on in ("force", "position"):
        unit = "N" if law.spoken.acts_on == "force" else "mm"
        return f"{size:+.3g} {unit} ({size - half:+.3g} to {size + half:+.3g}){where}"
    if isinstance(law, LagLaw) and law.kind == "corner":
        hz = [law.lowest_hz * (size + way * half) for way in (0, -1, 1)]
        return f"lines below a corner of {hz[0]:.3g} Hz ({hz[1]:.3g} to {hz[2]:.3g}) fall off{where}"
    if leading.is_phase or (isinstance(law, LagLaw) and law.kind != "power"):
        turned = np.degrees([size, size - half, size + half]) * (1 if leading.is_phase else -1)
        low, high = sorted(turned[1:])
        return f"the phase by {turned[0]:+.3g}° ({low:+.3g} to {high:+.3g}){where}"
    if isinstance(law, LagLaw):
        return f"by a power of frequency of {-size:+.3g} ({-size - half:+.3g} to {-size + half:+.3g}){where}"
    return f"{100 * size:+.3g} % ({100 * (size - half):+.3g} to {100 * (size + half):+.3g}){where}"


def _where(leading: LeadingLaw, at: float) -> str:
    axis = leading.axis
    if leading.is_constant or leading.is_constant_phase:
        return ""
    if isinstance(leading.law, CurveLaw) and leading.law.shape.variant == TURN:
        return "on the way back"
    if axis is None:
        return f"at {in_digits(at, 3)} Hz"
    if axis.words:
        return f"at {axis.words[round(at)]}"
    if axis.name == "time_of_day":
        return f"at {int(at):02d}:{int(60 * (at % 1)):02d}"
    if axis.name == "recorded_at":
        return f"{in_digits(at, 3)} h after the first midnight"
    if axis.name == "order":
        return f"at recording {in_digits(at + 1, 3)}"
    return f"at {in_digits(at, 3)}{'' if axis.unit == '-' else ' ' + axis.unit}"


def _worth(held: Mapping[str, float | None], floor: float, what: str, beside: str) -> str:
    noise = f" (noise {in_digits(floor, 2)} %)" if np.isfinite(floor) else ""
    if held["before"] is None or held["after"] is None:
        return f"too few {what} to hold any out"
    after, before = in_digits(held["after"], 2), in_digits(held["before"], 2)
    if held["after"] >= held["before"]:
        return f"it predicts {what} held out no better: to {after} % instead of {before} %{noise}"
    return f"with it{beside}, {what} held out are predicted to {after} % instead of {before} %{noise}"

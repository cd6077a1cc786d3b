"""Units as instruments label them: `[mV]`, `Load (N)`, `height_m`, `m/s^2`, `Force (lbs)`, `Newtons`, `dB re 1 pC/N`.

A symbol counts as it is written (mN is not MN). A label that is no symbol may be a word (unit_words.py); one in the
wrong letters, `MHZ`, has every meaning that its letters have.
"""

import math
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

from underskin.recordings.readers.unit_words import DECIBEL, STANDARD_GRAVITY, dictionary
from underskin.recordings.shown_values import LONGEST_NAME
from underskin.units import LAB

_PREFIXES = {"": 1.0, "p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
_BASES = {
    "m": "length",
    "N": "force",
    "Pa": "pressure",
    "C": "charge",
    "s": "time",
    "Hz": "frequency",
    "V": "voltage",
    "A": "current",
}
_GRAM_FORCE = ("force", 1e-3 * STANDARD_GRAVITY)  # what g of a load cell means
_ROUNDING = 1e-9  # relative, of quotients of prefixes
_LONGEST = 40
_NO_UNITS = ("n/a",)  # although either side is one
_WHOLE = {
    "cm": ("length", 1e-2),
    "dm": ("length", 1e-1),
    "daN": ("force", 10.0),
    "dN": ("force", 1e-1),
    "cN": ("force", 1e-2),
    "hPa": ("pressure", 1e2),
    "m/s^2": ("acceleration", 1.0),
    "m/s2": ("acceleration", 1.0),
    "g": ("acceleration", STANDARD_GRAVITY),
    "N/m^2": ("pressure", 1.0),
    "N/m2": ("pressure", 1.0),
    "kN/m^2": ("pressure", 1e3),
    "kN/m2": ("pressure", 1e3),
    "N/mm^2": ("pressure", 1e6),
    "N/mm2": ("pressure", 1e6),
    "N/cm^2": ("pressure", 1e4),
    "N/cm2": ("pressure", 1e4),
}
_WORDS = dictionary(_BASES)
_USUAL_PREFIXES = {
    "Pa": "kMG",
    "Hz": "mkMG",
    "N": "mkMun",
    "V": "mkun",
    "m": "mun",
    "C": "pnum",
    "s": "mun",
}  # usual prefixes
_DIAMETER, _RADIUS = "indenter_diameter", "indenter_radius"
_DECIBEL = re.compile(
    r"(dB|db|DB) ?((?i:V|mV|uV|µV|m|u|N|C|g|A|FS|SPL|rms|mag)|[\s(/,].*)?|(?i:decibels?)|20 ?\*? ?log.*"
)
_SAYS_DECIBEL = re.compile(r"(?<![A-Za-z])(dB|DB)(?![A-Za-z])|(?i:decibel)|20 ?\*? ?log")
_LEAD = re.compile(r"(?i:in|units?|einheit)(\s*[:=]\s*|\s+)(?=\S)")
_AMPLITUDE = re.compile(r"[\s,_]*(?i:rms|peak|pk|pk-pk|p-?p|eff)\.?$")
_OVER = re.compile(r"\s+(?i:per|pro|par|por)\s+")
_RECIPROCAL = re.compile(r"\s*[·*⋅ ]\s*\(?([^\s·*⋅^()]+?)\)?\^?[-−]1$")
_BEHIND = re.compile(r"(?P<name>.*[^\s,:])(\s*/\s*|\s+in\s+|\s*[,:]\s*)(?P<unit>[^\s/,]+(/[^\s/,]+)?)\s*")
_LAST_WORD = re.compile(r".*\S\s+(?P<unit>\S{2,})")
_NO_LAST_WORD = ("in", "min", "mins", "bar", "mil", "foot", "grad", "second", "seconde", "secondo", "segundo", "hour")
_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>(?:[^\[\]()]|\([^\[\]()]*\))*)[\])]\s*$")
_BRACKETS = re.compile(r"[\[(]((?:[^\[\]()]|\([^\[\]()]*\))*)[\])]")


@dataclass(frozen=True)
class Unit:
    """What a unit measures (`force`, `charge/force`) and its factor to SI."""

    dimension: str
    to_si: float


def unit(label: str) -> Unit | None:
    """The unit that a label means, or None where it is none that is known here, or may be several."""
    known = meanings(label)
    return known[0] if len(known) == 1 else None


def meanings(label: str) -> tuple[Unit, ...]:
    """Every unit that a label may mean: one where it is written as a unit is, several where its letters are not those
    of one (MHZ: mHz or MHz), none where it is no unit."""
    return () if len(label) > _LONGEST else _meanings(label)


@lru_cache(maxsize=4096)
def _meanings(label: str) -> tuple[Unit, ...]:
    label = _LEAD.sub("", unicodedata.normalize("NFKC", label).strip().rstrip(".")).strip()
    whole = _IN_BRACKETS.match(label)
    if whole is not None and not whole["name"]:
        label = whole["unit"].strip()
    if label.casefold() in _NO_UNITS:
        return ()
    if _DECIBEL.fullmatch(label):
        return (Unit(DECIBEL, 1.0),)
    plain = _single(label)
    if plain is not None:
        return (plain,)
    for above, below in _fractions(label):
        both = product(meanings(above), meanings(below))
        ratios = [Unit(f"{one.dimension}/{other.dimension}", one.to_si / other.to_si) for one, other in both]
        if ratios:
            return tuple(dict.fromkeys(ratios))
    without = _AMPLITUDE.sub("", label)
    if without and without != label:
        return meanings(without)
    return _in_other_letters(label)


def _single(label: str) -> Unit | None:
    """The unit of a symbol as it is written, or of a word."""
    if label in _WHOLE:
        return Unit(*_WHOLE[label])
    for base, dimension in _BASES.items():
        prefix = label.removesuffix(base)
        if prefix != label and prefix in _PREFIXES:
            return Unit(dimension, _PREFIXES[prefix])
    word = _WORDS.get(label.casefold())
    return None if word is None else Unit(*word)


def _fractions(label: str) -> Iterator[tuple[str, str]]:
    """The two sides of a quotient: pC/N, pC per N, pC·N^-1."""
    for mark in _OVER.finditer(label):
        yield label[: mark.start()], label[mark.end() :]
    above, slash, below = label.rpartition("/")
    if slash:
        yield above, below
    reciprocal = _RECIPROCAL.search(label)
    if reciprocal is not None:
        yield label[: reciprocal.start()], reciprocal[1]


def _in_other_letters(label: str) -> tuple[Unit, ...]:
    """What a symbol in other capitals may mean: KHZ, mpa, Mpa."""
    is_plain = len(label) > 2 or label.isupper() or label.islower()  # Nm is not nm
    return _FOLDED.get(label.casefold(), ()) if is_plain and (len(label) > 1 or label in "nv") else ()


def _folded() -> dict[str, tuple[Unit, ...]]:
    """The units by their symbols in small letters, each with its usual prefixes."""
    found: dict[str, tuple[Unit, ...]] = {}
    for base, prefixes in _USUAL_PREFIXES.items():
        for prefix in ("", *prefixes):
            name = f"{prefix}{base}".casefold()
            found[name] = (*found.get(name, ()), Unit(_BASES[base], _PREFIXES[prefix]))
    return found


_FOLDED = _folded()


def field_unit(field: str) -> Unit:
    """The unit that a campaign field is kept in."""
    known = unit(LAB[field].unit)
    assert known is not None
    return known


def labelled_unit(heading: str) -> str:
    """The unit in a column's heading, or none (empty): in brackets, the last that hold a unit, or else those at its
    end; or, where it is a known one, behind its last underscore, a stroke, a comma, a colon or "in" (Kraft / mN), or
    its last word (Force lbs)."""
    if heading in LAB:
        return LAB[heading].unit
    tail = heading[-LONGEST_NAME:]
    inside = [text.strip() for text in _BRACKETS.findall(tail)]
    known = [text for text in inside if meanings(text)]
    if known or _IN_BRACKETS.match(tail):
        return known[-1] if known else inside[-1]
    if _SAYS_DECIBEL.search(tail):
        return "dB"
    _, underscore, last = heading.rpartition("_")
    if underscore and unit(last) is not None:
        return last
    behind = _BEHIND.fullmatch(tail)
    if behind is not None and unit(behind["unit"]) is not None:
        whole = heading.split()[-1]  # FRF pC/N is not in N
        return whole if "/" in whole and unit(whole) is not None else behind["unit"]
    word = _LAST_WORD.fullmatch(tail.strip())
    if word is not None and word["unit"].lower() not in _NO_LAST_WORD and unit(word["unit"]) is not None:
        return word["unit"]
    return ""


def contradicts(label: str, stated: str, heading: str, dimension: str) -> bool:
    """Whether a channel's label is none of the stated unit, for a quantity of this dimension.

    The end of a heading that does not mark it as a unit may be the name of an axis, a channel or a statistic (F_m, Q_A,
    Load cycles). It contradicts where it measures the quantity, or what was stated, or is a signal: decibels, or a
    voltage with a prefix.
    """
    labelled, meant = meanings(label), unit(stated)
    if label == "g":
        labelled += (Unit(*_GRAM_FORCE),)
    if not labelled or (meant is not None and any(_same(one, meant) for one in labelled)):
        return False
    if _is_marked(label, heading):
        return True
    told = {dimension, DECIBEL, *(["voltage"] if len(label) > 1 else []), *([meant.dimension] if meant else [])}
    return any(one.dimension in told for one in labelled)


def _same(one: Unit, other: Unit) -> bool:
    return one.dimension == other.dimension and math.isclose(one.to_si, other.to_si, rel_tol=_ROUNDING)


def _is_marked(label: str, heading: str) -> bool:
    """Whether a label is more than the end of a heading: the file's own, a field's, in brackets or behind a stroke."""
    if heading in LAB or label != labelled_unit(heading):
        return True
    in_brackets = [text.strip() for text in _BRACKETS.findall(heading[-LONGEST_NAME:])]
    return label in in_brackets or re.search(rf"\s/\s*{re.escape(label)}\s*$", heading[-LONGEST_NAME:]) is not None


def without_brackets(cell: str) -> str:
    """A cell without the brackets around the whole of it: `(ms)` is `ms`, `(pC)/N` stays."""
    whole = _IN_BRACKETS.match(cell.strip())
    return cell.strip() if whole is None or whole["name"] else whole["unit"].strip()


def in_brackets(heading: str) -> tuple[str, str] | None:
    """The name and the unit in brackets behind it; None where there is none."""
    bracketed = _IN_BRACKETS.match(heading[-LONGEST_NAME:])
    return None if bracketed is None else (bracketed["name"].strip(), bracketed["unit"].strip())


def lab_field(heading: str) -> tuple[str, float] | None:
    """The campaign field of a heading and the factor to its unit: `preload [mN]` is `preload_n`, 0.001, and
    `indenter_diameter_mm` is `indenter_radius_mm`, 0.5.

    None where the heading names no field that has a unit, or a unit of another dimension.
    """
    if heading.lower().replace(" ", "_").startswith(_DIAMETER):
        radius = lab_field(_RADIUS + heading[len(_DIAMETER) :])
        return None if radius is None else (radius[0], 0.5 * radius[1])
    bracketed = in_brackets(heading)
    if bracketed is None:
        return (heading, 1.0) if heading in LAB else None
    given = unit(bracketed[1])
    stem = bracketed[0].lower().replace(" ", "_")
    for name in LAB:
        known = field_unit(name) if name.startswith(f"{stem}_") and given else None
        if known and given and known.dimension == given.dimension and stem == _stem(name):
            return name, given.to_si / LAB[name].to_si
    return None


def _stem(field: str) -> str:
    suffix = LAB[field].unit.lower().replace("/", "_per_")
    return field.removesuffix(f"_{suffix}")

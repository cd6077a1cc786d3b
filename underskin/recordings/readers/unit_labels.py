"""Units as instruments label them: `[mV]`, `Load (N)`, `height_m`, `m/s^2`, `Force (lbs)`, `Newtons`, `dB re 1 pC/N`.

A symbol is case-sensitive (mN is not MN). Other labels may be words of several languages or common abbreviations,
looked up in lower case; an SI unit's word may have a prefix in words (`millinewtons`). A symbol in the wrong letters,
`MHZ`, has every meaning that its letters have. Products and quotients of units are exponents: N/m times m is N.
"""

import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

from underskin.recordings.validation import LONGEST_NAME
from underskin.units import GRAM_FORCE, LAB, POUND_FORCE

STANDARD_GRAVITY = 9.80665  # m/s²
_INCH = 25.4e-3  # m

# Words of each SI unit in English, French, German, Italian, Spanish, Russian, Chinese and Japanese where they differ.
_SI_WORDS: Mapping[str, str] = {
    "m": "meter meters metre metres mètre mètres metro metri metros метр м 米",
    "N": "newton newtons newtones ньютон ньютоны н niuton niutony 뉴턴 牛顿 牛 ニュートン",
    "Pa": "pascal pascals pascales паскаль па 帕斯卡 帕",
    "C": "coulomb coulombs culombio culombios кулон кл 库仑 库",
    "s": "sec secs second seconds seconde secondes sekunde sekunden secondo secondi segundo segundos секунда секунды "
    "сек с sekunda sekundy 초 秒",
    "Hz": "hertz герц гц 赫兹 赫 ヘルツ",
    "V": "volt volts voltio voltios вольт вольты в wolt wolty 볼트 伏特 伏 ボルト",
    "A": "amps ampere amperes ampère ampères amperio amperios ампер",
}
_PREFIX_WORDS: Mapping[float, str] = {
    1e-15: "femto",
    1e-12: "pico piko пико п 皮",
    1e-9: "nano нано н 纳",
    1e-6: "micro mikro микро мк 微",
    1e-3: "milli mili милли 毫 ミリ",
    1e-2: "zenti centi 厘",
    1e3: "kilo chilo кило к 千 キロ",
    1e6: "mega мега 兆",
    1e9: "giga",
}
_OTHERS: Mapping[tuple[str, float], str] = {
    ("force", POUND_FORCE): "lb lbs lbf lbsf lb-f pound pounds pound-force pounds-force pfund libra libras livre "
    "livres",
    ("force", POUND_FORCE / 16): "oz ozf ounce ounces",
    ("force", 1e-5): "dyne dynes",
    ("force", STANDARD_GRAVITY): "kg kgf kp kilopond kilogram kilograms kilogram-force kilogramm",
    ("force", GRAM_FORCE): "gf gram grams gramm gram-force pond",
    ("length", _INCH): "in inch inches zoll pouce pouces pulgada pulgadas pollice pollici",
    ("length", 12 * _INCH): "ft foot feet",
    ("length", 1e-3 * _INCH): "mil mils thou",
    ("length", 1e-6): "micron microns mikron мкм",
    ("length", 1e-3): "мм",
    ("pressure", POUND_FORCE / _INCH**2): "psi",
    ("pressure", 1e3 * POUND_FORCE / _INCH**2): "ksi",
    ("pressure", 1e5): "bar bars",
    ("pressure", 1e2): "mbar millibar",
    ("pressure", 101325.0): "atm",
    ("pressure", 133.322387415): "mmhg torr",
    ("time", 1e-3): "msec msecs мс",
    ("time", 1e-6): "usec usecs µsec мкс",
    ("time", 60.0): "min mins minute minutes minuten minuto minutos minuti мин 分",
    ("time", 3600.0): "h hr hrs hour hours stunde stunden heure heures hora horas ora ore час 小时",
    ("force", 1e-3): "мн",
    ("voltage", 1e-3): "мв",
    ("pressure", 1e6): "мпа",
    ("length", 1e-10): "å angstrom angstroms",
    ("frequency", 1.0): "cps",
    ("frequency", 1 / 60): "rpm r/min cpm 1/min",
    ("angle", 1.0): "rad rads radian radians radiant",
    ("angle", 1e3): "krad",
    ("angle", 1e-3): "mrad milliradian milliradians",
    ("angle", 6.283185307179586): "rev revs revolutions turns cycles",
    ("angle", 3.141592653589793 / 180): "deg degs degree degrees grad ° degré degrés gradi grado grados",
}
DECIBEL = "decibel"  # the dimension of a logarithm, which no field has


_PREFIXES = {
    "": 1.0, "f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1,
    "da": 1e1, "h": 1e2, "k": 1e3, "M": 1e6, "G": 1e9,
}  # fmt: skip
# Prefixes of some units alone: "fs" is a sampling rate, and "aC" a coupling
_ONLY_OF = {"f": ("C",), "c": ("N", "m"), "d": ("N", "m"), "da": ("N",), "h": ("Pa",)}
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
_GRAM_FORCE = ("force", GRAM_FORCE)  # g of a load cell
_ROUNDING = 1e-9  # relative, of quotients of prefixes
_LONGEST = 40
_NO_UNITS = ("n/a",)  # although either side is one
_NEWTONS = {"mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6}
_COMPOUND_UNITS = {
    "m/s^2": ("acceleration", 1.0),
    "m/s2": ("acceleration", 1.0),
    "g": ("acceleration", STANDARD_GRAVITY),
    **{
        f"{force}/{length}{mark}2": ("pressure", size / side**2)
        for force, size in {**_NEWTONS, "kgf": STANDARD_GRAVITY, "lbf": POUND_FORCE}.items()
        for length, side in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("in", _INCH))
        for mark in ("", "^")
    },
}
_WORDS = {
    f"{prefix}{word}": (_BASES[symbol], size)
    for symbol, words in _SI_WORDS.items()
    for size, prefixes in {1.0: "", **_PREFIX_WORDS}.items()
    for prefix in prefixes.split() or [""]
    for word in words.split()
} | {word: unit for unit, words in _OTHERS.items() for word in words.split()}
_USUAL_PREFIXES = {"Pa": "kMG", "Hz": "mkMG", "N": "mkMun", "V": "mkun", "m": "mun", "C": "pnum", "s": "mun"}
_DIAMETER, _RADIUS = "indenter_diameter", "indenter_radius"
_DECIBEL_WORD = r"d[eé][cz]ib[eè]l\w*|дБ|децибел\w*|分贝|デシベル"  # in the languages of instruments
_DECIBEL = re.compile(
    r"(dB|db|DB) ?((?i:V|mV|uV|µV|m|u|N|C|g|A|FS|SPL|rms|mag)|[\s(/,].*)?|20 ?\*? ?log.*|"
    rf"(?i:{_DECIBEL_WORD}|pegel|log(?:arithmi[ck]\w*)?(?: ?mag(?:nitude)?)?)"
)
_SAYS_DECIBEL = re.compile(rf"(?<![A-Za-z])(dB|DB)(?![A-Za-z])|20 ?\*? ?log|(?i:{_DECIBEL_WORD}|\bpegel\b|\blog ?mag)")
_REFERENCE = re.compile(r"(?i:dB)\s*(?:\(|(?i:re|rel|ref)\.?)\s*(?:1(?:\.0*)?\s*)?(?P<unit>[^\s()\d][^()]*?)\s*\)?")
_LEAD = re.compile(r"(?i:in|units?|einheit)(\s*[:=]\s*|\s+)(?=\S)")
_AMPLITUDE = re.compile(r"[\s,_]*(?i:rms|peak|pk|pk-pk|p-?p|eff)\.?$")
_STATISTIC = re.compile(r"(?i)(?<![a-z])(?:(rms|rqs|eff)|(p-?p|p2p|pk-?pk|peak.to.peak)|(peak|pk))(?![a-z])")
_OVER = re.compile(r"\s+(?i:per|pro|par|por)\s+")
_RECIPROCAL = re.compile(r"\s*[·*⋅. ]\s*\(?([^\s·*⋅^()]+?)\)?\^?[-−]1$")
_BEHIND = re.compile(r"(?P<name>.*[^\s,:])(\s*/\s*|\s+in\s+|\s*[,:]\s*)(?P<unit>[^\s/,]+(/[^\s/,]+)?)\s*")
_LAST_WORD = re.compile(r".*\S\s+(?P<unit>\S{2,})")
_NO_LAST_WORD = ("in", "min", "mins", "bar", "mil", "foot", "grad", "second", "seconde", "secondo", "segundo", "hour")
_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>(?:[^\[\]()]|\([^\[\]()]*\))*)[\])]\s*$")
_BRACKETS = re.compile(r"[\[(]((?:[^\[\]()]|\([^\[\]()]*\))*)[\])]")


@dataclass(frozen=True)
class Unit:
    """The dimension of a unit (`force`, `charge/force`) and its factor to SI."""

    dimension: str
    to_si: float


def unit(label: str) -> Unit | None:
    """The unit of a label; None where it is unknown or ambiguous."""
    candidates = meanings(label)
    return candidates[0] if len(candidates) == 1 else None


def meanings(label: str) -> tuple[Unit, ...]:
    """All units that a label may mean: one for a correctly written unit, several where its letters are ambiguous (MHZ:
    mHz or MHz), none where it is no unit."""
    return () if len(label) > _LONGEST else _meanings(label)


@lru_cache(maxsize=4096)
def _meanings(label: str) -> tuple[Unit, ...]:
    label = _LEAD.sub("", unicodedata.normalize("NFKC", label).strip().rstrip(".")).strip()
    bracketed = _IN_BRACKETS.match(label)
    if bracketed is not None and not bracketed["name"]:
        label = bracketed["unit"].strip()
    if label.casefold() in _NO_UNITS:
        return ()
    if _DECIBEL.fullmatch(label):
        return (Unit(DECIBEL, 1.0),)
    single = _single(label)
    if single is not None:
        return (single,)
    for above, below in _fractions(label):
        both = product(meanings(above), meanings(below))
        ratios = [_ratio(numerator, denominator) for numerator, denominator in both]
        if ratios:
            return tuple(dict.fromkeys(ratios))
    without = _AMPLITUDE.sub("", label)
    if without and without != label:
        return meanings(without)
    return _in_other_letters(label)


def _ratio(above: Unit, below: Unit) -> Unit:
    """The unit of a quotient; an angle over a time is a frequency, of whole turns."""
    if (above.dimension, below.dimension) == ("angle", "time"):
        return Unit("frequency", above.to_si / (2 * math.pi * below.to_si))
    return Unit(f"{above.dimension}/{below.dimension}", above.to_si / below.to_si)


def decibel_reference(label: str) -> str | None:
    """The unit that decibels are relative to: pC/N of `dB re 1 pC/N`; None where the label states none."""
    stated = _REFERENCE.fullmatch(unicodedata.normalize("NFKC", label).strip())
    return stated["unit"] if stated is not None and unit(stated["unit"]) is not None else None


def _single(label: str) -> Unit | None:
    """The unit of a symbol as written, or of a word."""
    if label in _COMPOUND_UNITS:
        return Unit(*_COMPOUND_UNITS[label])
    for base, dimension in _BASES.items():
        prefix = label.removesuffix(base)
        if prefix != label and prefix in _PREFIXES and base in _ONLY_OF.get(prefix, _BASES):
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
    """The meanings of a symbol in other capitals: KHZ, mpa, Mpa."""
    is_plain = len(label) > 2 or label.isupper() or label.islower()  # Nm is not nm
    return _FOLDED.get(label.casefold(), ()) if is_plain and (len(label) > 1 or label in "nv") else ()


def _folded() -> dict[str, tuple[Unit, ...]]:
    """The units by their symbols in lower case, each with its usual prefixes."""
    units: dict[str, tuple[Unit, ...]] = {}
    for base, prefixes in _USUAL_PREFIXES.items():
        for prefix in ("", *prefixes):
            name = f"{prefix}{base}".casefold()
            units[name] = (*units.get(name, ()), Unit(_BASES[base], _PREFIXES[prefix]))
    return units


_FOLDED = _folded()


def field_unit(field: str) -> Unit:
    """The unit of a campaign field."""
    parsed = unit(LAB[field].unit)
    assert parsed is not None
    return parsed


def labelled_unit(heading: str) -> str:
    """The unit in a column's heading, empty without one: in the last brackets that hold a unit, or else those at its
    end; or a known unit after the last underscore, a slash, a comma, a colon or "in" (Kraft / mN), or the last word
    (Force lbs)."""
    if heading in LAB:
        return LAB[heading].unit
    tail = heading[-LONGEST_NAME:]
    bracketed = [text.strip() for text in _BRACKETS.findall(tail)]
    units = [text for text in bracketed if meanings(text)]
    if units or _IN_BRACKETS.match(tail):
        return units[-1] if units else bracketed[-1]
    if _SAYS_DECIBEL.search(tail):
        return "dB"
    _, underscore, last = heading.rpartition("_")
    if underscore and unit(last) is not None:
        return last
    behind = _BEHIND.fullmatch(tail)
    if behind is not None and unit(behind["unit"]) is not None:
        last_word = heading.split()[-1]  # FRF pC/N is not in N
        return last_word if "/" in last_word and unit(last_word) is not None else behind["unit"]
    word = _LAST_WORD.fullmatch(tail.strip())
    if word is not None and word["unit"].lower() not in _NO_LAST_WORD and unit(word["unit"]) is not None:
        return word["unit"]
    return ""


MIXED_AMPLITUDES = (
    "says rms or peak-to-peak of charge or force alone; an FRF is amplitude over amplitude: convert it in a formula"
)


def mixes_amplitudes(name: str, label: str) -> bool:
    """Whether the name or the unit of a ratio says rms or peak-to-peak of one of its two quantities alone."""
    said = [mark.lastindex for mark in _STATISTIC.finditer(name if label in name else f"{name} {label}")]
    return any(statistic != 3 for statistic in said) and not (len(said) == 2 and said[0] == said[1])  # 3: amplitudes


def contradicts(label: str, stated: str, heading: str, dimension: str) -> bool:
    """Whether a channel's label contradicts the stated unit, for a quantity of this dimension.

    An unmarked end of a heading may be the name of an axis, a channel or a statistic (F_m, Q_A, Load cycles). It
    contradicts only where it has the dimension of the quantity or of the stated unit, or is a signal: decibels, or a
    voltage with a prefix.
    """
    labelled, meant = meanings(label), unit(stated)
    if label == "g":
        labelled += (Unit(*_GRAM_FORCE),)
    alike = [meaning.to_si for meaning in labelled if meant is not None and meaning.dimension == meant.dimension]
    if not labelled or (meant and any(math.isclose(size, meant.to_si, rel_tol=_ROUNDING) for size in alike)):
        return False
    if _is_marked(label, heading):
        return True
    dimensions = {dimension, DECIBEL, *(["voltage"] if len(label) > 1 else []), *([meant.dimension] if meant else [])}
    return any(meaning.dimension in dimensions for meaning in labelled)


def _is_marked(label: str, heading: str) -> bool:
    """Whether a label is marked as a unit: by the file, by a field, in brackets or after a slash."""
    if heading in LAB or label != labelled_unit(heading):
        return True
    in_brackets = [text.strip() for text in _BRACKETS.findall(heading[-LONGEST_NAME:])]
    return label in in_brackets or re.search(rf"\s/\s*{re.escape(label)}\s*$", heading[-LONGEST_NAME:]) is not None


def without_brackets(cell: str) -> str:
    """A cell without brackets that enclose all of it: `(ms)` is `ms`, `(pC)/N` is unchanged."""
    bracketed = _IN_BRACKETS.match(cell.strip())
    return cell.strip() if bracketed is None or bracketed["name"] else bracketed["unit"].strip()


def in_brackets(heading: str) -> tuple[str, str] | None:
    """The name and the unit in brackets after it; None without one."""
    bracketed = _IN_BRACKETS.match(heading[-LONGEST_NAME:])
    return None if bracketed is None else (bracketed["name"].strip(), bracketed["unit"].strip())


def lab_field(heading: str) -> tuple[str, float] | None:
    """The campaign field of a heading and the factor to its unit: `preload [mN]` is `preload_n`, 0.001, and
    `indenter_diameter_mm` is `indenter_radius_mm`, 0.5.

    None where the heading names no field with a unit, or has a unit of another dimension.
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
        candidate = field_unit(name) if name.startswith(f"{stem}_") and given else None
        if candidate and given and candidate.dimension == given.dimension and stem == _stem(name):
            return name, given.to_si / LAB[name].to_si
    return None


def _stem(field: str) -> str:
    suffix = LAB[field].unit.lower().replace("/", "_per_")
    return field.removesuffix(f"_{suffix}")


Exponents = tuple[int, int, int, int]  # of length, force, charge and time

NO_DIMENSION: Exponents = (0, 0, 0, 0)
_EXPONENTS: dict[str, Exponents] = {
    "length": (1, 0, 0, 0),
    "force": (0, 1, 0, 0),
    "charge": (0, 0, 1, 0),
    "time": (0, 0, 0, 1),
    "pressure": (-2, 1, 0, 0),
    "frequency": (0, 0, 0, -1),
    "voltage": (1, 1, -1, 0),
    "current": (0, 0, 1, -1),
    "acceleration": (1, 0, 0, -2),
}
_SI = ("m", "N", "C", "s", "Pa", "Hz", "V", "A", "m/s^2")
_PARTS = ("m", "N", "C", "s", "V")
_FRF = "C/N"  # before m/V, which has the same dimension
_SI_RATIOS = (_FRF, *(f"{above}/{below}" for above, below in product(_PARTS, _PARTS) if above != below))


def times(first: Exponents, second: Exponents, sign: int = 1) -> Exponents:
    """The exponents of a product; of the quotient where `sign` is -1."""
    length, force, charge, time = (
        exponent + sign * second_exponent for exponent, second_exponent in zip(first, second, strict=True)
    )
    return length, force, charge, time


def exponents(label: str) -> Exponents | None:
    """The exponents of a unit, `1` for a number without one; None for an unknown unit."""
    if label == "1":
        return NO_DIMENSION
    parsed = unit(label)
    if parsed is None:
        return None
    parts = [_EXPONENTS.get(part) for part in parsed.dimension.split("/")]
    result, *below = parts
    for part in below:
        result = None if result is None or part is None else times(result, part, -1)
    return result


def ratio_of(label: str, signal: str, quantity: str) -> Exponents | None:
    """The exponents of label/signal · quantity; None where a unit is unknown."""
    given, divided, measured = exponents(label), exponents(signal), exponents(quantity)
    if given is None or divided is None or measured is None:
        return None
    return times(times(given, divided, -1), measured)


def label_of(dimension: Exponents, preferred: Iterable[str]) -> str | None:
    """A unit of these exponents: the first preferred one that has them, else one of SI; empty where they are all 0.

    None where no single unit, and no quotient of two, has them.
    """
    if dimension == NO_DIMENSION:
        return ""
    return next((label for label in (*preferred, *_SI, *_SI_RATIOS) if exponents(label) == dimension), None)


def described(dimension: Exponents) -> str:
    """In words for an error: `m`, `N·m^-2`, "no unit"."""
    label = label_of(dimension, ())
    if label is not None:
        return f"the unit {label}" if label else "no unit"
    powers = [f"{base}^{power}" if power != 1 else base for base, power in zip(_SI, dimension, strict=False) if power]
    return f"the unit {'·'.join(powers)}"

"""Units written out: the words of several languages, and common abbreviations, for the units of `unit_labels`.

A word is looked up in small letters. An SI unit's word may have a prefix in words before it (`millinewtons`).
"""

from collections.abc import Iterator, Mapping

STANDARD_GRAVITY = 9.80665  # m/s²
_POUND = 4.4482216152605  # N, of a pound-force
_INCH = 25.4e-3  # m

# Of each SI unit, in English, French, German, Italian, Spanish, Russian, Chinese and Japanese where they differ.
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
_PREFIX_WORDS: Mapping[str, float] = {
    "pico": 1e-12,
    "piko": 1e-12,
    "nano": 1e-9,
    "micro": 1e-6,
    "mikro": 1e-6,
    "milli": 1e-3,
    "mili": 1e-3,
    "zenti": 1e-2,
    "centi": 1e-2,
    "kilo": 1e3,
    "chilo": 1e3,
    "mega": 1e6,
    "giga": 1e9,
    "пико": 1e-12,
    "нано": 1e-9,
    "микро": 1e-6,
    "милли": 1e-3,
    "кило": 1e3,
    "мега": 1e6,
    "п": 1e-12,
    "н": 1e-9,
    "мк": 1e-6,
    "к": 1e3,
    "皮": 1e-12,
    "纳": 1e-9,
    "微": 1e-6,
    "毫": 1e-3,
    "厘": 1e-2,
    "千": 1e3,
    "兆": 1e6,
    "ミリ": 1e-3,
    "キロ": 1e3,
}
_OTHERS: Mapping[tuple[str, float], str] = {
    ("force", _POUND): "lb lbs lbf lbsf lb-f pound pounds pound-force pounds-force pfund libra libras livre livres",
    ("force", _POUND / 16): "oz ozf ounce ounces",
    ("force", 1e-5): "dyne dynes",
    ("force", STANDARD_GRAVITY): "kg kgf kp kilopond kilogram kilograms kilogram-force kilogramm",
    ("force", 1e-3 * STANDARD_GRAVITY): "gf gram grams gramm gram-force pond",
    ("length", _INCH): "in inch inches zoll pouce pouces pulgada pulgadas pollice pollici",
    ("length", 12 * _INCH): "ft foot feet",
    ("length", 1e-3 * _INCH): "mil mils thou",
    ("length", 1e-6): "micron microns mikron мкм",
    ("length", 1e-3): "мм",
    ("pressure", _POUND / _INCH**2): "psi",
    ("pressure", 1e3 * _POUND / _INCH**2): "ksi",
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
    ("frequency", 1 / 60): "rpm r/min cpm 1/min",
    ("angle", 1.0): "rad rads radian radians radiant",
    ("angle", 1e-3): "mrad milliradian milliradians",
    ("angle", 6.283185307179586): "rev revs revolutions turns cycles",
    ("angle", 3.141592653589793 / 180): "deg degs degree degrees grad ° degré degrés gradi grado grados",
}
DECIBEL = "decibel"  # the dimension of a logarithm, which no field has


def _words(dimensions: Mapping[str, str]) -> Iterator[tuple[str, tuple[str, float]]]:
    for symbol, words in _SI_WORDS.items():
        for word in words.split():
            yield word, (dimensions[symbol], 1.0)
            for prefix, size in _PREFIX_WORDS.items():
                yield f"{prefix}{word}", (dimensions[symbol], size)
    for unit, words in _OTHERS.items():
        yield from ((word, unit) for word in words.split())


def dictionary(dimensions: Mapping[str, str]) -> dict[str, tuple[str, float]]:
    """Dimension and factor to SI by each word in small letters; `dimensions` are those of the SI units."""
    return dict(_words(dimensions))

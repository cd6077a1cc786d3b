"""Exports as twelve instruments write them in five locales: read without a rig description where the file says enough,
else refused by what it does not say; the numbers, names and units are those that were written."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from tests.recordings.contents_of_files import contents
from underskin.errors import FileError
from underskin.recordings import read_file
from underskin.recordings.campaign import COLUMNS, Campaign, IndentationRecording
from underskin.recordings.readers.unit_labels import unit


@dataclass(frozen=True)
class Locale:
    """How a country writes numbers and tables, and what its instruments call the columns."""

    separator: str
    decimal: str
    encoding: str
    end: str
    words: dict[str, str]

    def number(self, value: float, digits: int = 6) -> str:
        return f"{value:.{digits}f}".replace(".", self.decimal)

    def rows(self, *columns: np.ndarray, quoted: bool = False, separator: str = "") -> list[str]:
        cells = [[self.number(value) for value in row] for row in np.stack(columns, axis=1).tolist()]
        cells = [[f'"{cell}"' for cell in row] for row in cells] if quoted else cells
        return [(separator or self.separator).join(row) for row in cells]

    def joined(self, *cells: str) -> str:
        return self.separator.join(cells)

    def __getitem__(self, word: str) -> str:
        return self.words[word]


def words(*translated: str) -> dict[str, str]:
    known = ("force", "travel", "time", "charge", "frequency", "magnitude", "phase", "coherence", "radius", "height")
    return dict(zip((*known, "diameter", "preload", "dynamic"), translated, strict=True))


LOCALES = {
    "en": Locale(",", ".", "utf-8", "\r\n", words(
        "Force", "Extension", "Time", "Charge", "Frequency", "Magnitude", "Phase", "Coherence", "Tip radius",
        "Specimen height", "Specimen diameter", "Preload", "Dynamic force")),
    "de": Locale(";", ",", "latin-1", "\r\n", words(
        "Kraft", "Weg", "Zeit", "Ladung", "Frequenz", "Betrag", "Winkel", "Kohärenz", "Kugel-Radius",
        "Probenhöhe", "Probendurchmesser", "Vorkraft", "Dynamische Kraft")),
    "fr": Locale(";", ",", "utf-8-sig", "\n", words(
        "Force", "Déplacement", "Temps", "Charge", "Fréquence", "Module", "Phase", "Cohérence", "Rayon de bille",
        "Hauteur de l'éprouvette", "Diamètre de l'éprouvette", "Précharge", "Force dynamique")),
    "it": Locale("\t", ",", "utf-16", "\r\n", words(
        "Forza", "Corsa", "Tempo", "Carica", "Frequenza", "Modulo", "Fase", "Coerenza", "Raggio della sfera",
        "Altezza del provino", "Diametro del provino", "Precarico", "Forza dinamica")),
    "es": Locale(";", ".", "utf-8", "\r", words(
        "Fuerza", "Recorrido", "Tiempo", "Carga", "Frecuencia", "Módulo", "Fase", "Coherencia", "Radio de la esfera",
        "Altura de la probeta", "Diámetro de la probeta", "Precarga", "Fuerza dinámica")),
}  # fmt: skip

TIME = np.arange(40) / 50
TRAVEL = np.concatenate([np.linspace(0.0, 0.4, 20), np.linspace(0.38, 0.0, 20)])
FORCE = 0.5 * TRAVEL**1.5
FREQUENCY = 10.0 * np.arange(1, 25)
FRF = 7.4 * np.exp(-1j * np.radians(0.1 * FREQUENCY))
COHERENCE = np.full(24, 0.99)
CHARGE = 7.4 * FORCE
SKIN = ("skin.thickness_mm", "skin.youngs_modulus_mpa", "skin.sensor_radius_mm")

Columns = list[tuple[str, str, np.ndarray]]  # name, unit, values as written


@dataclass(frozen=True)
class Export:
    """A file, what its columns hold, and either the fields of its only recording or what it does not say."""

    lines: list[str]
    columns: Columns
    fields: dict[str, float | np.ndarray] | None = None
    lacks: str = ""


def curve(locale: Locale, length: str = "mm", force: str = "N") -> Columns:
    scale = {"mm": 1.0, "µm": 1e3, "N": 1.0, "mN": 1e3}
    return [
        (locale["time"], "s", TIME),
        (locale["travel"], length, TRAVEL * scale[length]),
        (locale["force"], force, FORCE * scale[force]),
    ]


def bracketed(columns: Columns) -> list[str]:
    return [f"{name} [{label}]" for name, label, _ in columns]


def numbers(columns: Columns) -> list[np.ndarray]:
    return [values for *_, values in columns]


PRESSED: dict[str, float | np.ndarray] = {"displacement_mm": TRAVEL, "force_n": FORCE}
SPECIMEN: dict[str, float | np.ndarray] = {**PRESSED, "sample_height_mm": 10.0, "sample_diameter_mm": 20.0}


def units_below_names(locale: Locale) -> Export:
    """Names, units on a line of their own; the specimen above (Zwick, Schenck)."""
    columns = curve(locale)
    above = [locale.joined(locale["height"], locale.number(10.0), "mm")]
    above += [locale.joined(locale["diameter"], locale.number(20.0), "mm"), ""]
    headings = [locale.joined(*(name for name, *_ in columns)), locale.joined(*(label for _, label, _ in columns))]
    return Export([*above, *headings, *locale.rows(*numbers(columns))], columns, SPECIMEN)


def compression_machine(locale: Locale) -> Export:
    """Units in brackets under quoted names, and a strain that names the kind (Instron)."""
    columns = [*curve(locale), ("Compressive strain", "%", 10 * TRAVEL)]
    above = [f"{locale['height']} [mm]: {locale.number(10.0)}", f"{locale['diameter']} [mm]: {locale.number(20.0)}", ""]
    headings = [locale.joined(*(f'"{name}"' for name, *_ in columns))]
    headings += [locale.joined(*(f'"({label})"' for _, label, _ in columns))]
    return Export([*above, *headings, *locale.rows(*numbers(columns), quoted=True)], columns, SPECIMEN)


def units_behind_names(locale: Locale) -> Export:
    """Names with units, nothing else (MTS, LabVIEW tables)."""
    columns = curve(locale)
    return Export(
        [locale.joined(*bracketed(columns)), *locale.rows(*numbers(columns))], columns, lacks="indenter_radius_mm"
    )


def nanoindenter(locale: Locale) -> Export:
    """Tab-separated, properties with a unit behind, a line between names and numbers (Optics11, Hysitron)."""
    columns = curve(locale, "µm", "mN")
    above = [f"{locale['radius']} (mm)\t{locale.number(2.5)}", "Operator\tmb", ""]
    headings = ["\t".join(f"{name} ({label})" for name, label, _ in columns)]
    rows = locale.rows(*numbers(columns), separator="\t")
    return Export([*above, *headings, *rows], columns, {**PRESSED, "indenter_radius_mm": 2.5})


def comments_above(locale: Locale) -> Export:
    """Names and units in comments (AFM software)."""
    columns = curve(locale, "µm", "mN")
    above = [f"# {locale['radius']} [mm]: {locale.number(2.5)}"]
    above += ["# columns: " + " ".join(f'"{name}"' for name, *_ in columns)]
    above += ["# units: " + " ".join(label for _, label, _ in columns)]
    rows = locale.rows(*numbers(columns), separator=" ")
    return Export([*above, *rows], columns, {**PRESSED, "indenter_radius_mm": 2.5})


def analyser(locale: Locale, label: str = "pC/N") -> Columns:
    return [
        (locale["frequency"], "Hz", FREQUENCY),
        (locale["magnitude"], label, np.abs(FRF)),
        (locale["phase"], "deg", np.degrees(np.angle(FRF))),
        (locale["coherence"], "", COHERENCE),
    ]


def conditions(locale: Locale) -> list[str]:
    values = (("thickness_mm", 2.5), ("youngs_modulus_mpa", 16.0), ("sensor_radius_mm", 1.5))
    above = [locale.joined(f"skin.{name}", locale.number(value)) for name, value in values]
    above += [locale.joined(f"{locale['radius']} [mm]", locale.number(4.0))]
    above += [locale.joined(f"{locale['preload']} [N]", locale.number(1.0))]
    return [*above, locale.joined(f"{locale['dynamic']} [mN]", locale.number(50.0)), ""]


ANALYSED: dict[str, float | np.ndarray] = {
    "frequency_hz": FREQUENCY, "frf_re_pc_per_n": FRF.real, "frf_im_pc_per_n": FRF.imag,
    "preload_n": 1.0, "dynamic_force_n": 0.05, "indenter_radius_mm": 4.0,
}  # fmt: skip


def frf_with_conditions(locale: Locale) -> Export:
    """Magnitude and phase under a header that states skin, sphere and forces."""
    columns = analyser(locale)
    names = [f"{name} [{label}]" if label else name for name, label, _ in columns]
    lines = [*conditions(locale), locale.joined(*names), *locale.rows(*numbers(columns))]
    return Export(lines, columns, {**ANALYSED, "coherence": COHERENCE})


def frf_real_and_imaginary(locale: Locale) -> Export:
    """Real and imaginary part under their units (Testlab)."""
    columns = [
        (locale["frequency"], "Hz", FREQUENCY), ("Real", "pC/N", FRF.real), ("Imag", "pC/N", FRF.imag),
    ]  # fmt: skip
    headings = [locale.joined(*(name for name, *_ in columns)), locale.joined(*(label for _, label, _ in columns))]
    return Export([*conditions(locale), *headings, *locale.rows(*numbers(columns))], columns, ANALYSED)


def frf_alone(locale: Locale) -> Export:
    """An FRF without a word on what was measured (analysers)."""
    columns = analyser(locale)[:3]
    return Export([locale.joined(*bracketed(columns)), *locale.rows(*numbers(columns))], columns, lacks=SKIN[0])


def frf_in_decibels(locale: Locale) -> Export:
    """A magnitude in dB without its reference."""
    columns = analyser(locale, "dB")[:3]
    lines = [*conditions(locale), locale.joined(*bracketed(columns)), *locale.rows(*numbers(columns))]
    return Export(lines, columns, lacks="decibels are a logarithm")


def oscilloscope(locale: Locale) -> Export:
    """A header of settings, then volts (Tektronix, Keysight)."""
    columns = [("x-axis", "second", TIME), ("1", "Volt", FORCE), ("2", "Volt", CHARGE)]
    above = [locale.joined("Model", "MDO3024"), locale.joined("Gating", "0.0% to 100.0%"), ""]
    headings = [locale.joined(*(name for name, *_ in columns)), locale.joined(*(label for _, label, _ in columns))]
    return Export([*above, *headings, *locale.rows(*numbers(columns))], columns, lacks=SKIN[0])


def data_logger(locale: Locale) -> Export:
    """Force and charge over time without the conditions, with a column of words (catman, Dewesoft)."""
    columns = [(locale["time"], "s", TIME), (locale["force"], "N", FORCE), (locale["charge"], "pC", CHARGE)]
    rows = [
        locale.joined(row, "ok" if number % 7 else "trigger")
        for number, row in enumerate(locale.rows(*numbers(columns)))
    ]
    return Export([locale.joined(*bracketed(columns), "Event"), *rows], columns, lacks="recording.preload_n")


def two_travels(locale: Locale) -> Export:
    """Two columns of which either may be the depth."""
    columns = [*curve(locale), (f"{locale['travel']} 2", "mm", 0.9 * TRAVEL)]
    above = [f"{locale['radius']} [mm]: {locale.number(2.5)}", ""]
    lines = [*above, locale.joined(*bracketed(columns)), *locale.rows(*numbers(columns))]
    return Export(lines, columns, lacks="more than one column or property may be displacement_mm")


LAYOUTS: tuple[Callable[[Locale], Export], ...] = (
    units_below_names, compression_machine, units_behind_names, nanoindenter, comments_above, frf_with_conditions,
    frf_real_and_imaginary, frf_alone, frf_in_decibels, oscilloscope, data_logger, two_travels,
)  # fmt: skip


def assert_recorded(campaign: Campaign, fields: dict[str, float | np.ndarray]) -> None:
    (recording,) = campaign.recordings
    for name, value in fields.items():
        assert getattr(recording, name) == pytest.approx(value, rel=1e-5, abs=2e-6), name
    columns = {name for name in COLUMNS if getattr(recording, name, None) is not None}
    assert columns - {"time_s"} == {name for name in fields if name in COLUMNS}


@pytest.mark.parametrize("name", LOCALES)
@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_exports(layout: Callable[[Locale], Export], name: str) -> None:
    """Columns, names and units are those written, and the recording is read without a rig description, or refused."""
    locale = LOCALES[name]
    export = layout(locale)
    data = (locale.end.join(export.lines) + locale.end).encode(locale.encoding)
    (block,) = contents(data, "run.txt").blocks
    assert len(block.channels) == len(export.columns)
    for channel, (heading, label, values) in zip(block.channels, export.columns, strict=True):
        assert channel.name.startswith(heading)
        assert channel.label == label or unit(channel.label) == unit(label)
        assert channel.values == pytest.approx(values, abs=1e-6)
    if export.fields is None:
        with pytest.raises(FileError) as refused:
            read_file(data, "run.txt")
        assert export.lacks in str(refused.value)
        return
    reading = read_file(data, "run.txt")
    assert reading.problems == []
    assert reading.warnings[0].startswith("read without a rig description, by headings and units: ")
    assert_recorded(reading.campaign, export.fields)


@pytest.mark.parametrize(
    ("above", "radius_mm"),
    [
        (["Probe radius [mm],2"], 2.0),
        (["Probenradius [mm],9", "Probendurchmesser [mm],18", "Kugelradius [mm],2"], 2.0),
        (["Radius der Probe [mm],9", "Tip radius [mm],2"], 2.0),
        (["Dish radius [mm],35", "Indenter radius [mm],2"], 2.0),
        (["Dish radius [mm],35", "Tip radius [mm],2"], None),
        (["Fillet radius [mm],0.5", "Probe radius [mm],2"], None),
    ],
)
def test_radius_among_properties(above: list[str], radius_mm: float | None) -> None:
    """The sphere's radius is the only one of no sample, or the one called so; of two the file is refused."""
    columns = curve(LOCALES["en"])
    lines = [*above, "", ",".join(bracketed(columns)), *LOCALES["en"].rows(*numbers(columns))]
    data = "\n".join(lines).encode()
    if radius_mm is None:
        names = " or ".join(repr(line.partition(",")[0]) for line in above)
        with pytest.raises(FileError, match=re.escape(f"column or property may be indenter_radius_mm ({names})")):
            read_file(data, "run.csv")
        return
    (recording,) = read_file(data, "run.csv").campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.indenter_radius_mm == radius_mm

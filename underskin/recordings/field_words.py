"""The words by which files call the fields of recordings and skins, in five languages: one table for all.

A heading of a column, a property of a header or the name of an array says a field where it is the field's own name
(`preload_n`, `Preload [mN]`), or holds one of the field's words and a unit of its dimension: `Vorspannkraft (N)`.
"""

import re
from collections.abc import Mapping

from underskin.recordings.readers import text
from underskin.recordings.readers.unit_labels import in_brackets, lab_field, labelled_unit, unit
from underskin.units import LAB

_SENSOR = "sensor|taxel|capteur|fühler"
OF_SENSORS = re.compile(_SENSOR, re.IGNORECASE)
# "probe" is German for a sample, English for what presses
_SAMPLE = (
    "sample|specimen|proben|(?:der|die) probe|probe(?=.*(?:höhe|durchmesser))|(?:höhe|durchmesser).*probe|prüf"
    "|éprouvette|provino|probeta"
)
_RADIUS, _DIAMETER = r"radi[ou]|rayon|raggio", r"dia\w*m|durchmesser|diamètre|di[aá]metr|[øØ⌀]"
_SPHERE = "sphere|ball|bead|tip\\b|indent|kugel|bille|sph[eè]re|sfera|esfera|bola"  # others are those of samples
_LAST = r"(load cycles|lastwechsel|lastspiele|cycles de charge|cicli di carico|ciclos de carga)"
_RATE = r"fs|(sampl\w*|data)[ _-]?(rate|freq\w*)|abtast(rate|freq\w*)|\w*chantillonnage|campionamento|muestreo"
_THICKNESS = "(?:schicht|haut|elastomer|gummi|silikon)?(?:dicke|stärke)|thickness|[ée]paisseur|spessore|espesor|grosor"
# What else the names of a thickness and a modulus may hold: others are those of films, glue and bases
_OF_LAYER = re.compile(
    rf"{_THICKNESS}|skin|layer|elastomer|rubber|silicone|cover|haut|schicht|gummi|silikon|couche|peau|[ée]lastomère"
    r"|caoutchouc|strato|pelle|gomma|capa|piel|goma|elast[oó]mero|of|the|der|des|de|du|la|le|di|del|dello|della|d|l|s"
    r"|nominal|declared|mm|mpa|h|e|youngs?|m[oó]d[uú]l(us|e|o)?|elasti[zc]itätsmodul|[eé]l[aá]sti(c|co|city|que|cità|cité|cidad)"
)
# Of each field the dimension of its unit (none: it has no unit, and the words are all of the name), and words in
# English, German, French, Italian and Spanish, as a pattern of the name in lower case.
WORDS: tuple[tuple[str, str, str], ...] = (
    ("sample_rate_hz", "", rf"({_RATE})"),
    ("sample_rate_hz", "frequency", rf"^({_RATE}|.*(chantillonnage|campionamento|muestreo))"),
    ("load_cycles", "", _LAST),
    ("sensor", "", rf"(?:{_SENSOR})[es]?( ?(id|no|nr|name|number|nummer|numéro|n°)\.?)?"),
    ("poisson_ratio", "", r".*(poisson|quer(kontraktion|dehn)).*"),
    ("dynamic_force_n", "force", r"dyn|din[aá]mic|oscill|schwing|wechsellast"),
    ("preload_n", "force", r"pre-?load|stati|stát|vor(last|kraft|spann)|pr[ée]-?(charge|contrainte|tension)|precar"),
    ("sensor_radius_mm", "length", rf"^(?=.*({_SENSOR}))(?=.*({_RADIUS}|{_DIAMETER}))"),
    (
        "indenter_radius_mm",
        "length",
        rf"^(?!.*({_SENSOR}|{_SAMPLE}|[ck]onta[ck]t|\bbend|bieg))(?=.*({_RADIUS}|({_SPHERE}).*({_DIAMETER})))",
    ),
    ("indenter_radius_mm", "length", rf"^(?!.*({_SENSOR}|{_SAMPLE})).*({_DIAMETER}).*({_SPHERE})"),
    (
        "sample_height_mm",
        "length",
        rf"^(?=.*({_SAMPLE}))(?=.*(height|höhe|hauteur|altezza|altura|length|länge|longueur|lunghezza|longitud))",
    ),
    ("sample_diameter_mm", "length", rf"^(?=.*({_SAMPLE}))(?=.*(dia|durchmesser|diá))"),
    ("thickness_mm", "length", rf"\b({_THICKNESS})\b"),
    ("youngs_modulus_mpa", "pressure", r"young|\be[ -]?mod|[eé]l[aá]sti[ckqz]"),
    ("position_x_mm", "length", r"^(position x|x[ -]position)( |$)"),
    ("position_y_mm", "length", r"^(position y|y[ -]position)( |$)"),
    ("dwell_s", "time", r"dwell|hold(ing)? time|haltezeit|maintien|mantenim"),
    ("d33_pc_per_n", "charge/force", r"d33"),
)
OF_CHANNELS = {  # of columns of samples or lines whose unit does not say it
    "force_n": r"force|load|kraft|forza|fuerza",
    "charge_pc": r"charge|amplifier|ladung",
    "coherence": r"coh|koh|coer",
    "frequency_hz": r"fr[eé](qu?|c)u?en",
    "frf_phase_deg": r"phase|fase",
    "displacement_mm": r"displacement|depth|\bweg|eindring|verschiebung|d[ée]placement|enfoncement|spostamento|desplaz",
    "time_s": r"time|zeit|temps|tempo|tiempo",
}
# What a name says of a quantity's spread or bounds, and not of the quantity
_ABOUT = re.compile(
    r"uncertain|toll?eran[czt]|\b(error|std|limit)|deviation|unsicherheit|fehler|abweichung|grenz|incert|erreur"
    r"|écart[ -]type|deviazione|desviación"
)
RECORDED_AT = "recorded_at"
# Properties, and columns of words, that hold the time of a recording, the surest first.
TIMES = (
    *("recorded at", "recorded", "measured at", "acquired at", "date and time", "date/time", "datetime", "timestamp"),
    *("start time", "aufgenommen", "aufnahmezeit", "messzeit", "zeitstempel", "date et heure", "data e ora"),
    *("fecha y hora", "date de mesure", "date", "messdatum", "datum", "data", "fecha"),
)
WHEN = ("time", "date", "zeit", "datum", "heure", "ora", "data", "fecha", "hora")  # one word of a column's heading
_NAMED = ("sensor", "stage_stiffness_n_per_mm", "poisson_ratio", "load_cycles", "dwell_s")
_STEP = re.compile(r"dt|ts|delta[ _]?[tx]|(sampl\w*|time)[ _-]?(interval|step|period)|abtastintervall")


def is_diameter(name: str) -> bool:
    """Whether a name says a diameter, of which a radius is half."""
    return re.search(_DIAMETER, name.lower()) is not None and not re.search(_RADIUS, name.lower())


def is_about(name: str) -> bool:
    """Whether a name says the uncertainty, the tolerance or the limit of a quantity, and not the quantity."""
    return _ABOUT.search(name.lower().replace("_", " ")) is not None


def field_by_words(name: str, dimension: str) -> str:
    """The field that the words of a name say, with a unit of this dimension; empty for none."""
    plain = (in_brackets(name) or (name,))[0].lower().replace("_", " ").strip()
    fits = re.search if dimension else re.fullmatch
    field = next((field for field, needed, words in WORDS if dimension == needed and fits(words, plain)), "")
    is_other = field in ("thickness_mm", "youngs_modulus_mpa") and not all(
        _OF_LAYER.fullmatch(word) for word in re.findall(r"[^\W\d_]+", plain)
    )
    return "" if is_other or is_about(plain) else field


def field_of(name: str) -> tuple[str, bool]:
    """The field that a property says, and whether by its own name; empty for none.

    A number needs a unit in its name, or the field's own name, which holds it.
    """
    bare = name.removeprefix("skin.")
    own = (lab_field(bare) or (bare.lower().replace(" ", "_"),))[0]
    if own in LAB or own in _NAMED:
        return own, True
    label = unit(labelled_unit(bare))
    return field_by_words(bare, "" if label is None else label.dimension), False


def stated_rate(properties: Mapping[str, str | float], block: str = "") -> tuple[str, float] | None:
    """The property that states the samples a second, of a part of the file or of all of it, and their number."""
    prefix = f"{block}."
    own = [name for name in properties if block and name.startswith(prefix)]
    rates = ((name, _rate(name.removeprefix(prefix), properties[name])) for name in (*own, *properties))
    return next(((name, rate) for name, rate in rates if rate is not None), None)


def _rate(name: str, value: str | float) -> float | None:
    """Samples a second, in Hz or s where the name has no unit; None where it is another property."""
    label, number = unit(labelled_unit(name)), number_of(value)
    to_si, dimension = (1.0, "") if label is None else (label.to_si, label.dimension)
    plain = (in_brackets(name) or (name,))[0].lower().strip()
    if number is None or not 0 < number * to_si < float("inf"):
        return None
    if dimension in ("", "time") and _STEP.fullmatch(plain):
        return 1 / (number * to_si)
    is_rate = dimension in ("", "frequency") and field_by_words(name, dimension) == "sample_rate_hz"
    return number * to_si if is_rate else None


def number_of(given: str | float) -> float | None:
    """A number as written, with a decimal point or comma; None where a comma may separate thousands."""
    return text.number(given, text.decimal_mark([[given]], "\t")) if isinstance(given, str) else given

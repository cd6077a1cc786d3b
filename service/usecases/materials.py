"""Materials of a skin as presets: the modulus of an elastomer or the d33 of a film, as somebody published it."""

from collections.abc import Mapping
from dataclasses import dataclass

_PAPER = "Seminara, Sensors 18 (2018) 459"
_MIXED = "Wang, Volinsky & Gallant, J. Appl. Polym. Sci. 131 (2014) 41050, doi 10.1002/app.41050"
_CURED = (
    "Johnston, McCluskey, Tan & Tracey, J. Micromech. Microeng. 24 (2014) 035017, doi 10.1088/0960-1317/24/3/035017"
)
_PRESSED = "Dawood et al. (2026), github.com/abubakardawood/tissue-phantom-material-database"
_PULLED = "Marechal et al., Soft Robotics (2020), doi 10.1089/soro.2019.0115"
_FILM = "Measurement Specialties, Piezo Film Sensors Technical Manual, table 1"
_OF_PDMS = "0.483 ± 0.034 [1]"
RATIO_SOURCE = "[1] of a PDMS film of 155 µm: Polymer Testing (2018), doi 10.1016/j.polymertesting.2018.05.044"
_YEOH = "Yeoh's law up to 40 % strain, its slope at none (docs/mechanisms.md, Measured silicones)"
_RATIO = "compression; there E = 20 MPa over the ratio of base to curing agent, for 5 : 1 to 33 : 1"


@dataclass(frozen=True)
class Material:
    """What a design takes from it: `field` and its `value` in lab units; Poisson's ratio where it was measured, [1] in
    RATIO_SOURCE; how the value was found; and the source."""

    id: str
    name: str
    field: str
    value: float
    poisson_ratio: str
    how: str
    source: str


def _elastomer(name: str, modulus_mpa: float, poisson_ratio: str, how: str, source: str) -> Material:
    words = "-".join("".join(sign if sign.isalnum() else " " for sign in name.lower()).split())
    return Material(words, name, "youngs_modulus_mpa", modulus_mpa, poisson_ratio, how, source)


def _film(material_id: str, name: str, d33: float, how: str, source: str) -> Material:
    return Material(material_id, name, "d33_pc_per_n", d33, "", how, source)


ELASTOMERS = (
    _elastomer("PDMS of the prototype", 16.0, "0.48 (said of an elastomer)",
               "compression of a cylinder 4 mm wide and 2.5 mm high; mixing ratio and cure are not said", _PAPER),
    _elastomer("Sylgard 184, 5 : 1", 3.7, _OF_PDMS, "compression, the stiffest tested", _MIXED),
    _elastomer("Sylgard 184, 10 : 1", 2.0, _OF_PDMS, _RATIO, _MIXED),
    _elastomer("Sylgard 184, 20 : 1", 1.0, _OF_PDMS, _RATIO, _MIXED),
    _elastomer("Sylgard 184, 33 : 1", 0.57, _OF_PDMS, "compression, the softest tested", _MIXED),
    _elastomer("Sylgard 184, cured at 25 °C", 1.32, _OF_PDMS, "tension, lower end of the range of cures", _CURED),
    _elastomer("Sylgard 184, cured at 200 °C", 2.97, _OF_PDMS, "tension, upper end of the range of cures", _CURED),
    _elastomer("RTV615", 0.95, "not measured there", f"tension; {_YEOH}", _PULLED),
    _elastomer("Dragon Skin 20", 0.303, "not measured there", f"tension; {_YEOH}", _PULLED),
    _elastomer("Ecoflex 00-50", 0.156, "not measured there", f"compression; {_YEOH}", _PRESSED),
    _elastomer("Ecoflex 00-30", 0.098, "not measured there", f"compression; {_YEOH}", _PRESSED),
    _elastomer("Ecoflex 00-10", 0.051, "not measured there", f"compression; {_YEOH}", _PRESSED),
)  # fmt: skip
FILMS = (
    _film("pvdf", "PVDF film", 33.0, "its magnitude; E of the film 2 to 4 GPa, 9 to 110 µm thick", _FILM),
    _film("copolymer", "P(VDF-TrFE) film", 38.0, "its magnitude; E of the film 3 to 5 GPa", _FILM),
    _film(
        "prototype-1-n",
        "PVDF of the prototype at 1 N",
        14.0,
        "from FRFs of the latest runs, after four years of use",
        _PAPER,
    ),
    _film("prototype-3-n", "PVDF of the prototype at 3 N", 22.0, "from FRFs of earlier runs", _PAPER),
)
MATERIALS = {material.id: material for material in (*ELASTOMERS, *FILMS)}


def with_values(values: Mapping[str, float]) -> dict[str, str]:
    """Names of the materials whose value a design has, by field; empty where it has none's."""
    named: dict[str, list[str]] = {listed.field: [] for listed in MATERIALS.values()}
    for listed in MATERIALS.values():
        if values.get(listed.field) == listed.value:
            named[listed.field].append(listed.name)
    return {field: " or ".join(names) for field, names in named.items()}

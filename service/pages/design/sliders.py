"""The values of a design: defaults, present values, and those of a pinned design."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import parse_qsl, urlencode

from fastapi import Depends, Request

from service.dependencies import Store, Table
from service.pages.shared.skin_values import start
from service.pages.shared.wrong_fields import errors_together, quantity
from service.problems import parsed
from service.schemas.design import DesignRequest
from service.usecases.design import require_apart
from service.usecases.materials import MATERIALS
from underskin.errors import InvalidInput, not_one_of, noting

# Field, words, unit, the slider's ends.
SLIDERS = (
    ("thickness_mm", "thickness h", "mm", 0.2, 20),
    ("sensor_radius_mm", "sensor radius rT", "mm", 0.1, 10),
    ("indenter_radius_mm", "sphere radius R", "mm", 0.5, 50),
    ("preload_n", "force F", "N", 0.05, 50),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa", 0.1, 100),
    ("d33_pc_per_n", "d33", "pC/N", 1, 100),
    ("pitch_mm", "pitch of the array", "mm", 0.5, 50),
    ("dip_percent", "resolvable dip", "%", 1, 50),
)
LABELS = {name: f"{words} [{unit}]" for name, words, unit, *_ in SLIDERS}
WORDS = {name: (words, unit) for name, words, unit, *_ in SLIDERS if name != "dip_percent"}
PIN, ACTION, MATERIAL = "pin", "do", "material"


@dataclass(frozen=True)
class Sliders:
    """Defaults (`own`) and present values of the sliders, as text (`typed`) and as numbers; the `pinned` design if
    there is one, as text `pin`; errors of both; `taken`: sentences on values that neither the address nor the skin
    declares."""

    skin_id: str | None
    own: Mapping[str, float]
    typed: Mapping[str, str]
    values: Mapping[str, float]
    pin: str
    pinned: Mapping[str, float] | None
    error: InvalidInput | None
    wrong_pin: InvalidInput | None
    taken: Sequence[str]


def _sliders(request: Request, store: Store, table: Table, skin: str | None = None) -> Sliders:
    """With the values of the address, or else those of the skin or of the paper's prototype."""
    given = {name: request.query_params[name] for name, *_ in SLIDERS if name in request.query_params}
    start_values, taken = start(store, table, skin, {name: words for name, words in WORDS.items() if name not in given})
    start_values = {name: start_values[name] for name, *_ in SLIDERS}
    values, error = _numbers(start_values, given)
    pin = request.query_params.get(PIN, "")
    pinned, wrong_pin = _numbers(start_values, dict(parse_qsl(pin, keep_blank_values=True))) if pin else (None, None)
    typed = {name: given.get(name, f"{start_values[name]:g}") for name, *_ in SLIDERS}
    return Sliders(skin, start_values, typed, values, pin, pinned, error, wrong_pin, taken)


SlidersOfQuery = Annotated[Sliders, Depends(_sliders)]


def _numbers(own: Mapping[str, float], given: Mapping[str, str]) -> tuple[dict[str, float], InvalidInput | None]:
    """The given values, or else the defaults, and all errors."""
    values = dict(own)
    try:
        with errors_together(list(LABELS)) as wrong:
            for name in (slider for slider in own if slider in given):
                with noting(wrong):
                    values[name] = quantity(name, given[name])
            with noting(wrong):
                parsed(DesignRequest, values)
            if not {"pitch_mm", "sensor_radius_mm"} & {invalid.field for invalid in wrong}:
                require_apart(values["pitch_mm"], values["sensor_radius_mm"])
    except InvalidInput as error:
        return values, error
    return values, None


def after_action(request: Request, sliders: Sliders) -> str | None:
    """The address to which a button of the form leads: design pinned or unpinned, or a material's value used; None
    if no button was pressed. Raises InvalidInput for an unknown material."""
    action, material = (request.query_params.get(name) for name in (ACTION, MATERIAL))
    if action is None and material is None:
        return None
    typed, pin = dict(sliders.typed), sliders.pin
    if action == "pin":
        pin = urlencode(typed)
    elif action == "unpin":
        pin = ""
    if material is not None:
        if material not in MATERIALS:
            raise not_one_of(MATERIAL, material, MATERIALS)
        taken = MATERIALS[material]
        typed[taken.field] = f"{taken.value:g}"
    skin = {} if sliders.skin_id is None else {"skin": sliders.skin_id}
    return f"/design?{urlencode({**skin, **typed, **({PIN: pin} if pin else {})})}"

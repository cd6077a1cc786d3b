"""d33 by a skin's adopted model, next to the paper's, on the page of a few measured values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from service.pages.shared.forms import in_form_words, number
from service.pages.shared.skin_values import FIELDS
from service.problems import Refusal
from service.schemas.columns import Columns
from service.schemas.pressed_skin import D33Columns
from service.store import Conflict, Database
from service.usecases.adopted_models import model_in_force
from service.usecases.pressed_skin import d33
from underskin.errors import UnderskinError, required
from underskin.surrogate.sigma_table import SigmaTable

if TYPE_CHECKING:
    from underskin.prediction.adopted_model import AdoptedModel

# Words and unit of the additional values that a model may need besides sphere and preload.
_NEEDED = {
    "dynamic_force_n": ("dynamic force", "N"),
    "dwell_s": ("time the preload was held", "s"),
    "load_cycles": ("load cycles so far", ""),
    "sensor": ("sensor", ""),
}
_WORDS = {name: (words, unit) for name, words, unit in FIELDS} | _NEEDED
_LABELS = {name: f"{words} [{unit}]" if unit else words for name, (words, unit) in _WORDS.items()}


@dataclass(frozen=True)
class ByModel:
    """The result of the model in force for the same measurements.

    `fields`: additional fields of the form (name, words, unit, value); `document`: the request of `POST /v1/d33` and
    `answer`: its answer, both None if `unavailable` gives a reason.
    """

    fields: Sequence[tuple[str, str, str, str]] = ()
    document: Mapping[str, Any] | None = None
    answer: Columns | None = None
    unavailable: str | None = None

    def columns(self) -> dict[str, list[float]]:
        """d33 by it, a row a measurement; none where it is unavailable."""
        if self.answer is None:
            return {}
        names = {"d33_pc_per_n": "d33_adopted_pc_per_n", "d33_uncertainty_pc_per_n": "d33_adopted_uncertainty_pc_per_n"}
        return {new: self.answer.full(name).tolist() for name, new in names.items()}


def by_model(
    store: Database, table: SigmaTable, skin: str | None, given: Mapping[str, str], document: Mapping[str, Any]
) -> ByModel | None:
    """The same by the model in force of the skin; None where there is none. `document`: the paper's request."""
    if skin is None:
        return None
    try:
        model = model_in_force(store, skin).model
    except Refusal:
        return None
    except Conflict as outdated:
        return ByModel(unavailable=str(outdated))
    fields = [(name, *_NEEDED[name], given.get(name, "").strip()) for name in model.needs]
    try:
        document_of_model = {**document, **_needed(model, fields), "model": "adopted", "skin_id": skin}
        return ByModel(fields, document_of_model, d33(table, store, D33Columns.model_validate(document_of_model)))
    except UnderskinError as refused:
        return ByModel(fields, unavailable=in_form_words(refused, _LABELS))


def _needed(model: "AdoptedModel", fields: Sequence[tuple[str, str, str, str]]) -> dict[str, Any]:
    if model.of_lines:
        names = " and ".join(name.replace("_", " ") for name in model.of_lines)
        raise required("FRF", f"one value is not enough: {names} depends on frequency, so upload recordings")
    return {name: value if name == "sensor" else number(name, value) for name, _, _, value in fields if value}

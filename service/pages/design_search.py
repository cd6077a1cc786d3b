"""The inverse design problem: which skins achieve a required resolution."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Depends, Request, Response

from service.dependencies import Store, Table
from service.heavy_answers import computed_in_turn
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.forms import NOTHING_WRONG, errors_together, in_form_words, labels_of, quantity, wrong_fields
from service.pages.shared.html import page
from service.pages.shared.skin_values import start
from service.problems import parsed
from service.schemas.design import DesignDemand
from service.usecases.design_search import NEARLY, Offer, Searched, search
from underskin.errors import UnderskinError, noting
from underskin.figures.design import Offered, design_region

router = APIRouter(prefix="/design/search")

# Field, words, unit; where it starts, unless that is the skin's or the prototype's.
FIELDS = (
    ("resolution_mm", "two-point separation, at most", "mm", "2"),
    ("preload_n", "force F of each load", "N", None),
    ("indenter_radius_mm", "sphere radius R", "mm", None),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa", None),
    ("d33_pc_per_n", "d33", "pC/N", None),
    ("dip_percent", "resolvable dip", "%", None),
    ("thinnest_mm", "thinnest layer that can be made", "mm", "0.2"),
    ("least_pitch_mm", "smallest pitch that can be made", "mm", "0.5"),
    ("least_frf_pc_per_n", "least charge over force", "pC/N", "1"),
)
_LABELS = labels_of(FIELDS)


@dataclass(frozen=True)
class Typed:
    """The skin whose values are the defaults, the values of the form, and sentences on undeclared ones."""

    skin_id: str | None
    fields: Mapping[str, str]
    taken: Sequence[str]

    @property
    def demand(self) -> DesignDemand:
        """The requirement; raises SeveralInvalid."""
        values: dict[str, float] = {}
        with errors_together(list(_LABELS)) as wrong:
            for name, text in self.fields.items():
                with noting(wrong):
                    values[name] = quantity(name, text)
            return parsed(DesignDemand, values)


def _typed(request: Request, store: Store, table: Table, skin: str | None = None) -> Typed:
    given = {name: request.query_params[name] for name, *_ in FIELDS if name in request.query_params}
    words = {name: (words_of, unit) for name, words_of, unit, first in FIELDS if first is None and name not in given}
    start_values, taken = start(store, table, skin, words)
    fields = {name: given.get(name, first or f"{start_values[name]:g}") for name, _, _, first in FIELDS}
    return Typed(skin, fields, taken)


TypedInQuery = Annotated[Typed, Depends(_typed)]


@router.get("")
@computed_in_turn
def view(request: Request, table: Table, typed: TypedInQuery) -> Response:
    """The page."""
    searched, wrong = None, NOTHING_WRONG
    try:
        with np.errstate(all="ignore"):
            searched = search(table, typed.demand)
    except UnderskinError as refused:
        wrong = wrong_fields(refused, lambda error: in_form_words(error, _LABELS))
    return page(
        request,
        "design_search.html",
        skin_id=typed.skin_id,
        fields=[(name, words, unit, typed.fields[name]) for name, words, unit, _ in FIELDS],
        taken=typed.taken,
        wrong=wrong,
        offers=[] if searched is None else [(offer, _address(typed, offer)) for offer in searched.offers],
        binding=[] if searched is None else searched.binding,
        count=0 if searched is None else int(searched.feasible.sum()),
        of=0 if searched is None else searched.feasible.size,
        figures=[] if searched is None else [_figure(searched, typed)],
        nearly=100 * (1 - NEARLY),
    )


@downloadable(router, "/region")
def region_csv(table: Table, typed: TypedInQuery) -> Numbers:
    """Every examined pair of thickness and sensor radius."""
    with np.errstate(all="ignore"):
        searched = search(table, typed.demand)
    region = searched.region
    thickness, radius = np.meshgrid(region.thickness_mm, region.sensor_radius_mm)
    columns = {
        "thickness_mm": thickness,
        "sensor_radius_mm": radius,
        "largest_pitch_mm": region.largest_pitch_mm,
        "frf_pc_per_n": region.frf_pc_per_n,
        "feasible": searched.feasible,
    }
    return Numbers("region", {name: values.ravel().tolist() for name, values in columns.items()})


def _figure(searched: Searched, typed: Typed) -> Drawn:
    region = searched.region
    offered = [
        Offered(offer.merit, offer.request.thickness_mm, offer.request.sensor_radius_mm) for offer in searched.offers
    ]
    return drawn(
        "region",
        design_region(
            region.thickness_mm,
            region.sensor_radius_mm,
            region.largest_pitch_mm,
            region.frf_pc_per_n,
            searched.feasible,
            offered,
        ),
        "Each square is a skin; its colour is the largest pitch that still resolves what is asked, to about 5 %.",
        f"/design/search/region.csv?{urlencode(typed.fields)}",
    )


def _address(typed: Typed, offer: Offer) -> str:
    """The design view of an offer."""
    values = offer.request.model_dump(exclude={"contact", "units_checked"})
    skin = {} if typed.skin_id is None else {"skin": typed.skin_id}
    return f"/design?{urlencode({**skin, **{name: f'{value:g}' for name, value in values.items()}})}"

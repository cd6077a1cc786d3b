"""Two campaigns of curves side by side: the curves, and Young's modulus of each campaign."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from service.pages.shared.figures import Drawn, columns_of, drawn
from service.store import AnyRow, Database, campaigns

COLUMNS = ("which", "campaign", "recording", "youngs_modulus_mpa", "youngs_modulus_uncertainty_mpa", "statement")
_MOST_CURVES = 12  # of each campaign
_NAMES = ("first", "second")
_MODULUS = "youngs_modulus_mpa"


def rows(kind: str, both: Sequence[AnyRow], answers: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Young's modulus of each curve of a kind, first campaign first."""
    return [
        {"which": name, "campaign": row.id, **modulus}
        for name, row, answer in zip(_NAMES, both, answers, strict=True)
        for modulus in answer["moduli"]
        if modulus["kind"] == kind
    ]


def means(of_curves: Sequence[Mapping[str, Any]]) -> list[Any]:
    """The mean modulus of each campaign, and the difference second − first."""
    from underskin.inversion.comparison import mean_moduli

    first, second = (np.array([row[_MODULUS] for row in of_curves if row["which"] == name]) for name in _NAMES)
    return mean_moduli(first, second)


def figures(store: Database, kind: str, both: Sequence[AnyRow], of_curves: Sequence[Mapping[str, Any]]) -> list[Drawn]:
    """The curves of both, each campaign in a colour, and the modulus of each curve."""
    from underskin.figures.curves import ForceCurve, curve_moduli, force_curves

    curves, counts = [], []
    for name, row in zip(_NAMES, both, strict=True):
        campaign = store.read(campaigns.load, row, with_excluded=False)
        curves_of_kind = [curve for curve in campaign.curves if curve.kind == kind]
        counts.append(f"{min(len(curves_of_kind), _MOST_CURVES)} of {len(curves_of_kind)} of the {name}")
        curves += [
            ForceCurve(recording.id, recording.displacement_mm, recording.force_n, of=name)
            for recording in curves_of_kind[:_MOST_CURVES]
        ]
    about = f"Curves as they were recorded: {' and '.join(counts)}."
    which, names, modulus, uncertainty = columns_of(
        of_curves, "which", "recording", _MODULUS, "youngs_modulus_uncertainty_mpa"
    )
    page = f"/compare/moduli.csv?first={both[0].id}&second={both[1].id}&kind={kind}"
    description = "Young's modulus of each curve, with its 95 % interval by the noise of that curve alone."
    return [
        drawn("curves", force_curves(curves), about),
        *([drawn("moduli", curve_moduli(which, names, modulus, uncertainty), description, page)] if of_curves else []),
    ]

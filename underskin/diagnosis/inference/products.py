"""All inner products over rows that the likelihood of predictions needs, at several points of the fit coordinates.

A prediction is m = L u in each recording: of FRFs L is the level, which is real, and u the dynamics' factor line by
line, 1 where there are none; of curves L = 1 and u is the force, turned such that samples are independent. With 1/d² as
the weight of rows (of curves what whitening makes of it), the sums of each recording are Re u*u, Re u*y and |y|², and
with the derivatives v of u, Re u*v, Re v*y and Re v*v. Arrays are (points, recordings, …).
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.curve_products import CurveProducts
from underskin.diagnosis.inference.frf_products import FrfProducts

Products = FrfProducts | CurveProducts


def joined(parts: Sequence[Products], parameters: int) -> Products:
    """Products of models of the same recordings one after another, their parameters filled up to so many."""
    if len(parts) == 1:
        return parts[0]
    curves = [part for part in parts if isinstance(part, CurveProducts)]
    if curves:
        slopes = [part.force_slopes for part in curves if part.force_slopes is not None]
        force = np.concatenate([part.force for part in curves])
        return CurveProducts(curves[0].lines, force, np.concatenate(slopes) if slopes else None)
    return FrfProducts.joined([part for part in parts if isinstance(part, FrfProducts)], parameters)

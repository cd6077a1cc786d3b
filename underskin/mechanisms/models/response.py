"""What a model of FRFs answers before it is spread over rows: a level for each recording, a factor for each line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated
from underskin.units import Floats


@dataclass(frozen=True)
class Response:
    """FRFs at one or several points of the fit coordinates, in two factors: leading axes are those of the points.

    `place_slopes` are by the contact's x and y, None where they were not asked for.
    """

    level: Differentiated  # (…, recordings) [C/N], real: before the dynamics
    place_slopes: Floats | None  # (2, …, recordings) [C/N/m]
    lines: Differentiated | None  # (…, distinct lines) complex: the dynamics' factor; None where there are none
    inside: NDArray[np.bool_]  # (…, recordings)

    def part(self, index: int | slice) -> "Response":
        """At some of several points."""

        def of(x: Differentiated) -> Differentiated:
            return Differentiated(x.value[index], x.slopes[:, index])

        place = None if self.place_slopes is None else self.place_slopes[:, index]
        return Response(of(self.level), place, None if self.lines is None else of(self.lines), self.inside[index])


def joined(responses: Sequence[Response]) -> Response:
    """Responses of one model at several sets of points, as one."""

    def of(parts: Sequence[Differentiated]) -> Differentiated:
        return Differentiated(
            np.concatenate([part.value for part in parts]), np.concatenate([part.slopes for part in parts], axis=1)
        )

    place = [entry.place_slopes for entry in responses if entry.place_slopes is not None]
    lines = [entry.lines for entry in responses if entry.lines is not None]
    return Response(
        of([entry.level for entry in responses]),
        np.concatenate(place, axis=1) if place else None,
        of(lines) if lines else None,
        np.concatenate([entry.inside for entry in responses]),
    )

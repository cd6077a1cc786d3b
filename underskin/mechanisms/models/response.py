"""What a model of FRFs answers before it is spread over rows: a level for each recording, a factor for each line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.units import Array, Floats, Indices, Mask


@dataclass(frozen=True)
class Response:
    """FRFs at one or several points of the fit coordinates, in two factors: leading axes are those of the points.

    `place_slopes` are by the contact's x and y, None where they were not asked for.
    """

    level: Differentiated  # (…, recordings) [C/N], real: before the dynamics
    place_slopes: Floats | None  # (2, …, recordings) [C/N/m]
    lines: Differentiated | None  # (…, distinct lines) complex: the dynamics' factor; None where there are none
    inside: Mask  # (…, recordings)

    def on_rows(self, design: FrfDesign) -> tuple[Array, Array]:
        """Level times line factor on every row of a single point (rows,), and its derivatives (variables, rows).

        These are by the parameters, then by the place where those were asked for.
        """
        place = np.zeros((0, *self.level.value.shape)) if self.place_slopes is None else self.place_slopes
        level = self.level.value[design.recording]
        slopes = np.concatenate([self.level.slopes, place])[:, design.recording]
        if self.lines is None:
            return level.astype(complex), slopes.astype(complex)
        factor = self.lines.value[design.line]
        slopes = slopes * factor
        for row, of_lines in zip(slopes, self.lines.slopes, strict=False):  # which are by the parameters alone
            if of_lines.any():
                row += level * of_lines[design.line]
        return level * factor, slopes

    def part(self, index: int | slice | Indices) -> "Response":
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

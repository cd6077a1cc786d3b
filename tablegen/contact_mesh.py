"""The mesh of the layer under a sphere: a tensor grid, graded towards the contact's edge from all sides.

Lengths in thicknesses. The pressure ends at the edge with a square root, and the flat punch's, which is that of an
increment, with the inverse of one: so the elements there are far smaller than `tablegen.mesh` makes them.
"""

import numpy as np
from skfem import MeshQuad

from underskin.units import Floats

RIM = 12.0
_SMALLEST = 0.004  # of the contact radius (or of the thickness, for a wide contact), at the edge of the contact
_LARGEST = 0.2
_GROWTH = 2.5


def contact_mesh(a: float) -> MeshQuad:
    """The mesh for a contact whose edge was at `a` (a/h) before the layer was pressed."""
    smallest = _SMALLEST * min(a, 1.0)
    inside, outside = _graded(smallest, a, a), _graded(smallest, RIM, a)
    r = np.concatenate([a - inside[::-1], a + outside[1:]])
    r[0] = 0.0
    return MeshQuad.init_tensor(r, 1 - _graded(smallest, 1.0, a)[::-1])


def _graded(smallest: float, length: float, a: float) -> Floats:
    """Nodes from 0 to `length`; the intervals grow from `smallest` to `_LARGEST` and, far away, beyond."""
    nodes = [0.0]
    step = smallest
    while nodes[-1] < length:
        nodes.append(nodes[-1] + step)
        step = min(_GROWTH * step, max(_LARGEST, 0.25 * (nodes[-1] - 4.0)))
        if nodes[-1] < a:
            step = min(step, a / 3)
    scaled = np.asarray(nodes) * (length / nodes[-1])
    scaled[-1] = length
    return scaled

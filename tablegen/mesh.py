"""The mesh of the layer: a tensor grid of the (r, z) half plane, graded where the solution bends.

Lengths in units of the layer's thickness: z = 0 is the bonded base, z = 1 the surface. The Hertz pressure ends at
r = a with a square root, so the elements shrink towards the point (a, 1) from all sides and grow geometrically away
from it. The rim lies `RIM` thicknesses outside the contact: a disturbance of an incompressible bonded layer dies like
exp(−1.5 r/h), so that the rim's effect on the sensors is below 1e-8.
"""

import numpy as np
from skfem import MeshQuad

from underskin.units import Floats

RIM = 12.0
_SMALLEST = 0.15  # of the contact radius (or of the thickness, for a wide contact), at the edge of the contact
_LARGEST = 0.2  # thicknesses, where the sensors are
_GROWTH = 2.0


def layer_mesh(a: float, refinement: int = 1) -> MeshQuad:
    """The mesh for a contact of radius `a` (a/h); every element is split into `refinement`² equal ones."""
    smallest = _SMALLEST * min(a, 1.0)
    inside = a - _graded(smallest, a)[::-1]
    outside = a + _graded(smallest, RIM)[1:]
    r = np.concatenate([inside, outside])
    z = 1 - _graded(smallest, 1.0)[::-1]
    return MeshQuad.init_tensor(_split(r, refinement), _split(z, refinement))


def _graded(smallest: float, length: float) -> Floats:
    """Nodes from 0 to `length`, the first interval about `smallest`, growing to `_LARGEST` and beyond far away."""
    nodes = [0.0]
    step = smallest
    while nodes[-1] < length:
        nodes.append(nodes[-1] + step)
        step = min(_GROWTH * step, max(_LARGEST, 0.25 * (nodes[-1] - 4.0)))
    scaled = np.asarray(nodes) * (length / nodes[-1])
    scaled[-1] = length  # exactly: faces are found by their coordinate
    return scaled


def _split(nodes: Floats, parts: int) -> Floats:
    """The nodes with every interval cut into equal parts."""
    fractions = np.arange(parts) / parts
    return np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * fractions).ravel(), nodes[-1])

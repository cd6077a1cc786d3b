"""Half-space error "about 40 %, 10 %, 1 %": what the block's finite size explains."""

from dataclasses import dataclass

import numpy as np

from docs.paper import deep_layer
from docs.paper.block import FiniteBlock, solve
from underskin.physics import half_space
from underskin.units import Floats

H_MM = 2.5
LENGTH_MM, WIDTH_MM = 40.0, 20.0
DEPTHS_MM = (2.5, 5.0, 10.0, 30.0)
A_OVER_H = 0.289
RHO = np.array([0.2, 0.6])  # the paper's statement; its prototype
_ORDER = 5
_WIDE = 16.0  # lengths of side, in units of the depth: as good as endless


@dataclass(frozen=True)
class Depth:
    """σ at depth h over a base at `depth_mm`; arrays are over the two sensors of `RHO`."""

    depth_mm: float
    endless: Floats
    block: Floats
    slippery: Floats  # the block on a base without friction
    discretisation_error: Floats  # relative, of `block`: the change to elements of one order more
    force_error: float
    unknowns: int

    def against_model(self, sigma: Floats) -> Floats:
        """The half space's error relative to a model's σ, in percent."""
        return 100 * (HALF_SPACE / sigma - 1)

    def against_half_space(self, sigma: Floats) -> Floats:
        """A model's difference relative to the half space, in percent."""
        return 100 * (sigma / HALF_SPACE - 1)


HALF_SPACE = half_space.sigma(A_OVER_H, RHO)


def at_depth(depth_mm: float) -> Depth:
    """Solve the block with its base at `depth_mm`."""
    depth = depth_mm / H_MM
    block = FiniteBlock(LENGTH_MM / H_MM, WIDTH_MM / H_MM, depth)
    coarse, fine = solve(block, A_OVER_H, RHO, _ORDER), solve(block, A_OVER_H, RHO, _ORDER + 1)
    slippery = solve(FiniteBlock(block.length, block.width, depth, bonded=False), A_OVER_H, RHO, _ORDER)
    return Depth(
        depth_mm=depth_mm,
        endless=deep_layer.sigma(depth, A_OVER_H, RHO),
        block=fine.sigma,
        slippery=slippery.sigma,
        discretisation_error=np.abs(coarse.sigma / fine.sigma - 1),
        force_error=abs(fine.force - 1),
        unknowns=fine.unknowns,
    )


def wide_block_error() -> float:
    """The largest relative error of a very wide block of depth h against the exact endless layer."""
    wide = solve(FiniteBlock(_WIDE, _WIDE, 1.0), A_OVER_H, RHO, _ORDER + 1)
    return float(np.max(np.abs(wide.sigma / deep_layer.sigma(1.0, A_OVER_H, RHO) - 1)))

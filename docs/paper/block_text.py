"""The section on the half space's error of 40, 10 and 1 %."""

from collections.abc import Sequence

from docs.paper import block_question as block
from docs.paper.block_question import Depth
from docs.paper.markdown import ceiling, percent, table
from docs.paper.prototype import INDENTERS_MM
from underskin.surrogate.sigma_table import SigmaTable

_PAPER_PERCENT = {2.5: "about 40", 10.0: "10", 30.0: "1"}

_INTRODUCTION = f"""\
## The half space's error: 40, 10 and 1 %

At ρ = 0.2 and a/h = 0.289 the paper gives "the relative error of the analytical solution with respect to the
numerical one" as about 40 % with the substrate at h = 2.5 mm, about 10 % at 10 mm and 1 % at 30 mm. Here the paper's
block, {block.LENGTH_MM:g} × {block.WIDTH_MM:g} mm with free side walls on a bonded rigid base, is solved in three
dimensions (`docs/paper/block.py`: linear, incompressible, Taylor–Hood elements of order 6, a quarter by symmetry,
sensors' plane 2.5 mm below the top), beside the exact endless layer (`docs/paper/deep_layer.py`). A base at 5 mm and
the prototype's ρ = 0.6 are added.

"""

_VERDICT = """\

**What the side walls explain: very little.** They change the error by {walls[0]:+.2f}, {walls[1]:+.2f} and
{walls[2]:+.2f} percentage points with the base at 2.5, 10 and 30 mm. At 30 mm that is nearly all of the error there is,
and a tenth of the paper's 1 %; at 10 mm it is a tenth of an error that is itself a tenth of the paper's; at 2.5 mm the
walls, four and eight depths away, are not felt.

**What the definition explains: nothing.** By the paper's own, relative to the numerical solution, the half space is
{thin_block:.1f} % off at depth h; relative to the half space the block is {thin_half:+.1f} % off, and "about 40 %" lies
between. For the deeper bases the two definitions hardly differ.

Other readings, each as the half space's error relative to the model / the model's difference relative to the half
space, in percent:

"""

_REST = """\

Finite strain, at depth h and ρ 0.2: with the L of R = 4 mm ({load:.4f}) the half space's error is {strained:.1f} %
relative to the layer, with L = 0.1, the end of the table, {strained_most:.1f} %.

So the first number is nearly that of a bonded layer, and within reach of a base without friction or of a large L. No
reading tried here gives 10 % with the base at 10 mm and 1 % at 30 mm: both are about ten times what is computed, and
neither walls, friction, definition nor sensor size come near. As a *sequence*, 40, 10 and 1 is what a base at h, 2h
and 4h gives, closest with the prototype's ρ = 0.6 and relative to the half space. Whether the paper counted its
depths in some such way, or its mesh could not resolve a percent, cannot be told from what is at hand.
"""


def section(sigma_table: SigmaTable, depths: Sequence[Depth], wide_block_error: float) -> str:
    """The whole section; `depths` in the order of `block_question.DEPTHS_MM`."""
    thin, _, deep, deepest = depths
    half = float(block.HALF_SPACE[0])
    load = (block.A_OVER_H * block.H_MM / INDENTERS_MM[0]) ** 3 / 0.5625  # (a/R)³ = (3/4)(1 − ν²) L
    strained = sigma_table.sigma(block.A_OVER_H, block.RHO[0], [load, 0.1]).sigma
    verdict = _VERDICT.format(
        walls=[d.against_model(d.block)[0] - d.against_model(d.endless)[0] for d in (thin, deep, deepest)],
        thin_block=thin.against_model(thin.block)[0],
        thin_half=thin.against_half_space(thin.block)[0],
    )
    rest = _REST.format(load=load, strained=percent(half, strained[0]), strained_most=percent(half, strained[1]))
    return _INTRODUCTION + _results(depths, wide_block_error) + verdict + _candidates(depths) + rest


def _results(depths: Sequence[Depth], wide_block_error: float) -> str:
    header = (
        "base at, mm",
        "ρ",
        "σ half space",
        "σ endless layer, exact",
        "σ block, FEM",
        "its discretisation error",
        "half space's error relative to the endless layer, %",
        "relative to the block, %",
        "block against the half space, %",
        "side walls change σ by, %",
        "paper, %",
    )
    rows = [
        (
            f"{d.depth_mm:g}",
            f"{rho:g}",
            f"{block.HALF_SPACE[i]:.5f}",
            f"{d.endless[i]:.5f}",
            f"{d.block[i]:.5f}",
            ceiling(d.discretisation_error[i]),
            f"{d.against_model(d.endless)[i]:+.2f}",
            f"{d.against_model(d.block)[i]:+.2f}",
            f"{d.against_half_space(d.block)[i]:+.2f}",
            f"{percent(d.block[i], d.endless[i]):+.3f}",
            _PAPER_PERCENT.get(d.depth_mm, "—") if i == 0 else "—",
        )
        for i, rho in enumerate(block.RHO)
        for d in depths
    ]
    return table(header, rows) + (
        "\nThe discretisation error is the relative change from elements of order 5 to 6, rounded up to a power of "
        "ten. A very wide block of depth h agrees with the exact endless layer within "
        f"{ceiling(wide_block_error)}; the force through the sensors' plane is F within "
        f"{ceiling(max(d.force_error for d in depths))}. The largest solve has "
        f"{max(d.unknowns for d in depths):,} unknowns.\n"
    )


def _candidates(depths: Sequence[Depth]) -> str:
    thin, double, deep, deepest = depths
    stated, shifted = (thin, deep, deepest), (thin, double, deep)
    rows = [
        ("the paper", "about 40", "10", "1"),
        ("endless bonded layer, ρ 0.2", *(_both(d.endless[0], 0) for d in stated)),
        ("block, ρ 0.2", *(_both(d.block[0], 0) for d in stated)),
        ("block on a base without friction, ρ 0.2", *(_both(d.slippery[0], 0) for d in stated)),
        ("block, ρ 0.6", *(_both(d.block[1], 1) for d in stated)),
        ("block, base at 2.5, *5 and 10* mm, ρ 0.2", *(_both(d.block[0], 0) for d in shifted)),
        ("block, base at 2.5, *5 and 10* mm, ρ 0.6", *(_both(d.block[1], 1) for d in shifted)),
    ]
    return table(("model", "base at 2.5 mm", "at 10 mm", "at 30 mm"), rows)


def _both(sigma: float, sensor: int) -> str:
    half = float(block.HALF_SPACE[sensor])
    return f"{percent(half, sigma):+.2f} / {percent(sigma, half):+.2f}"

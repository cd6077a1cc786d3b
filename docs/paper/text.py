"""docs/paper.md as text: everything that has a number in it is computed by the modules beside this one."""

from collections.abc import Sequence

from docs.paper import block_text
from docs.paper.block_question import Depth
from docs.paper.markdown import ceiling, percent, table
from docs.paper.numbers import reported
from docs.paper.prototype import INDENTERS_MM, PRELOADS_N, Press, press
from docs.paper.service_run import D33_PC_PER_N, PRELOAD_N, SENSORS, ArrayRun
from underskin.surrogate.sigma_table import SigmaTable

_INTRODUCTION = """\
# The paper, recomputed

L. Seminara, *Modeling Electronic Skin Response to Normal Distributed Force*, Sensors 18 (2018) 459,
doi:10.3390/s18020459. Everything on this page, figures and numbers, is written by `make paper` (`docs/paper/`), from
the table `tables/sigma.h5` (SHA-256 `{table}`), fresh finite-element solves, and a server that `make paper` starts.

## What was at hand

The paper's abstract, its equations 2–16 and the numbers quoted below. **Its figures, their captions and its measured
curves were not**: which quantity figures 4, 6, 8, 10 and 11 show is *inferred* from the order of the equations, and
parameter values that are not among the quoted numbers are ours. Figures 10 and 11 show the model alone, since the
measured FRFs were not found anywhere as numbers.

## Figures

**Figure 4: a point force on an extended sensor** (equations 4–6). The layer's rigid base raises the stress under the
force and narrows it.

![Figure 4](figures/paper-fig4.svg)

**Figure 6: the Hertz pressure** on a point sensor (δ, equation 12) and on an extended one (σ, equation 14).

![Figure 6](figures/paper-fig6.svg)

**Figure 8: the finite layer, σ(a/h, ρ, L)** (equation 16). In a linear layer σ depends on a/h and ρ alone: L acts only
through finite strain. Points of different L joined over a/h alone make σ seem to oscillate (dotted).

![Figure 8](figures/paper-fig8.svg)

**Figure 10: the prototype's FRF over frequency.** The base model is real and flat; the grey band is the flat zone that
the paper reports.

![Figure 10](figures/paper-fig10.svg)

**Figure 11: the FRF's plateau over preload**, for the two indenters (left) and for the array's two d33 (right).

![Figure 11](figures/paper-fig11.svg)
"""

_LOAD = """\
## What L does on the prototype

h 2.5 mm, rT 1.5 mm (ρ = 0.6), E 16 MPa, ν 0.5. T0 is the static mean stress on the sensor, positive in compression. The
last column is all that L, that is finite strain, does to the linear layer; the table's own error bound is at most
{error} of σ here.

"""

_ARRAY = """\
## The prototype's array through the service

`make paper` starts `underskin serve` on a free port and sends the array, {rows} rows with R = 4 mm, to `/v1/frf`, and
the FRFs that come back to `/v1/d33`. So that the table does not only invert itself, FRFs from fresh finite-element
solves of the two cases (elements of order 6, no table, no interpolation) go to `/v1/d33` as well.

"""


def document(sigma_table: SigmaTable, depths: Sequence[Depth], wide_block_error: float, run: ArrayRun) -> str:
    """The whole page."""
    sections = (
        _INTRODUCTION.format(table=sigma_table.sha256),
        numbers_section(sigma_table),
        load_section([press(sigma_table, radius, PRELOADS_N) for radius in INDENTERS_MM]),
        block_text.section(sigma_table, depths, wide_block_error),
        array_section(run),
    )
    return "\n".join(sections)


def numbers_section(sigma_table: SigmaTable) -> str:
    """The paper's numbers beside ours."""
    rows = ((n.quantity, n.paper, n.ours, n.why) for n in reported(sigma_table))
    header = ("quantity", "paper", "here", "why they differ, or what follows")
    return (
        "## The paper's numbers beside ours\n\nThe half space's error has a section of its own below.\n\n"
        + table(header, rows)
    )  # fmt: skip


def load_section(presses: Sequence[Press]) -> str:
    """The prototype at every indenter and preload."""
    header = (
        "R, mm",
        "F, N",
        "a, mm",
        "a/h",
        "L",
        "q0, MPa",
        "T0, MPa",
        "σ half space",
        "σ linear layer",
        "σ table",
        "half space against the table, %",
        "L adds, %",
    )
    rows = [
        (
            f"{p.indenter_radius_mm:g}",
            f"{preload:g}",
            f"{p.contact_radius_mm[i]:.3f}",
            f"{p.a_over_h[i]:.4f}",
            f"{p.load_parameter[i]:.2e}",
            f"{p.peak_pressure_mpa[i]:.2f}",
            f"{p.mean_stress_mpa[i]:.3f}",
            f"{p.half_space[i]:.5f}",
            f"{p.linear[i]:.5f}",
            f"{p.table[i]:.5f}",
            f"{percent(p.half_space[i], p.table[i]):+.1f}",
            f"{percent(p.table[i], p.linear[i]):+.2f}",
        )
        for p in presses
        for i, preload in enumerate(PRELOADS_N)
    ]
    error = max(float(p.table_error.max()) for p in presses)
    return _LOAD.format(error=ceiling(error)) + table(header, rows)


def array_section(run: ArrayRun) -> str:
    """What came back from the service."""
    header = (
        "sensors",
        "preload, N",
        "paper's d33, pC/N",
        "FRF by /v1/frf",
        "d33 of it by /v1/d33",
        "FRF by a fresh solve",
        "d33 of it by /v1/d33",
    )
    rows = [
        (
            f"{SENSORS[i]}",
            f"{PRELOAD_N[i]:g}",
            f"{D33_PC_PER_N[i]:g}",
            f"{run.frf_from_service[i]:.5f}",
            f"{run.d33_from_service[i]:.5f}",
            f"{run.frf_from_fresh_solve[i]:.5f}",
            f"{run.d33_from_fresh_solve[i]:.5f}",
        )
        for i in range(len(SENSORS))
    ]
    outcome = (
        f"\nStatus of all rows: {', '.join(run.status)}. "
        f"Within a group d33 is equal within {ceiling(run.largest_spread)}.\n"
    )
    return _ARRAY.format(rows=sum(SENSORS)) + table(header, rows) + outcome

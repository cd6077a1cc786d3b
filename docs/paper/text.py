"""docs/paper.md as text: every number is computed by the other modules of this package."""

from collections.abc import Sequence

from docs.paper import block_text, stuck_cylinder, summary
from docs.paper.block_question import Depth
from docs.paper.claims import checked
from docs.paper.markdown import ceiling, percent, table
from docs.paper.prototype import INDENTERS_MM, PRELOADS_N, Press, press
from docs.paper.service_run import D33_PC_PER_N, PRELOAD_N, SENSORS, ArrayRun
from underskin.surrogate.sigma_table import SigmaTable

_INTRODUCTION = """\
# The paper, recomputed

L. Seminara, *Modeling Electronic Skin Response to Normal Distributed Force*, Sensors 18 (2018) 459,
doi:10.3390/s18020459. Everything on this page, figures and numbers, is written by `make paper` (`docs/paper/`), from
the table `tables/sigma.h5` (SHA-256 `{table}`), fresh finite-element solves, the diagnosis, and a server that
`make paper` starts.
"""

_DRAWN = """\
## What is drawn

The figures follow the paper's captions. Those of its model (4, 6, 8, 10, 11) are drawn again, beside the exact layer
where the paper shows the half space alone. Of those that show measurements (13 to 16) **the measured curves are not at
hand as numbers**: drawn are the model's lines and the numbers that the paper states. Its figures 1 to 3, 5, 7 and 12
are sketches and photographs.

**Figure 4: γ over the distance of a point force** (equation 6), for the paper's sensors in its colours.

![Figure 4](figures/paper-fig4.svg)

**Figure 6: δ over a/h**, the Hertz pressure over a point sensor (equation 12).

![Figure 6](figures/paper-fig6.svg)

**Figure 8: σ over a/h**, the Hertz pressure over extended sensors (equation 14).

![Figure 8](figures/paper-fig8.svg)

**Figure 9: total displacement of the layer** under 2 N by a sphere of 10 mm, E 16 MPa: a block of 40 × 20 × 2.5 mm on a
bonded base with free side walls (`docs/paper/block.py`, small strain), of which the middle is shown. The white circle
is the edge of contact.

![Figure 9](figures/paper-fig9.svg)

**Figure 10: half space and finite layer over a/h**, with the force (0.5 to 3 N) and the sphere (2 to 40 mm) varied at
E 16 MPa and the points joined in the order of a/h. The oscillation that the paper reports appears: points of nearly one
a/h differ in L. Which pairs the paper took, it does not say.

![Figure 10](figures/paper-fig10.svg)

**Figure 11: the strips of L** at rT/h 0.6. On the right what L adds, with the prototype's own contacts.

![Figure 11](figures/paper-fig11.svg)

**Figure 13: stress over strain of the cylinder.** The model's lines, and where the paper sees it leave
the straight one.

![Figure 13](figures/paper-fig13.svg)

**Figure 14: real and imaginary part of the FRF, 1 to 150 Hz.** The base model is real and flat; grey is the zone
that the paper uses, red how large the paper says the imaginary part is.

![Figure 14](figures/paper-fig14.svg)

**Figure 15: FRF over preload, two spheres**, with the paper's best fit of 14 pC/N.

![Figure 15](figures/paper-fig15.svg)

**Figure 16: 41 sensors at 3 N, 12 at 1 N.** The dotted lines are those of the paper's caption.

![Figure 16](figures/paper-fig16.svg)
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
        summary.section(sigma_table),
        _DRAWN,
        claims_section(sigma_table),
        load_section([press(sigma_table, radius, PRELOADS_N) for radius in INDENTERS_MM]),
        block_text.section(sigma_table, depths, wide_block_error),
        stuck_cylinder.section(sigma_table),
        array_section(run),
    )
    return "\n".join(sections)


def claims_section(sigma_table: SigmaTable) -> str:
    """The paper's statements beside what is found here."""
    rows = ((claim.claim, claim.found, claim.verdict) for claim in checked(sigma_table))
    header = ("the paper says", "found here", "verdict")
    return (
        "## The paper's statements, checked\n\n"
        "The half space's error of 40, 10 and 1 % has a section of its own below.\n\n"
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

"""docs/mechanisms.md as text: everything in it comes from the catalogue and from the fits to measured silicones."""

import json
from typing import Any

import numpy as np

from docs.mechanisms.signatures import shown
from docs.mechanisms.silicones import RESULTS
from docs.paper.markdown import table
from underskin.mechanisms import HeavyTailed, Mechanism, Normal, Parameter
from underskin.mechanisms.models.composition import D33, THICKNESS, YOUNGS_MODULUS
from underskin.mechanisms.registry import built_in
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor, SkinDescription

_INTRODUCTION = """\
# What may have been left out

The mechanisms that a diagnosis can name, written by `make mechanisms` (`docs/mechanisms/`) from what their files say
(`underskin/mechanisms/laws/`, one file each; [how to add one](extending.md)). A figure shows what one does to
recordings on a soft skin (h 2.5 mm, rT 1.5 mm, E 2 MPa) with its parameters at the value in the column *shown*.

*Needs* is what a campaign must hold beyond what every recording tells; FRFs also need the skin's thickness_mm,
youngs_modulus_mpa and sensor_radius_mm. *Shows on* names along what the effect shows: a campaign that varies little
there can support the mechanism and still not tell it from others, which a diagnosis then says.

## How they act together

`compose(names, campaign, table)` puts any set of them on the base model: Hertz' radius on a half space, the contact
edge still, σ of the bonded finite-strain layer from the table, averaged over the sensor's disc at its offset. Whatever
order they are named in, they act in the order of the table below, which lists them by stage. Those of the increment
with the load differentiate F σ at fixed R, with everything before them inside. sensor_spread acts on the variance of
the sensors' gains. In curves, the material gives the force at a given contact, then its history, then the stage's give
by that force, all solved together for the displacement that was measured.

Where a mechanism leaves the table's ground (ν < 0.5, a yielding glue line, a pressure that is not Hertz') σ is the
exact linear layer's plus what finite strain adds in the table at the mechanism's own a and L. Contacts beyond the
table are continued along its tangent, sensors further than 8 thicknesses from the contact feel nothing, and both are
marked: `valid` says which rows are inside as declared, `inside` which are at the parameters at hand. Every
parameter's fit coordinate is its value, or its logarithm, and all derivatives are exact. A *heavy-tailed* prior is
Student's t distribution with three degrees of freedom on it, with this scale: some rigs go far beyond what is usual.
Beside its own parameters every model of FRFs has the nuisances

"""

_SILICONES = """\
## Measured silicones

What strain_stiffening's priors are built on: three hyperelastic laws fitted to public measurements of silicone
cylinders in compression and dumbbells in tension, over their range (up to 300 %) and up to 40 % strain
(`python -m docs.mechanisms.silicones` fits them anew from the folder that `UNDERSKIN_RECORDINGS` names). E is the law's
slope at zero strain; the residual is in percent of the largest stress. Yeoh's three terms hold everywhere; the shape
parameters found over a part of the curve do not carry over to the whole, which is why their priors are wide.

"""

# A campaign on which every mechanism's parameters can be listed.
_CAMPAIGN = Campaign(
    "listing",
    SkinDescription(poisson_ratio=0.5, sensors=(Sensor("s", 0.0, 0.0),)),
    (FrfRecording("r", "s", 4.0, 1.0, 0.1, position_mm=(0.5, 0.0)),),
)


def document() -> str:
    """The whole page."""
    parts = [_INTRODUCTION, _parameters((D33, YOUNGS_MODULUS, THICKNESS), with_shown=False), _overview()]
    parts += [_section(mechanism) for mechanism in built_in()]
    return "\n".join([*parts, _SILICONES + _silicones()])


def _overview() -> str:
    rows = [
        (mechanism.stage.value, f"[{name}](#{name})", ", ".join(mechanism.kinds), ", ".join(mechanism.axes))
        for name, mechanism in ((entry.name, entry) for entry in built_in())
    ]
    return "## All of them\n\n" + table(("stage", "name", "recordings", "shows on"), rows)


def _section(mechanism: Mechanism) -> str:
    where = f"**Recordings:** {', '.join(mechanism.kinds)}. **Shows on:** {', '.join(mechanism.axes)}."
    lines = [
        f"## {mechanism.name}\n",
        f"{mechanism.plain}\n",
        f"**Law.** {mechanism.law}\n",
        f"**Assumptions.** {mechanism.assumptions}\n",
        f"**Source.** {mechanism.source}\n",
        f"{where} **Needs:** {mechanism.needs}.\n",
    ]
    distinct = {
        (parameter.name, parameter.prior): parameter
        for kind in mechanism.kinds
        for parameter in mechanism.parameters(_CAMPAIGN, kind)
    }
    if distinct:
        lines.append(_parameters(tuple(distinct.values()), with_shown=True))
    lines.append(f"![What {mechanism.name} does](figures/mechanism-{mechanism.name}.svg)\n")
    return "\n".join(lines)


def _parameters(parameters: tuple[Parameter, ...], *, with_shown: bool) -> str:
    header = (
        "parameter",
        "unit",
        "bounds",
        "prior",
        "base model at",
        *(("shown",) if with_shown else ()),
        "why this prior",
    )
    rows = []
    for parameter in parameters:
        limit = "" if parameter.limit is None else f"{parameter.limit:g}".replace("inf", "∞")
        value = (f"{shown(parameter):g}",) if with_shown else ()
        rows.append(
            (
                parameter.name,
                parameter.unit,
                f"{parameter.low:g} to {parameter.high:g}",
                _prior(parameter),
                limit,
                *value,
                parameter.reason,
            )
        )
    return table(header, rows)


def _prior(parameter: Parameter) -> str:
    if not isinstance(parameter.prior, Normal):
        return "even" if parameter.scale == "linear" else "even in the logarithm"
    heavy = isinstance(parameter.prior, HeavyTailed)
    if parameter.scale == "linear":
        return f"{'heavy-tailed' if heavy else 'normal'}, {parameter.prior.mean:g} ± {parameter.prior.sd:g}"
    usual, factor = np.exp([parameter.prior.mean, parameter.prior.sd])
    return f"{'heavy-tailed in the logarithm' if heavy else 'log-normal'}, {usual:.3g}, factor {factor:.3g}"


def _silicones() -> str:
    header = (
        "sample",
        "test",
        "strain to",
        "Yeoh: E, kPa; c2, c3; residual",
        "Gent: E; 1/J; residual",
        "Ogden: E; α; residual",
    )
    rows = []
    for row in json.loads(RESULTS.read_text(encoding="utf-8")):
        fitted = (_fitted(row[law]) for law in ("Yeoh", "Gent", "Ogden"))
        rows.append((row["sample"], row["kind"], f"{row['largest_strain']:g}", *fitted))
    return table(header, rows)


def _fitted(fitted: dict[str, Any]) -> str:
    shape = ", ".join(f"{value:g}" for value in fitted["shape"])
    return f"{fitted['modulus_kpa']:g}; {shape}; {fitted['residual_percent']:g} %"

"""The page's sections on real recordings and on the paper's array."""

from collections.abc import Mapping
from typing import Any

from proof.judge import shown
from proof.markdown import table

Result = Mapping[str, Any]


def _number(value: Any) -> str:
    return "–" if value is None else f"{value:.3g}"


def _named(report: Result) -> str:
    parts = []
    for mechanism in report["mechanisms"]:
        values = ", ".join(
            f"{p['name']} {_number(p['value'])} {p['unit'].strip('-')} [{_number(p['low'])} to {_number(p['high'])}]"
            for p in mechanism.get("parameters", ())  # none where a diagnosis failed
        )
        parts.append(f"{mechanism['name']} ({values})" if values else mechanism["name"])
    return "; ".join(parts) or "–"


def _rivals(report: Result) -> str:
    return "; ".join(
        f"{shown(tuple(alternative['mechanisms']))} {alternative['probability']:.2f}"
        for alternative in report["alternatives"][:3]
    ) or "–"  # fmt: skip


def _moduli(fit: Result | None) -> str:
    """Young's modulus of the base model and of the explanation, where curves tell it."""
    moduli = [fit[part].get("youngs_modulus") for part in ("before", "after")] if fit else []
    return " → ".join(_number(modulus["value"]) for modulus in moduli if modulus) or "–"


def recordings(result: Result) -> str:
    """Diagnoses of real recordings."""
    rows = []
    for campaign in result["campaigns"]:
        report, fit = campaign["report"], campaign["report"]["fit"]
        errors = (fit["before"]["heldout_rmse_percent"], fit["after"]["heldout_rmse_percent"],
                  fit["noise_floor_percent"]) if fit else (None, None, None)  # fmt: skip
        plain = [fit[part]["rmse_percent"] for part in ("before", "after")] if fit else [None, None]
        rows.append([campaign["name"], f"{report['verdict']} {report['probability']:.2f}", _named(report),
                     _rivals(report), _moduli(fit), " → ".join(map(_number, plain)),
                     " → ".join(_number(value) for value in errors[:2]) + f" ({_number(errors[2])})"])  # fmt: skip
    stated = table(
        ["campaign", "what the diagnosis was told"],
        [[campaign["name"], campaign["stated"]] for campaign in result["campaigns"]],
    )
    where = "\n".join(f"- **{campaign['name']}**: {_sentence(campaign['report'])}" for campaign in result["campaigns"])
    header = [
        "campaign", "verdict", "named", "rivals", "E before → after, MPa",
        "least squares, in sample, before → after, %",
        "held-out error before → after (noise floor), %",
    ]  # fmt: skip
    return f"""\
## Real recordings

Public measurements of other labs, each started from the simplest model with the modulus free. What their sources
found in them was kept from the diagnosis. The held-out part is the highest force of each curve, extrapolated from
the rest.

{stated}
{table(header, rows)}
![Held-out error of real recordings](figures/proof-recordings.svg)

{_findings(result)}
What each report says, in its own words:

{where}
"""


def _sentence(report: Result) -> str:
    """A report's statement without the laws, and where it locates the misfit."""
    sentences = report["statement"].split(". ")
    chosen = sentences if report["verdict"] == "unexplained" else sentences[:1]
    return f"{'. '.join(chosen).rstrip('.')}. {report['location']['statement']}"


def _findings(result: Result) -> str:
    """The statements of the sources beside the diagnoses."""
    reports = {campaign["name"]: campaign["report"] for campaign in result["campaigns"]}

    def naming(prefix: str, mechanism: str) -> str:
        chosen = [report for name, report in reports.items() if name.startswith(prefix)]
        named = [mechanism in {stated["name"] for stated in report["mechanisms"]} for report in chosen]
        beneath = [mechanism in report["fit"]["mechanisms"] for report in chosen]
        further = sum(beneath) - sum(named)
        return f"{sum(named)} of {len(named)}" + (f", and {further} beneath what is unexplained" if further else "")

    def tied(prefix: str, mechanism: str) -> str:
        chosen = [report for name, report in reports.items() if name.startswith(prefix)]
        listed = [
            any(mechanism in (pair["mechanism"], pair["confounded_with"]) for pair in report["not_identifiable"])
            for report in chosen
        ]
        return f"{sum(listed)} of {len(listed)}"

    rows = [
        ["the thin layer in the wells of October", "layered_contact named", naming("well-E", "layered_contact")],
        ["the stage's compliance there", "not identifiable", tied("well-E", "instrument_compliance")],
        [
            "stiffening of silicone between platens",
            "strain_stiffening named",
            naming("compression-", "strain_stiffening"),
        ],
        ["stiffening of silicone in tension", "strain_stiffening named", naming("tension-", "strain_stiffening")],
        ["creep of the gel", "contact_creep named", naming("polymergel", "contact_creep")],
        ["relaxation of the cell", "contact_creep named", naming("cell", "contact_creep")],
    ]
    return table(["what the source shows", "what the reports say", "in"], rows)


def paper_array(result: Result) -> str:
    """Diagnoses of the paper's array."""
    rows = [
        [campaign["name"], f"{campaign['report']['verdict']} {campaign['report']['probability']:.2f}",
         _named(campaign["report"]), _rivals(campaign["report"])]
        for campaign in result["campaigns"]
    ]  # fmt: skip
    reports = {campaign["name"]: campaign["report"] for campaign in result["campaigns"]}
    array = reports["array"]
    undecidable = [axis["axis"] for axis in array["location"]["axes"] if axis["p_value"] is None]
    planned = (array["next_experiment"] or {}).get("statement", "none, since one set holds most of the probability")
    return f"""\
## The paper's array

The paper reports 14 pC/N over two indenters, and on the array 14 pC/N at 1 N (12 sensors) and 22 pC/N at 3 N (41
sensors), and ties the lower value to the latest runs. The recordings behind these numbers are not public, so they
are made here from the numbers and the base model with 5 % scatter of recordings, 1 % line noise, 200 load cycles a
recording and 100 000 between the runs at 3 N and the latest at 1 N; those four are assumptions.

{table(["campaign", "verdict", "named", "rivals"], rows)}
On the array every recording at 1 N is a late one and every recording at 3 N an early one. The two groups differ in
preload, in age and, in part, in sensors, so the numbers alone cannot tell a d33 that grows with preload from one
that falls with age: any weight between the two comes from the mechanisms' priors, not from the recordings. That
something is missing from the base model on the array is not in doubt. Axes that the report calls undecidable there:
{", ".join(undecidable) or "none"}. Next experiment in that report: {planned.rstrip(".")}. {_too_sure(array)}

What settles it: press the twelve sensors of the latest runs at 1 N *and* 3 N on the same day. The last two rows are
that experiment in both worlds, diagnosed together with the array's recordings.
"""


def _too_sure(array: Result) -> str:
    """Whether the report on the array leaves the question open, as it should."""
    pairs = [{pair["mechanism"], pair["confounded_with"]} for pair in array["not_identifiable"]]
    listed = "lists" if {"preload_dependent_d33", "ageing"} in pairs else "does not list"
    tied = f"It {listed} the two as confounded."
    if array["verdict"] != "explained":
        return tied
    return f"{tied} Its probability of {array['probability']:.2f} is more than such recordings can carry."

"""The page's section on a declared modulus that is wrong by a factor of 2 to 4."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share

Result = Mapping[str, Any]
_CLOSE = math.log(1.1)


def wrong_modulus(result: Result) -> str:
    """Whether the error is named or grouped, and how well its factor is found."""
    judged = result["judged"]
    visible = [judgement for judgement in judged if judgement["visible"]]
    parts = {
        "FRFs alone": [judgement for judgement in visible if judgement["what"] == "frf"],
        "beside a block": [judgement for judgement in visible if judgement["what"] == "compression"],
        "beside indentations": [judgement for judgement in visible if judgement["what"] == "indentation"],
        "contacts beyond the tables as declared": [judgement for judgement in visible if judgement["beyond"]],
        "all": visible,
    }
    of_factor = ["interval holds the factor, of the named", "within 10 %, of the determined", "of these named"]
    head = ["recordings", "named or grouped", *of_factor]
    return f"""\
## A declared modulus that is wrong by a factor of 2 to 4

{len(judged)} campaigns of the virtual rig whose declared E is wrong by a factor of 2 to 4, up or down
(`underskin prove wrong_modulus`, `proof/wrong_modulus.py`, seed {result["seed"]}), half beside a compressed block or
indentations, a third with a companion; {len(visible)} visible (more than 20 in χ² together). *Named or grouped*:
`modulus_error` is in the leading set, or in a group that holds 80 %. *Determined*: the standard deviation of ln E is
below 5 % on the FRFs by the rig's equations, or a block or indentations are there. These equations take a scatter of
places to first order: of contacts centred on their sensors they promise more than there is where it is large.

{table(head, [[called, *_row(entries)] for called, entries in parts.items()])}
{_of_contacts(visible)}
{_of_d33(visible)}
Not named or grouped, of the visible:

{_missed(visible)}"""


def _row(entries: Sequence[Result]) -> list[str]:
    determined = [judgement for judgement in entries if judgement["determined"]]
    return [
        percent(share([_is_named(judgement) for judgement in entries])),
        percent(share([judgement["held"] for judgement in entries if judgement["named"]])),
        percent(share([_is_close(judgement) for judgement in determined])),
        percent(share([_is_close(judgement) for judgement in determined if judgement["named"]])),
    ]


def _is_named(judgement: Result) -> bool:
    return bool(judgement["named"] or judgement["grouped"])


def _is_close(judgement: Result) -> bool:
    return bool(judgement["named"] and judgement["off"] < _CLOSE)


def _of_contacts(entries: Sequence[Result]) -> str:
    beyond = [judgement for judgement in entries if judgement["beyond"]]
    total = sum(judgement["beyond"] for judgement in beyond)
    excluded = sum(judgement["left_out"] for judgement in beyond)
    return (
        f"By the declared E {total} contacts of {len(beyond)} campaigns lie beyond the tables; {total - excluded} of "
        f"them were kept.\n"
    )


def _of_d33(entries: Sequence[Result]) -> str:
    groups = {
        "the stated d33": [judgement["d33_off"] for judgement in entries if judgement["d33_off"] is not None],
        "a quotable one": [judgement["d33_off"] for judgement in entries if judgement["d33_quotable"]],
    }
    parts = [
        f"{called} is off by {100 * np.expm1(np.median(values)):.1f} % in the median and by "
        f"{100 * np.expm1(np.quantile(values, 0.9)):.1f} % in one of ten ({len(values)} campaigns)"
        for called, values in groups.items()
        if values
    ]
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}.\n" if text else ""


def _missed(entries: Sequence[Result]) -> str:
    rows = [
        [judgement["name"], judgement["what"], f"{judgement['factor']:.3g}", ", ".join(judgement["companions"]) or "–",
         f"{judgement['sd_ln_modulus']:.2g}",
         f"{judgement['answer'][0]}: {', '.join(judgement['answer'][1]) or 'nothing'}"]
        for judgement in entries if not _is_named(judgement)
    ]  # fmt: skip
    if not rows:
        return "None.\n"
    return table(["campaign", "recordings", "factor", "companions", "sd of ln E by the rig", "answer"], rows)

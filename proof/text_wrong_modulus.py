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
    visible = [entry for entry in judged if entry["visible"]]
    parts = {
        "FRFs alone": [entry for entry in visible if entry["what"] == "frf"],
        "beside a block": [entry for entry in visible if entry["what"] == "compression"],
        "beside indentations": [entry for entry in visible if entry["what"] == "indentation"],
        "contacts beyond the tables as declared": [entry for entry in visible if entry["beyond"]],
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
    determined = [entry for entry in entries if entry["determined"]]
    return [
        percent(share([_is_told(entry) for entry in entries])),
        percent(share([entry["held"] for entry in entries if entry["named"]])),
        percent(share([_is_close(entry) for entry in determined])),
        percent(share([_is_close(entry) for entry in determined if entry["named"]])),
    ]


def _is_told(entry: Result) -> bool:
    return bool(entry["named"] or entry["grouped"])


def _is_close(entry: Result) -> bool:
    return bool(entry["named"] and entry["off"] < _CLOSE)


def _of_contacts(entries: Sequence[Result]) -> str:
    beyond = [entry for entry in entries if entry["beyond"]]
    total = sum(entry["beyond"] for entry in beyond)
    left_out = sum(entry["left_out"] for entry in beyond)
    return (
        f"By the declared E {total} contacts of {len(beyond)} campaigns lie beyond the tables; {total - left_out} of "
        f"them were kept.\n"
    )


def _of_d33(entries: Sequence[Result]) -> str:
    groups = {
        "the stated d33": [entry["d33_off"] for entry in entries if entry["d33_off"] is not None],
        "a quotable one": [entry["d33_off"] for entry in entries if entry["d33_quotable"]],
    }
    said = [
        f"{called} is off by {100 * np.expm1(np.median(values)):.1f} % in the median and by "
        f"{100 * np.expm1(np.quantile(values, 0.9)):.1f} % in one of ten ({len(values)} campaigns)"
        for called, values in groups.items()
        if values
    ]
    text = "; ".join(said)
    return f"{text[:1].upper()}{text[1:]}.\n" if text else ""


def _missed(entries: Sequence[Result]) -> str:
    rows = [
        [entry["name"], entry["what"], f"{entry['factor']:.3g}", ", ".join(entry["companions"]) or "–",
         f"{entry['sd_ln_modulus']:.2g}", f"{entry['answer'][0]}: {', '.join(entry['answer'][1]) or 'nothing'}"]
        for entry in entries if not _is_told(entry)
    ]  # fmt: skip
    if not rows:
        return "None.\n"
    return table(["campaign", "recordings", "factor", "companions", "sd of ln E by the rig", "answer"], rows)

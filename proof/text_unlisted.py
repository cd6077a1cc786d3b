"""The page's sections on unlisted laws: of a separate rig, and of the catalogue with one mechanism excluded."""

from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from proof.markdown import table
from proof.phrases import median_of, percent
from proof.statistics import share

Result = Mapping[str, Any]
_QUIET = ("no_mismatch", "insufficient_data")
_THRESHOLDS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
_UNLISTED_LIMIT, _EXCLUDED_LIMIT = 1.5, 1.3  # times the noise, and the error with the mechanism's own name


def hidden(result: Result, quiet: Result | None = None) -> str:
    """The section on campaigns that hide a law."""
    identifiable = [judgement for judgement in result["judged"] if judgement["identifiable"]]
    visible = [judgement for judgement in result["judged"] if judgement["visible"]]
    missed = [[judgement["name"], judgement["law"], judgement["verdict"], f"{judgement['probability']:.2f}",
               judgement["statement"]] for judgement in identifiable if not judgement["placed"]]  # fmt: skip
    misses = table(["campaign", "hidden", "verdict", "probability", "stated"], missed) if missed else "No misses.\n"
    count, shares = len(identifiable), _shares(identifiable, visible)
    return f"""\
## Physics that nobody listed

{len(result["judged"])} campaigns of a rig that knows neither the diagnosis' catalogue nor its grammar (`rig/unlisted`,
seed {result["seed"]}). By that rig's own equations {len(visible)} hide a law that gains more than 20 in χ² over the
base model, and {count} one that gains as much over the best single mechanism of the catalogue too: of these it can
be told that the law is unlisted. An equivalent counts as right that the rig itself cannot tell from what it hid.

{table(["share", "of the identifiable, over both", "of all that gain over the base model"], shares)}
{_trade_off(identifiable, quiet["judged"]) if quiet is not None else ""}
### Every miss

{misses}"""


def _shares(identifiable: Sequence[Result], visible: Sequence[Result]) -> list[list[str]]:
    """The share of each kind of success among the identifiable, and among all visible campaigns."""
    both = (identifiable, visible)
    labels = {"recognised": "recognised as not in the catalogue", "placed": "where it enters and what it follows",
            "shaped": "and its form"}  # fmt: skip
    rows = [[words, *(_share(entries, key) for entries in both)] for key, words in labels.items()]
    over = [
        [judgement["over_noise"] for judgement in entries if judgement["over_noise"] is not None] for entries in both
    ]
    if all(over):
        few = [percent(share([ratio <= _UNLISTED_LIMIT for ratio in ratios])) for ratios in over]
        rows += [
            ["error held out over the noise, median", *map(median_of, over)],
            [f"at most {_UNLISTED_LIMIT} times the noise, of those modelled", *few],
        ]
    return rows


def alarms(result: Result) -> str:
    """The section on campaigns that hide nothing."""
    judged = result["judged"]
    false = [judgement for judgement in judged if judgement["verdict"] not in _QUIET]
    rows = [
        [judgement["name"], judgement["verdict"], f"{judgement['probability']:.2f}", judgement["statement"]]
        for judgement in false
    ]
    listed = table(["campaign", "verdict", "probability", "stated"], rows) if rows else ""
    sure = sum(judgement["probability"] > 0.8 for judgement in false)
    return f"""\
### Nothing there

{len(judged)} campaigns of the same rig with nothing missing (seed {result["seed"]}): something is stated in
{percent(share([judgement in false for judgement in judged]))}; with more than 80 % in {sure}.

{listed}"""


def _trade_off(identifiable: Sequence[Result], quiet: Sequence[Result]) -> str:
    """Detections and false alarms for a threshold on the probability that something is missing."""
    rows = [
        [
            f"{limit:g}",
            percent(share([judgement["missing"] > limit for judgement in identifiable])),
            percent(share([judgement["missing"] > limit for judgement in quiet])),
        ]
        for limit in _THRESHOLDS
    ]
    return f"""\
The probability that anything is missing, by whatever set or law, against a threshold: what is found and what is raised.

{table(["more probable than", "of what is hidden", "of nothing (next section)"], rows)}"""


def left_out(result: Result) -> str:
    """The section on the catalogue with one mechanism excluded."""
    judged = result["judged"]
    rows = []
    for name in sorted({judgement["hidden"] for judgement in judged}):
        of_mechanism = [judgement for judgement in judged if judgement["hidden"] == name]
        laws = [judgement["law"] for judgement in of_mechanism if judgement["law"]]
        laws_found = sorted({f"{law['acts_on']} over {law['axis']}" for law in laws})
        rows.append(
            [
                name,
                str(len(of_mechanism)),
                str(sum(_placed(judgement) for judgement in of_mechanism)),
                "; ".join(laws_found) or "none",
                _instead(of_mechanism),
                *(
                    _middle(of_mechanism, key)
                    for key in ("before_over_noise", "unnamed_over_noise", "named_over_noise")
                ),
            ]
        )
    ratios = [ratio for judgement in judged if (ratio := _ratio(judgement)) is not None]
    close = percent(share([ratio <= _EXCLUDED_LIMIT for ratio in ratios]))
    sentence = (
        f"Error held out with the law over that with the named mechanism, both over their noise: median "
        f"{median_of(ratios)}; at most {_EXCLUDED_LIMIT} times in {close} of those that have a law."
        if ratios
        else ""
    )
    header = [
        "left out",
        "visible",
        "found",
        "laws stated",
        "predicts as well",
        "before",
        "with the law",
        "with its own name",
    ]
    return f"""\
## Every mechanism left out in turn

{result["drawn"]} campaigns of our own rig with one effect (`proof/left_out.py`), diagnosed without that mechanism in
the catalogue: {len(judged)} are visible. *Found*: a law is stated, over an axis on which the mechanism acts, and it
enters where the mechanism does, or predicts recordings held out at most {_EXCLUDED_LIMIT} times as badly as with the
mechanism's own name. Errors are
medians, in multiples of the noise of what was held out. *Predicts as well*: other mechanisms are named, by which
recordings held out are predicted at most {_EXCLUDED_LIMIT} times as badly as with its own name: what was left out and
these cannot be told apart in that design.

{table(header, rows)}
Found: {percent(share([_placed(judgement) for judgement in judged]))}; found, or another name that predicts as well:
{percent(share([_placed(judgement) or _names_an_equivalent(judgement) for judgement in judged]))}. {sentence}
"""


def _share(entries: Sequence[Result], key: str) -> str:
    return percent(share([judgement[key] for judgement in entries]))


def _placed(judgement: Result) -> bool:
    """Whether a law stands for the excluded mechanism."""
    ratio = _ratio(judgement)
    return bool(
        judgement["axis_right"] and (judgement["entry_right"] or (ratio is not None and ratio <= _EXCLUDED_LIMIT))
    )


def _ratio(judgement: Result, of: str = "unnamed_over_noise") -> float | None:
    stated, named = judgement[of], judgement["named_over_noise"]
    return None if stated is None or named is None else float(stated / named)


def _names_an_equivalent(judgement: Result) -> bool:
    ratio = _ratio(judgement, "instead_over_noise")
    return ratio is not None and ratio <= _EXCLUDED_LIMIT


def _instead(entries: Sequence[Result]) -> str:
    """Which other mechanisms are named in its place that predict as well, and how often."""
    counted = Counter(
        " and ".join(judgement["named_instead"]) for judgement in entries if _names_an_equivalent(judgement)
    )
    return "; ".join(f"{name} ({count})" for name, count in counted.most_common()) or "none"


def _middle(entries: Sequence[Result], key: str) -> str:
    values = [judgement[key] for judgement in entries if judgement[key] is not None]
    return f"{median(values):.2f}" if values else "–"

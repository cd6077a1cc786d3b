"""The planned recordings as the report's `next_experiment`, with a statement in words."""

from typing import Any

from underskin.diagnosis.data.axes import WORDS
from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.planning.optimal_design import WRONG_MODULUS, NextRecordings
from underskin.diagnosis.reporting.statements import listed
from underskin.findings.formatting import in_percent

_STIFFENING = "strain_stiffening"
_VARIED = {  # of curves, as `WORDS` else
    "displacement_mm": "depth",
    "force_n": "largest force",
    "sample_diameter_mm": "diameter of the sample",
    "sample_height_mm": "height of the sample",
    "time_s": "speed and the time of a hold",
}


def next_experiment(plan: NextRecordings | None) -> dict[str, Any]:
    """The document, in lab units; empty where nothing needs to be planned."""
    if plan is None:
        return {}
    return {
        "recordings": _recordings(plan),
        "separates": [list(names) for names in plan.rivals],
        "probability_of_deciding": round(plan.probability, 3),
        "without_it": round(plan.without, 3),
        "minutes": round(plan.minutes, 1),
        "statement": _statement(plan) if plan.recordings else _why_none(plan),
    }


def _recordings(plan: NextRecordings) -> list[dict[str, Any]]:
    documents = []
    for entry in dict.fromkeys(plan.recordings):
        names = ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n")
        described = {name: getattr(entry, name) for name in names}
        described |= {"position_mm": list(entry.position_mm or ()), "dwell_s": entry.dwell_s}
        known = {name: value for name, value in described.items() if value is not None}
        documents.append({**known, "repeats": plan.recordings.count(entry)})
    return documents


def _statement(plan: NextRecordings) -> str:
    first = plan.first
    assert first is not None
    beyond = " It goes beyond what this campaign did: check that the rig can." if plan.beyond else ""
    one = f"with the sphere of {first.indenter_radius_mm:g} mm radius at {first.preload_n:g} N"
    several = f"{len(plan.recordings)} recordings, of which that {one} tells most,"
    return (
        f"{several if len(plan.recordings) > 1 else f'One recording {one}'} should tell whether "
        f"it is {_rivals(plan)}, with a probability of {in_percent(plan.probability)}.{beyond}{_block(plan)}"
    )


def _block(plan: NextRecordings) -> str:
    """That a compressed block or an indentation would tell, where that is promising."""
    if plan.block is None:
        return ""
    stiffens = any(_STIFFENING in names for names in plan.rivals)
    also = "; compressed by a fifth of its height, a block shows strain stiffening too" if stiffens else ""
    told = f"whether it is {in_words([WRONG_MODULUS])}, with a probability of {in_percent(plan.block)}{also}"
    return f" A compressed block or an indentation of the same elastomer would tell E, and so {told}."


def _why_none(plan: NextRecordings) -> str:
    if plan.outside:
        return (
            f"No recordings within these limits can be planned to tell whether it is {_rivals(plan)}: the tables hold "
            f"none of their contacts; choose spheres and preloads nearer to those of the campaign.{_block(plan)}"
        )
    statement = f"No recordings within these limits are likely to tell whether it is {_rivals(plan)}."
    if plan.differ_on:
        words = sorted(_VARIED[axis] if axis in _VARIED else WORDS[axis][0] for axis in plan.differ_on)
        statement += f" They differ in what they depend on: vary the {listed(words)} more widely than here."
    return statement + _block(plan)


def _rivals(plan: NextRecordings) -> str:
    """Each explanation in words, "with" between the mechanisms of one, so that "or" parts explanations alone."""
    *others, last = [" with ".join(in_words([name]) for name in names) for names in plan.rivals]
    return f"{', '.join(others)} or {last}" if others else last

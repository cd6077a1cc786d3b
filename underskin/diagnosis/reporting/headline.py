"""The headline of a report: what it says, with the number, in at most 20 words.

It is made of the report alone, so that reports that were kept without one have it too. Parts come in the order in which
a reader needs them: a slip in the recordings, the answer, the number to quote, what would decide. A part that does not
fit is left out.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from underskin.diagnosis.data.names import EXPLAINED, MOST_QUOTED, NAMED, in_words, quantity_in_words
from underskin.diagnosis.reporting.numbers import is_known
from underskin.diagnosis.reporting.page_styles import with_minus
from underskin.diagnosis.reporting.statement import SLIPS
from underskin.diagnosis.reporting.wording import finding, in_its_unit, readable, unit
from underskin.findings.codes import FindingCode
from underskin.findings.formatting import capital, in_percent, significant
from underskin.mechanisms.unlisted.vocabulary import acted_on, followed

WORDS = 20  # read at a glance
_DOUBTS = (FindingCode.THICKNESS_DIFFERS, FindingCode.PULLED_OR_PRESSED)
_LAYER = "layered_contact"  # the name of the law, which says little to who reads a headline alone

Document = Mapping[str, Any]


def headline(report: Document) -> str:
    """One sentence of at most 20 words on a report of one campaign."""
    parts = (part.replace("_", " ") for part in _parts(report))  # a lab's names of conditions
    return readable(within_words(parts))


def first_and_rest(report: Document) -> tuple[str, str]:
    """The headline of a report without its full stop, and its statement; of a report on several campaigns that was kept
    without a headline, the first sentence of the statement and the others."""
    if report.get("headline") or "campaigns" not in report:
        first = report.get("headline") or headline(report)
        return first.rstrip("."), report["statement"] if report["statement"] != first else ""
    first, _, rest = report["statement"].partition(". ")
    return first.rstrip("."), rest


def within_words(parts: Iterable[str], kept: str = "") -> str:
    """A sentence of at most 20 words: of parts in their order, `kept` of them and the others that fit beside it."""
    chosen, words = list[str](), len(kept.split())
    for part in parts:
        more = 0 if part == kept else len(part.split())
        if part and words + more <= WORDS:
            chosen.append(part)
            words += more
    return f"{capital('; '.join(chosen))}."


def _parts(report: Document) -> Iterator[str]:
    named = (*SLIPS, FindingCode.CURVES_DIFFER)
    slips = [finding(entry["code"]) for entry in report.get("findings", ()) if entry["code"] in named]
    for slip in (*(slips[:1] or _doubts(report)), ""):
        fitting = [answer for answer in _answers(report) if len(f"{slip} {answer}".split()) <= WORDS]
        if fitting:
            yield from (slip, fitting[0])
            break
    yield _to_quote(report)
    planned = report.get("next_experiment")
    if report["verdict"] == "ambiguous" and planned and planned["recordings"]:
        repeats = sum(recording["repeats"] for recording in planned["recordings"])
        recordings = "one more recording" if repeats == 1 else f"{repeats} more recordings"
        yield f"{recordings} may decide ({in_percent(planned['probability_of_deciding'])})"


def _doubts(report: Document) -> list[str]:
    """That the declared thickness or the stated signs may be wrong, which an answer for these would hide."""
    doubtful = (entry["statement"] for entry in report.get("findings", ()) if entry["code"] in _DOUBTS)
    return [words.partition(":")[0] for words in doubtful]


def _answers(report: Document) -> Iterator[str]:
    """The answer, the fullest first; the last fits beside any slip."""
    verdict, probability = report["verdict"], in_percent(report["probability"] or 0.0)
    mechanisms = report["mechanisms"]
    names = _named([mechanism["name"] for mechanism in mechanisms])
    if verdict == "insufficient_data":
        first = report["statement"].partition(". ")[0].rstrip(".")
        if "_" not in first:  # names of fields are for those who correct them
            yield first
        yield "nothing can be concluded from these recordings"
    elif verdict == "no_mismatch":
        yield from _nothing_missing(report, probability)
    elif verdict == "unexplained":
        law = report.get("unnamed")
        if law is not None:
            change = f"the {acted_on(law['acts_on'], law['axis'])} changes with {followed(law['axis'])}"
            yield f"no known mechanism describes this ({probability}): {change}"
        yield f"something is missing that no known mechanism describes ({probability})"
    elif verdict == "explained":
        few = mechanisms if len(mechanisms) <= MOST_QUOTED else ()
        yield " and ".join(map(_with_strength, few)) or names
        yield names
        count = "a mechanism is" if len(mechanisms) == 1 else f"{len(mechanisms)} mechanisms are"
        yield f"{count} missing ({probability})"
    else:
        certain = [group for group in report.get("presence", ()) if group["probability"] >= EXPLAINED]
        for group in certain:
            either = " or ".join(_named([name]) for name in group["mechanisms"])
            yield f"{either} ({in_percent(group['probability'])}), not settled"
        if (report["probability"] or 0.0) >= EXPLAINED:
            yield f"{names or 'nothing missing'} ({probability}), not settled"
        remaining = (
            "many explanations remain" if not _rivals(report) else f"{1 + len(_rivals(report))} explanations remain"
        )
        yield f"{remaining}, best: {names or 'nothing missing'} ({probability})"
        yield remaining


def _nothing_missing(report: Document, probability: str) -> Iterator[str]:
    """That no mechanism is missing, and what the force keeps besides."""
    rivals = [_named(rival["mechanisms"]) for rival in _rivals(report)]
    if (report["probability"] or 0.0) < EXPLAINED and rivals:
        yield f"perhaps nothing is missing ({probability}), or {' or '.join(rivals)}"
    if (report["probability"] or 0.0) < EXPLAINED:
        yield f"perhaps nothing is missing ({probability})"
    elif remainder := report.get("remainder"):
        percent = significant(remainder["percent"], 2)
        yield f"no known mechanism is missing, {percent} % of the force is unexplained"
        yield f"{percent} % of the force is unexplained"
    else:
        yield "nothing is missing"


def _named(names: Sequence[str]) -> str:
    """Mechanisms in the words of mechanics."""
    return in_words(["thin layer" if name == _LAYER else name for name in names])


def _rivals(report: Document) -> list[Document]:
    return [rival for rival in report.get("alternatives", ()) if rival["probability"] > NAMED]


def _with_strength(mechanism: Document) -> str:
    """A mechanism with where it acts and its first parameter whose interval excludes 0: "adhesion, work of adhesion
    148 mJ/m² (145–151)"."""
    of = ", ".join((mechanism.get("scope") or {}).get("sensors") or ())
    name = _named([mechanism["name"]]) + (f" of {of}" if of else "")
    known = [parameter for parameter in mechanism["parameters"] if parameter["value"] is not None]
    sizes = [parameter for parameter in known if parameter["low"] > 0 or parameter["high"] < 0]
    return ", ".join([name, *map(_value, (sizes or known)[:1])])


def _value(parameter: Document) -> str:
    parameter = in_its_unit(parameter)
    called = quantity_in_words(parameter["name"])
    ends = [parameter[end] for end in ("value", "low", "high")]
    # As many digits as tell the interval's ends apart
    digits = next((most for most in range(3, 7) if significant(ends[1], most) != significant(ends[2], most)), 3)
    value, low, high = (with_minus(significant(end, digits)) for end in ends)
    size = f"{value} {unit(parameter['unit'])}".rstrip()
    if parameter.get("at_bound"):
        return f"{called} at or beyond {size}"
    return f"{called} {size} ({low}{' to ' if parameter['low'] < 0 else '–'}{high})"


def _to_quote(report: Document) -> str:
    """d33 or E with its interval; that there is none to quote where the verdict may be read as if there were, and of an
    E whose order of magnitude is not known."""
    d33, modulus = report.get("d33"), ((report.get("fit") or {}).get("after") or {}).get("youngs_modulus")
    if d33 is not None and d33.get("value") is not None:
        return _value({**d33, "name": "d33"}) if d33.get("quotable", True) else "no d33 to quote"
    if modulus is None or modulus.get("at_bound"):
        return ""
    return _value({**modulus, "name": "E"}) if is_known(modulus) else "no E to quote"

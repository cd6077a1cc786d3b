"""Files sent to the service, and what became of them, in lines."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from underskin.errors import UnderskinError
from underskin.findings.alike import grouped_by_reason, why_refused
from underskin.findings.formatting import significant

if TYPE_CHECKING:
    from underskin.client.campaigns import SentFile
    from underskin.client.service_client import Client

Line = tuple[bool, str]  # whether it is good news, and the words


def sent(
    client: "Client", files: Sequence[Path], terms: Mapping[str, Any], progress: Callable[[int], object]
) -> list[Line]:
    """The outcome of files sent at once: a line for each campaign, each remark and each refused recording.

    `terms` as `client.campaigns.post_files` takes them; `progress` is called with the bytes that are sent.
    """
    try:
        if terms["together"] is None and _is_export(files[0]):
            brought = client.skins.load(files[0], progress)
            return [(True, f"skin {brought['skin_id']}: {brought['kept']} campaigns, {brought['present']} were there")]
        results = results_of(client, files, {**terms, "progress": progress})
    except UnderskinError as error:
        return [(False, str(error))]
    except OSError as error:
        place = f"{error.filename} " if len(files) > 1 else ""
        return [(False, f"{place}cannot be opened: {error.strerror}")]
    return [line for result in results for line in outcome(client, result)]


def results_of(client: "Client", files: Sequence[Path], terms: Mapping[str, Any]) -> list["SentFile"]:
    """What the service answers to files, the same however often they are sent; raises UnderskinError, OSError."""
    from underskin.client.campaigns import content_key

    return client.campaigns.post_files(files, **terms, idempotency_key=content_key(files, terms))


def _is_export(file: Path) -> bool:
    """Whether a file is what `export` writes, by its content."""
    from underskin.recordings.skin_export import is_export

    with file.open("rb") as opened:
        return is_export(opened, str(file))


def outcome(client: "Client", result: Mapping[str, Any]) -> list[Line]:
    """What became of one campaign: its id and d33, remarks, and what was refused of it."""
    accepted = [entry for entry in result["recordings"] if entry["status"] == "ok"]
    lines = [(False, why_refused(error)) for error in result["errors"]]
    left_out = ((entry["id"], why_refused(error)) for entry in result["recordings"] for error in entry["errors"])
    lines += [(False, f"{names} {reason}") for names, reason in grouped_by_reason(left_out)]
    lines += [(True, note) for note in result["notes"]]
    if result["status"] == "ok":
        count = f"{len(accepted)} recording{'s' if len(accepted) != 1 else ''}"
        figures, remarks = _figures(client, result["id"])
        before = ", was there" if result["repeated"] else ""
        lines.insert(0, (True, f"campaign {result['id']} of skin {result['skin_id']}{before}, {count}: {figures}"))
        lines += [(True, remark) for remark in remarks]
    return lines


def _figures(client: "Client", campaign_id: str) -> tuple[str, list[str]]:
    """d33 and moduli of a campaign in one line, and a line for each finding and for each thing left out."""
    try:
        answer = client.campaigns.d33(campaign_id)
    except UnderskinError as error:  # the campaign is stored nevertheless
        return f"no d33: {error}", []
    moduli = [
        f"E of {one['recording']} {significant(one['youngs_modulus_mpa'], 4)} "
        f"± {significant(one['youngs_modulus_uncertainty_mpa'], 2)} MPa by its noise alone"
        for one in answer["moduli"]
    ]
    array = answer["array"]
    if array is not None:
        d33 = f"d33 {significant(array['d33_pc_per_n'], 3)} ± {significant(array['d33_uncertainty_pc_per_n'], 2)} pC/N"
    else:
        d33 = f"no d33: {answer['reason'] or 'every sensor stands out'}"
    results = moduli if moduli and answer["status"] == "none" else [d33, *moduli]
    remarks = [f"look at: {finding}" for finding in answer["findings"]]
    for left in answer["left_out"]:
        of = "" if left["recording"] is None else f"recording {left['recording']}: "
        remarks.append(f"left out: {of}{left['reason']}")
    return ", ".join(results), remarks

"""Files sent to the service, and the outcome in lines of text."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from underskin.errors import UnderskinError
from underskin.findings.formatting import grouped_by_reason, significant, why_refused

if TYPE_CHECKING:
    from underskin.client.campaigns import SentFile
    from underskin.client.service_client import Client

Line = tuple[bool, str]  # whether it is good news, and the words


def sent(
    client: "Client", files: Sequence[Path], terms: Mapping[str, Any], progress: Callable[[int], object]
) -> list[Line]:
    """The outcome of files sent at once: a line for each campaign, each remark and each refused recording.

    `terms` as `client.campaigns.post_files` takes them; `progress` is called with the number of bytes sent.
    """
    try:
        if terms["together"] is None and _is_export(files[0]):
            brought = client.skins.load(files[0], progress)
            return [(True, f"skin {brought['skin_id']}: {brought['kept']} campaigns, {brought['present']} were there")]
        results = results_of(client, files, {**terms, "progress": progress})
    except UnderskinError as error:
        return [(False, str(error))]
    except OSError as error:
        prefix = f"{error.filename} " if len(files) > 1 else ""
        return [(False, f"{prefix}cannot be opened: {error.strerror}")]
    return [line for result in results for line in outcome(client, result)]


def results_of(client: "Client", files: Sequence[Path], terms: Mapping[str, Any]) -> list["SentFile"]:
    """The service's answer to files, the same however often they are sent; raises UnderskinError, OSError."""
    from underskin.client.campaigns import content_key

    return client.campaigns.post_files(files, **terms, idempotency_key=content_key(files, terms))


def _is_export(file: Path) -> bool:
    """Whether a file was written by `export`, by its content."""
    from underskin.recordings.skin_export import is_export

    with file.open("rb") as opened:
        return is_export(opened, str(file))


def outcome(client: "Client", result: Mapping[str, Any]) -> list[Line]:
    """The outcome of one campaign: its id and d33, remarks, and refused recordings."""
    accepted = [recording for recording in result["recordings"] if recording["status"] == "ok"]
    lines = [(False, why_refused(error)) for error in result["errors"]]
    refusals = (
        (recording["id"], why_refused(error)) for recording in result["recordings"] for error in recording["errors"]
    )
    lines += [(False, f"{names} {reason}") for names, reason in grouped_by_reason(refusals)]
    lines += [(True, note) for note in result["notes"]]
    if result["status"] == "ok":
        count = f"{len(accepted)} recording{'s' if len(accepted) != 1 else ''}"
        figures, remarks = _figures(client, result["id"])
        before = ", was there" if result["repeated"] else ""
        lines.insert(0, (True, f"campaign {result['id']} of skin {result['skin_id']}{before}, {count}: {figures}"))
        lines += [(True, remark) for remark in remarks]
    return lines


def _figures(client: "Client", campaign_id: str) -> tuple[str, list[str]]:
    """d33 and moduli of a campaign in one line, and a line for each finding and each omission."""
    try:
        answer = client.campaigns.d33(campaign_id)
    except UnderskinError as error:  # the campaign is stored nevertheless
        return f"no d33: {error}", []
    moduli = [
        f"E of {modulus['recording']} {significant(modulus['youngs_modulus_mpa'], 4)} "
        f"± {significant(modulus['youngs_modulus_uncertainty_mpa'], 2)} MPa by its noise alone"
        for modulus in answer["moduli"]
    ]
    array = answer["array"]
    if array is not None:
        d33 = f"d33 {significant(array['d33_pc_per_n'], 3)} ± {significant(array['d33_uncertainty_pc_per_n'], 2)} pC/N"
    else:
        d33 = f"no d33: {answer['reason'] or 'every sensor stands out'}"
    results = moduli if moduli and answer["status"] == "none" else [d33, *moduli]
    remarks = [f"look at: {finding}" for finding in answer["findings"]]
    for omission in answer["left_out"]:
        of = "" if omission["recording"] is None else f"recording {omission['recording']}: "
        remarks.append(f"left out: {of}{omission['reason']}")
    return ", ".join(results), remarks

"""The commands that change what the service keeps: withdraw, exclude, correct, join and adopt. The originals stay."""

from pathlib import Path
from typing import Annotated

import typer

from underskin.cli.documents import AsJson, Document, write_json
from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.cli.sending import outcome, results_of
from underskin.cli.store import LOCAL, KeyOption, Url, connect
from underskin.errors import UnderskinError

Reason = Annotated[str, typer.Option(help="Why; kept, and shown with all that leaves it out.")]
CampaignArgument = Annotated[str, typer.Argument(help="Id of the campaign.")]
SkinArgument = Annotated[str, typer.Argument(help="Id of the skin.")]


def withdraw(
    campaign: CampaignArgument, reason: Reason, json: AsJson = False, url: Url = LOCAL, key: KeyOption = None
) -> None:
    """Leave a campaign out of all figures; it can still be read."""
    with connect(url, key) as client:
        detail = client.campaigns.withdraw(campaign, reason)
    _say(detail, f"campaign {campaign} of skin {detail['skin_id']} is withdrawn", json)


def exclude(
    campaign: CampaignArgument,
    recording: Annotated[str, typer.Argument(help="Id of the recording in the campaign.")],
    reason: Reason,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Leave a recording of a campaign out of all figures; it can still be read."""
    with connect(url, key) as client:
        detail = client.campaigns.exclude(campaign, recording, reason)
    count = f"{detail['excluded']} of {detail['recordings']} recordings are"
    _say(detail, f"recording {recording} is excluded; {count} now, of campaign {campaign}", json)


def correct(
    campaign: CampaignArgument,
    files: Annotated[list[Path], typer.Argument(help="What takes its place: a file, or several with --together.")],
    reason: Reason,
    rig: RigOption = None,
    estimator: EstimatorOption = None,
    together: Annotated[str | None, typer.Option(metavar="NAME", help="Join the files into one campaign.")] = None,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Put a campaign in the place of another, of the same skin; the other one stays, unused."""
    if len(files) > 1 and together is None:
        raise typer.BadParameter("several files need --together NAME", param_hint="FILES")
    terms = {"corrects": campaign, "reason": reason, "rig": rig, "estimator": estimator, "together": together}
    with connect(url, key) as client:
        try:
            results = results_of(client, files, terms)
        except OSError as error:
            raise UnderskinError(f"{error.filename} cannot be opened: {error.strerror}") from error
        lines = [line for result in results for line in outcome(client, result)]
    if json:
        write_json(results)
    for good, line in lines if not json else ():
        typer.echo(line, err=not good)
    if not all(good for good, _ in lines):
        raise typer.Exit(2)


def join(
    skin: SkinArgument,
    other: Annotated[str, typer.Argument(help="Id of the skin that counts as SKIN from now on.")],
    reason: Reason,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Say that two ids mean one skin: figures of SKIN use the campaigns of both."""
    with connect(url, key) as client:
        detail = client.skins.join(skin, other, reason)
    joined = " and ".join(joined_skin["id"] for joined_skin in detail["joined"])
    differ = "".join(f"\nwarning: they differ: {difference}" for difference in detail["differences"])
    _say(detail, f"skin {detail['id']} counts as one with {joined}{differ}", json)


def adopt(
    skin: SkinArgument,
    diagnosis: Annotated[str, typer.Argument(help="Id of the diagnosis; `underskin campaigns ID` lists them.")],
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Adopt the model of an explained diagnosis for a skin; requests for the adopted model use it."""
    with connect(url, key) as client:
        model = client.skins.adopt(skin, diagnosis)
    _say(model, f"skin {model['skin_id']}: version {model['version']} of its model, by diagnosis {diagnosis}", json)


def _say(document: Document, words: str, json: bool) -> None:
    if json:
        write_json(document)
    else:
        typer.echo(words)

"""The commands that change what the service keeps: withdraw, exclude, correct, join, adopt, annotate, discard and undo.

The originals stay; nothing is deleted.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.cli.rigs import EstimatorOption, RigOption
from underskin.cli.store import LOCAL, KeyOption, Url, connect, outcome, results_of
from underskin.cli.stored import AsJson, Document, moment, write_json, write_rows
from underskin.errors import UnderskinError

if TYPE_CHECKING:
    from underskin.client.campaigns import Campaigns, Skins
    from underskin.client.service_client import Client

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


OfCampaign = Annotated[str | None, typer.Option("--campaign", metavar="ID", help="Of this campaign.")]
OfSkin = Annotated[str | None, typer.Option("--skin", metavar="ID", help="Of this skin.")]


def annotate(
    campaign: OfCampaign = None,
    skin: OfSkin = None,
    name: Annotated[str | None, typer.Option(help="What the lab calls it.")] = None,
    notes: Annotated[str | None, typer.Option(help="Notes in place of the earlier ones; empty for none.")] = None,
    tags: Annotated[
        str | None, typer.Option(metavar="TAG,...", help="Tags in place of the earlier ones; empty for none.")
    ] = None,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Name a campaign or a skin, or change its notes or tags; what is not given stays."""
    identity = _one_of(campaign, skin)
    name_field = "name" if campaign is not None else "title"
    values = {name_field: name, "remark": notes, "tags": None if tags is None else tags.split(",")}
    fields = {field: value for field, value in values.items() if value is not None}
    if not fields:
        raise UnderskinError("give at least one of --name, --notes and --tags")
    with connect(url, key) as client:
        document = _resource(client, campaign).annotate(identity, **fields)
    remarks = [f"tags: {', '.join(document['tags'])}"] if document["tags"] else []
    remarks += [f"notes: {document['remark']}"] if document["remark"] else []
    called = f"{_noun(campaign, skin)} is called {document[name_field] or document['id']}"
    _say(document, "; ".join([called, *remarks]), json)


def discard(
    reason: Annotated[str, typer.Option(help="Why; kept with it.")],
    campaign: OfCampaign = None,
    skin: OfSkin = None,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Put a trial campaign that nothing builds on, or a skin without campaigns in use, into no list any more."""
    identity = _one_of(campaign, skin)
    with connect(url, key) as client:
        document = _resource(client, campaign).discard(identity, reason)
    _say(document, f"{_noun(campaign, skin)} is discarded; it can still be read, and that can be undone", json)


def changes(
    campaign: OfCampaign = None,
    skin: OfSkin = None,
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """What was changed of a campaign or of a skin itself, the latest first, and what can be undone."""
    identity = _one_of(campaign, skin)
    with connect(url, key) as client:
        entries = _resource(client, campaign).changes(identity)
    if json:
        write_json(entries)
        return
    headings = ("id", "time (UTC)", "what", "by", "why", "undo")
    write_rows(headings, map(_row, entries))


def undo(
    change: Annotated[str, typer.Argument(help="Id of the change; `underskin changes` lists them.")],
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Take a change back, as long as nothing builds on it; both stay on record."""
    with connect(url, key) as client:
        document = client.undo(change)
    _say(document, f"undone of {_noun(document['campaign_id'], document['skin_id'])}: {document['statement']}", json)


def _row(change: Document) -> tuple[str, ...]:
    undoing = "can be undone" if change["may_be_undone"] else "undone" if change["undone"] else "-"
    by, why = change["made_from"] or "-", change["reason"] or "-"
    return change["id"], moment(change["at"]), change["statement"], by, why, undoing


def _resource(client: "Client", campaign: str | None) -> "Campaigns | Skins":
    return client.skins if campaign is None else client.campaigns


def _noun(campaign: str | None, skin: str | None) -> str:
    return f"skin {skin}" if campaign is None else f"campaign {campaign}"


def _one_of(campaign: str | None, skin: str | None) -> str:
    """The id of the one that is given."""
    given = [identity for identity in (campaign, skin) if identity is not None]
    if len(given) != 1:
        raise UnderskinError("give one of --campaign ID and --skin ID")
    return given[0]

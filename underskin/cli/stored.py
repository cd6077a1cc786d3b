"""The commands that read what the service keeps, and its answers: as JSON for scripts, as tables for people."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

import typer

from underskin.cli.store import LOCAL, KeyOption, Url, connect
from underskin.findings.formatting import significant

Document = Mapping[str, Any]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON, with the fields of the HTTP interface.")]


def write_json(document: Any) -> None:
    """Write a document, or a list of documents."""
    typer.echo(json.dumps(document, default=dict, ensure_ascii=False, indent=1))


def write_rows(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table; the last column takes the remaining width.

    Raises ValueError where a row has more or fewer cells than there are headings.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from underskin.cli.columns import PIPED_WIDTH

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in headings:
        table.add_column(heading, overflow="fold", no_wrap=heading in ("id", "campaign"))
    for row in rows:
        if len(row) != len(headings):
            raise ValueError(f"{len(row)} cells under {len(headings)} headings: {row}")
        table.add_row(*map(Text, row))
    Console(highlight=False, width=None if sys.stdout.isatty() else PIPED_WIDTH).print(table)


def moment(time: str | None) -> str:
    """A time of the interface, to the minute, in UTC."""
    return "-" if time is None else time[:16].replace("T", " ")


def state_of(campaign: Document) -> str:
    """Whether results use a campaign and, where not, why."""
    if campaign["state"] == "withdrawn":
        if campaign["discarded_at"] is not None:
            return f"discarded: {campaign['withdraw_reason']}"
        return f"withdrawn: {campaign['withdraw_reason']}"
    if campaign["state"] == "corrected":
        return f"corrected by {campaign['corrected_by']}"
    return "in use"


State = Literal["current", "corrected", "withdrawn", "all"]


def campaigns(
    campaign: Annotated[str | None, typer.Argument(help="One campaign, with its recordings and diagnoses.")] = None,
    skin: Annotated[str | None, typer.Option(help="Only those of this skin and of those joined to it.")] = None,
    state: Annotated[State, typer.Option(help="Only those in this state.")] = "current",
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Campaigns that the service keeps, the latest arrival first, or one of them with its recordings."""
    with connect(url, key) as client:
        if campaign is not None:
            detail = client.campaigns.get(campaign)
            diagnoses = list(client.diagnoses.all(campaign=campaign))
            if json:
                write_json({**detail, "diagnoses": diagnoses})
            else:
                _show(detail, diagnoses)
            return
        if skin is not None:
            client.skins.get(skin)  # one that does not exist has no campaigns either, and is a slip
        entries = list(client.campaigns.all(skin=skin, state=state))
    if json:
        write_json(entries)
    else:
        write_rows(("campaign", "skin", "name", "recorded (UTC)", "recordings", "state"), map(_row, entries))


def skins(json: AsJson = False, url: Url = LOCAL, key: KeyOption = None) -> None:
    """Skins that the service keeps, by id."""
    with connect(url, key) as client:
        records = list(client.skins.all())
    if json:
        write_json(records)
    else:
        rows = ((skin["id"], moment(skin["created_at"]), str(skin["campaigns"])) for skin in records)
        write_rows(("skin", "since (UTC)", "campaigns"), rows)


def history(
    skin: Annotated[str, typer.Argument(help="The skin.")],
    model: Annotated[
        Literal["paper", "adopted"], typer.Option(help="`adopted`: d33 by the model in force of the skin.")
    ] = "paper",
    json: AsJson = False,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """The d33 of each sensor of a skin over time, the array's change and each sensor's beside it; what is left out."""
    with connect(url, key) as client:
        document = client.skins.history(skin, model=model)
    if json:
        write_json(document)
        return
    points = [(sensor["sensor"], point) for sensor in document["sensors"] for point in sensor["points"]]
    headings = ("sensor", "time (UTC)", "time is", "d33 pC/N", "±", "campaign")
    write_rows(headings, (_point(sensor, point) for sensor, point in points))
    array = document["array"]
    if array is not None:
        typer.echo(f"{array['statement']}.")
    has_departures = any(sensor["departure"] is not None for sensor in document["sensors"])
    describe = _departure if has_departures else _trend
    heading = "relative to array" if has_departures else "trend"
    write_rows(("sensor", heading), ((sensor["sensor"], describe(sensor)) for sensor in document["sensors"]))
    for omission in document["left_out_campaigns"]:
        typer.echo(f"left out: campaign {omission['campaign_id']}: {omission['reason']}")
    for omission in document["left_out_points"]:
        typer.echo(f"left out: sensor {omission['sensor']} of campaign {omission['campaign_id']}: {omission['reason']}")
    for omission in document["left_out_recordings"]:
        typer.echo(
            f"left out: recording {omission['recording']} of campaign {omission['campaign_id']}: {omission['reason']}"
        )


def _row(campaign: Document) -> tuple[str, ...]:
    excluded = f" − {campaign['excluded']}" if campaign["excluded"] else ""
    recorded = moment(campaign["recorded_at"])
    if campaign["recorded_at"] is None:
        recorded = f"received {moment(campaign['received_at'])}"
    return (
        campaign["id"],
        campaign["skin_id"],
        campaign["name"],
        recorded,
        f"{campaign['recordings']}{excluded}",
        state_of(campaign),
    )


def _show(detail: Document, diagnoses: Sequence[Document]) -> None:
    write_rows(("campaign", "skin", "name", "recorded (UTC)", "recordings", "state"), [_row(detail)])
    write_rows(
        ("recording", "kind", "sensor", "recorded (UTC)", "state"),
        (
            (
                recording["id"],
                recording["kind"],
                recording["sensor"] or "-",
                moment(recording["recorded_at"]),
                "in use" if recording["excluded_at"] is None else f"excluded: {recording['exclude_reason']}",
            )
            for recording in detail["entries"]
        ),
    )
    if diagnoses:
        write_rows(
            ("diagnosis", "asked (UTC)", "state", "verdict"),
            (
                (diagnosis["id"], moment(diagnosis["asked_at"]), diagnosis["state"], diagnosis["verdict"] or "-")
                for diagnosis in diagnoses
            ),
        )
    for recording in detail["refused"]:
        for error in recording["errors"]:
            typer.echo(f"refused: {recording['id']} {error['field']}: {error['allowed']}")
    for note in detail["notes"]:
        typer.echo(note)


def _point(sensor: str, point: Document) -> tuple[str, ...]:
    value, uncertainty = point["d33_pc_per_n"], point["d33_uncertainty_pc_per_n"]
    return (
        sensor,
        moment(point["time"]),
        point["time_is"],
        significant(value, 4),
        significant(uncertainty, 2),
        point["campaign_id"],
    )


def _departure(sensor: Document) -> str:
    departure = sensor["departure"]
    if departure is None:
        return "none: it answers in one campaign at most"
    value, low, high = (departure[name] for name in ("change_percent", "change_low_percent", "change_high_percent"))
    weight = "departs" if departure["significant"] else "as the array"
    return f"{value:+z.1f} % ({low:+z.1f} to {high:+z.1f}), {weight}"


def _trend(sensor: Document) -> str:
    trend = sensor["trend"]
    if trend is None:
        return f"none: {sensor['no_trend']}"
    slope, uncertainty = trend["slope_pc_per_n_per_year"], trend["slope_uncertainty_pc_per_n_per_year"]
    weight = "significant" if trend["significant"] else "not significant"
    return f"{significant(slope, 2)} ± {significant(uncertainty, 1)} pC/N a year, {weight}"

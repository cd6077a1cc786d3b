"""`underskin d33 FILE...`: the d33 of an array, and the elastomer's modulus, from files of recordings; no server."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.errors import InvalidInput, UnderskinError

if TYPE_CHECKING:
    from underskin.campaign_table import Told
    from underskin.recordings.rig_description import RigDescription
    from underskin.surrogate import SigmaTable

_BandHz = tuple[float, float]

Files = Annotated[
    list[Path] | None, typer.Argument(help="Campaigns, or files as instruments write them; each is inverted by itself.")
]
Rig = Annotated[Path | None, typer.Option(help="Rig description, for files that hold channels.")]
Band = Annotated[
    str | None, typer.Option(metavar="LOW,HIGH", help="Average FILE from LOW to HIGH [Hz], not over its flat zone.")
]
Figures = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Write the figures of each FILE into DIR, as FILE.html.")
]


def refuse(options: Sequence[str], why: str) -> None:
    """Raises UnderskinError where there are any."""
    if options:
        raise UnderskinError(f"{', '.join(options)} {why}")


def invert_files(files: Sequence[Path], rig: Path | None, band: str | None, figures: Path | None, as_csv: bool) -> None:
    """Print what each file tells; exit status 2 where one cannot be read or tells nothing, the others printed."""
    from rich.console import Console
    from rich.progress import Progress

    band_hz = None if band is None else _band(band)
    described = None if rig is None else _described(rig)
    pages = {} if figures is None else _pages(files, figures)
    from underskin import campaign_table
    from underskin.surrogate import load_table

    table = load_table()
    known: list[Told] = []
    # What is told comes after the bar, which would take it from a pipe.
    console = Console(stderr=True)
    with Progress(console=console, redirect_stdout=False, disable=not console.is_terminal) as progress:
        for file in progress.track(files, description="inverting"):
            try:
                told = _told(file, described, table, band_hz)
                _write_page(told, pages.get(file))
                known.append(told)
            except (UnderskinError, OSError) as error:
                line = str(error) if str(file) in str(error) else f"{file}: {error}"
                console.print(f"underskin: {line}", markup=False, highlight=False, soft_wrap=True)
    (campaign_table.write_csv if as_csv else campaign_table.write_tables)(known)
    if not all(told.is_of_use for told in known) or len(known) < len(files):
        raise typer.Exit(2)


def _told(file: Path, rig: "RigDescription | None", table: "SigmaTable", band_hz: _BandHz | None) -> "Told":
    """What a file tells; raises FileError or InvalidInput where it cannot be read."""
    from underskin.campaign_table import Told
    from underskin.inversion import Inversion, invert
    from underskin.recordings import elastomer, read_file

    reading = read_file(file, str(file), rig)
    found: Inversion | InvalidInput
    try:
        found = invert(reading.campaign, table, band_hz)
    except InvalidInput as error:
        found = error
    return Told(file, reading, found, elastomer.of_campaign(reading.campaign))


def _described(rig: Path) -> "RigDescription":
    from underskin.recordings import rig_description

    try:
        return rig_description.parse(rig.read_bytes(), str(rig))
    except OSError as error:
        raise UnderskinError(f"{rig}: cannot be opened: {error.strerror}") from error


def _band(text: str) -> _BandHz:
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        low = high = 0.0
    if not 0 < low < high:
        raise InvalidInput("band", text, "must be two frequencies in Hz, LOW,HIGH, the lower one first")
    return low, high


def _pages(files: Iterable[Path], folder: Path) -> dict[Path, Path]:
    """Where the figures of each file go; two files of one name would write over each other (InvalidInput)."""
    pages: dict[Path, Path] = {}
    for file in files:
        page = folder / f"{file.name}.html"
        if page in pages.values():
            raise InvalidInput("figures", str(page), f"would hold two files' figures; {file} needs a run of its own")
        pages[file] = page
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("figures", str(folder), f"must be a folder to write into: {error.strerror}") from error
    return pages


def _write_page(told: "Told", page: Path | None) -> None:
    from underskin.inversion import Inversion

    if page is None or not isinstance(told.found, Inversion):
        return
    from underskin import campaign_figures

    campaign = told.reading.campaign
    page.write_text(campaign_figures.page(campaign, told.found), encoding="utf-8")

"""`underskin d33 FILE...`: the d33 of an array, and the elastomer's modulus, from files of recordings; no server."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from underskin.errors import InvalidInput, UnderskinError

if TYPE_CHECKING:
    from rich.console import Console

    from underskin.cli.campaign_table import Told
    from underskin.recordings.reading import Reading
    from underskin.recordings.rig_description import RigDescription
    from underskin.surrogate.sigma_table import SigmaTable

_BandHz = tuple[float, float]

Files = Annotated[
    list[Path] | None, typer.Argument(help="Campaigns, or files as instruments write them; each is inverted by itself.")
]
Together = Annotated[
    str | None, typer.Option(metavar="NAME", help="Join the FILEs, all of one skin, into one campaign called NAME.")
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


class _Complaints:
    """What is wrong with files, printed beside the bar, and how many they are."""

    def __init__(self, console: "Console") -> None:
        self.count = 0
        self._console = console

    @contextmanager
    def about(self, name: str) -> Iterator[None]:
        """Turns an error of the block into a line."""
        try:
            yield
        except (UnderskinError, OSError) as error:
            self.count += 1
            line = str(error) if name in str(error) else f"{name}: {error}"
            self._console.print(f"underskin: {line}", markup=False, highlight=False, soft_wrap=True)


def invert_files(
    files: Sequence[Path], rig: Path | None, band: str | None, figures: Path | None, together: str | None, as_csv: bool
) -> None:
    """Print what each file tells, or all `together`; exit status 2 where one cannot be read or nothing is told.

    Raises UnderskinError where files that go together are not of one skin.
    """
    from rich.console import Console
    from rich.progress import Progress

    from underskin.recordings import validation

    if together is not None:
        validation.name("together", together, False)
    band_hz = None if band is None else _band(band)
    described = None if rig is None else _described(rig)
    named = [(str(file), file.name) for file in files] if together is None else [(together, together.replace("/", "-"))]
    pages = {} if figures is None else _pages(named, figures)
    from underskin.cli import campaign_table
    from underskin.surrogate.sigma_table import load_table

    table = load_table()
    known: list[Told] = []
    # What is told comes after the bar, which would take it from a pipe.
    console = Console(stderr=True)
    complaints = _Complaints(console)
    with Progress(console=console, redirect_stdout=False, disable=not console.is_terminal) as progress:
        readings = _readings(progress.track(files, description="inverting"), described, complaints)
        for name, reading in readings if together is None else _joined(together, list(readings)):
            with complaints.about(name):
                told = _told(name, reading, table, band_hz)
                _write_page(told, pages.get(name))
                known.append(told)
    (campaign_table.write_csv if as_csv else campaign_table.write_tables)(known)
    if not all(told.is_of_use for told in known) or complaints.count:
        raise typer.Exit(2)


def _readings(
    files: Iterable[Path], rig: "RigDescription | None", complaints: _Complaints
) -> "Iterator[tuple[str, Reading]]":
    """Each file that can be read, by its name."""
    from underskin.recordings import read_file

    for file in files:
        with complaints.about(str(file)):
            reading = read_file(file, str(file), rig)
            yield str(file), reading


def _joined(name: str, readings: "Sequence[tuple[str, Reading]]") -> "list[tuple[str, Reading]]":
    """All of them as one; none where there is none."""
    from underskin.recordings import join

    return [(name, join(name, readings))] if readings else []


def _told(name: str, reading: "Reading", table: "SigmaTable", band_hz: _BandHz | None) -> "Told":
    """What a campaign tells."""
    from underskin.cli.campaign_table import Told
    from underskin.inversion.invert import Inversion, invert
    from underskin.recordings import elastomer

    found: Inversion | InvalidInput
    try:
        found = invert(reading.campaign, table, band_hz)
    except InvalidInput as error:
        found = error
    return Told(name, reading, found, elastomer.of_campaign(reading.campaign))


def _described(rig: Path) -> "RigDescription":
    from underskin.recordings import rig_description

    try:
        return rig_description.parse(rig.read_bytes(), str(rig))
    except InvalidInput as error:
        raise UnderskinError(f"{rig}: {error}") from error
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


def _pages(named: Iterable[tuple[str, str]], folder: Path) -> dict[str, Path]:
    """Where the figures of each go, by its name; two pages of one name would be one page (InvalidInput)."""
    pages: dict[str, Path] = {}
    for name, short in named:
        page = folder / f"{short}.html"
        if page in pages.values():
            raise InvalidInput("figures", str(page), f"would hold two files' figures; {name} needs a run of its own")
        pages[name] = page
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("figures", str(folder), f"must be a folder to write into: {error.strerror}") from error
    return pages


def _write_page(told: "Told", page: Path | None) -> None:
    from underskin.inversion.invert import Inversion

    if page is None or not isinstance(told.found, Inversion):
        return
    from underskin.figures import campaign_figures

    campaign = told.reading.campaign
    page.write_text(campaign_figures.page(campaign, told.found), encoding="utf-8")

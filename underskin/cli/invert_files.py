"""`underskin d33 FILE...`: the d33 of an array, and the elastomer's modulus, from files of recordings; no server."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import Progress

from underskin.cli.campaign_table import InvertedFile, write_csv, write_tables
from underskin.cli.rigs import rig_description_in
from underskin.errors import FileError, InvalidInput, TableError, UnderskinError, not_unique, wrong_type
from underskin.findings.formatting import significant
from underskin.inversion import elastomer
from underskin.inversion.invert import Inversion, invert
from underskin.inversion.other_contact import array_d33_by_other
from underskin.prediction.other_contact import OTHER, WORDS
from underskin.recordings import Reading, join, read_file, validation
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.rig_description import RigDescription
from underskin.surrogate.contact_model import ContactName
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.surrogate.solved_contact import contact_model
from underskin.units import to_lab

_BandHz = tuple[float, float]


class _FileErrors:
    """Prints errors of files beside the progress bar, and counts them."""

    def __init__(self, console: Console) -> None:
        self.count = 0
        self._console = console

    @contextmanager
    def about(self, name: str) -> Iterator[None]:
        """Print an error of the block as one line."""
        try:
            yield
        except (UnderskinError, OSError) as error:
            self.count += 1
            line = str(error) if isinstance(error, FileError) else f"{name}: {error}"
            self._console.print(f"underskin: {line}", markup=False, highlight=False, soft_wrap=True)


def invert_files(
    files: Sequence[Path],
    rig: Path | None,
    estimator: Estimator | None,
    band: str | None,
    figures: Path | None,
    together: str | None,
    as_csv: bool,
    contact: ContactName,
) -> None:
    """Print d33 and moduli of each file, or of all `together`; exit status 2 where one is unreadable or gives neither.

    Raises UnderskinError where files that go together are not of one skin.
    """
    if together is not None:
        validation.name("together", together, False)
    band_hz = None if band is None else _band(band)
    description = None if rig is None else rig_description_in(rig)
    batches = (
        [(str(file), file.name) for file in files] if together is None else [(together, together.replace("/", "-"))]
    )
    pages = {} if figures is None else _pages(batches, figures)
    table = load_table()
    inverted: list[InvertedFile] = []
    # Results are written after the bar, which would take them from a pipe.
    console = Console(stderr=True)
    errors = _FileErrors(console)
    with Progress(console=console, redirect_stdout=False, disable=not console.is_terminal) as progress:
        readings: Iterable[tuple[str, Reading]] = _readings(
            progress.track(files, description="inverting"), description, estimator, errors
        )
        if together is not None and (every := list(readings)):
            readings = [(together, join(together, every))]
        for name, reading in readings:
            with errors.about(name):
                result = _inverted(name, reading, table, contact, band_hz)
                _write_page(result, pages.get(name))
                inverted.append(result)
    (write_csv if as_csv else write_tables)(inverted)
    if not all(result.is_of_use for result in inverted) or errors.count:
        raise typer.Exit(2)


def _readings(
    files: Iterable[Path], rig: RigDescription | None, estimator: Estimator | None, errors: _FileErrors
) -> Iterator[tuple[str, Reading]]:
    """Each file that can be read, by its name."""
    for file in files:
        with errors.about(str(file)):
            reading = read_file(file, str(file), rig).with_estimator(estimator)
            yield str(file), reading


def _inverted(
    name: str, reading: Reading, table: SigmaTable, contact: ContactName, band_hz: _BandHz | None
) -> InvertedFile:
    """The inversion of a campaign, or the reason why there is none, and its moduli."""
    inversion: Inversion | InvalidInput
    other = ""
    try:
        inversion = invert(reading.campaign, contact_model(table, contact), band_hz)
        other = _by_other_contact(reading, table, contact, band_hz, inversion)
    except InvalidInput as error:
        inversion = error
    return InvertedFile(name, reading, inversion, elastomer.of_campaign(reading.campaign), other)


def _by_other_contact(
    reading: Reading, table: SigmaTable, contact: ContactName, band_hz: _BandHz | None, inversion: Inversion
) -> str:
    """d33 of the array by it, in words; empty where it is nearly the same."""
    try:
        other = array_d33_by_other(reading.campaign, table, band_hz, inversion, contact)
    except TableError as error:
        return f"d33 by the other contact is not known: {error}"
    if other is None:
        return ""
    value = significant(float(to_lab("d33_pc_per_n", other.value)), 4)
    return f"d33 of the array {WORDS[OTHER[contact]]}: {value} pC/N"


def _band(text: str) -> _BandHz:
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        low = high = 0.0
    if not 0 < low < high:
        raise wrong_type("band", text, "must be two frequencies in Hz, LOW,HIGH, the lower one first")
    return low, high


def _pages(batches: Iterable[tuple[str, str]], folder: Path) -> dict[str, Path]:
    """The page of each file's figures, by its name; raises InvalidInput where two would have the same page."""
    pages: dict[str, Path] = {}
    for name, short in batches:
        page = folder / f"{short}.html"
        if page in pages.values():
            raise not_unique("figures", str(page), f"would hold two files' figures; {name} needs a run of its own")
        pages[name] = page
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("figures", str(folder), f"must be a folder to write into: {error.strerror}") from error
    return pages


def _write_page(result: InvertedFile, page: Path | None) -> None:
    if page is None or not isinstance(result.inversion, Inversion):
        return
    from underskin.figures import campaign_figures

    campaign = result.reading.campaign
    page.write_text(campaign_figures.page(campaign, result.inversion), encoding="utf-8")

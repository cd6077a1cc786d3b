"""The command `d33` for files: the d33 of an array and the elastomer's modulus from recordings, without a server.

Results are written as tables, or as CSV.
"""

import csv
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from underskin.cli.columns import PIPED_WIDTH
from underskin.cli.rigs import reading_notes, rig_description_in
from underskin.errors import InvalidInput, TableError, UnderskinError, not_unique, of_file, wrong_type
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits, left_out_lines, significant
from underskin.inversion import elastomer
from underskin.inversion.elastomer import RecordingModulus
from underskin.inversion.invert import Inversion, array_d33_by_other, invert
from underskin.prediction.answers import OTHER, WORDS
from underskin.recordings import plausibility, validation
from underskin.recordings.block_modulus import CompressionModulus
from underskin.recordings.campaign import Campaign, CompressionRecording, FrfRecording
from underskin.recordings.curve_course import fall_while_held
from underskin.recordings.curve_preparation import prepared
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.reading import Reading, join, read_file
from underskin.recordings.rig_description import RigDescription
from underskin.surrogate.sigma_table import ContactName, SigmaTable, load_table
from underskin.surrogate.solved_contact import contact_model
from underskin.units import to_lab

_HEADER = (
    "file", "level", "sensor", "indenter_radius_mm", "preload_n", "recordings",
    "d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33_low_pc_per_n", "d33_high_pc_per_n", "flags",
)  # fmt: skip


_LEAST_ERROR = 1e-3  # of E: a size of the sample is known to no more than that
_TO_QUOTE = "before you quote d33: it assumes the paper's model, and `underskin diagnose` tests that"


@dataclass(frozen=True)
class InvertedFile:
    """An inverted file, or several as one campaign: the reading, its d33 or the reason for none, and its moduli."""

    file: str
    reading: Reading
    inversion: Inversion | InvalidInput
    moduli: Sequence[RecordingModulus]
    by_other_contact: str = ""  # d33 of the array by it, in words, where it differs

    @property
    def title(self) -> str:
        """The name of the campaign, and the file that it is in."""
        name = self.reading.campaign.name
        return name if name == self.file else f"{name} ({self.file})"

    @property
    def is_of_use(self) -> bool:
        """Whether the inversion gave d33 or a modulus."""
        measured = any(not isinstance(modulus.result, InvalidInput) for modulus in self.moduli)
        return isinstance(self.inversion, Inversion) or measured

    @property
    def notes(self) -> list[str]:
        """Assumptions in reading, findings, and each recording or sensor that is left out."""
        notes = reading_notes(self.reading)
        notes += [self.by_other_contact] if self.by_other_contact else []
        campaign = self.reading.campaign
        findings = (
            self.inversion.findings if isinstance(self.inversion, Inversion) else plausibility.at_reading(campaign)
        )
        notes += [f"look at: {finding.sentence}" for finding in findings]
        if not isinstance(self.inversion, Inversion) and not self.moduli:
            count = 0 if campaign.recordings else len(self.reading.problems)
            why = f"none of the {count} recordings can be used" if count else self.inversion
            notes.append(f"no d33: {why}")
        refused = [(problem.recording, problem.as_error(problem.field)) for problem in self.reading.problems]
        refused += [
            (modulus.recording, modulus.result) for modulus in self.moduli if isinstance(modulus.result, InvalidInput)
        ]
        notes += left_out_lines((recording, str(why)) for recording, why in refused)
        if isinstance(self.inversion, Inversion):
            notes.append(_TO_QUOTE)
            omitted = self.inversion.left_out
            of_recordings = [part for part in omitted if isinstance(part, Finding) and part.recording]
            notes += left_out_lines((part.recording, part.statement) for part in of_recordings)
            notes += [f"left out: {part.sentence}" for part in omitted if part not in of_recordings]
        notes += [words for words in (self._of_hold, self._of_frame, self._of_platens) if words]
        return notes

    @property
    def _of_hold(self) -> str:
        """What E leaves out of a relaxation that a hold shows; empty where that is below its uncertainty."""
        falls = []
        results = {modulus.recording: modulus.result for modulus in self.moduli}
        for curve in prepared(self.reading.campaign).campaign.curves:
            result, fall = results[curve.id], fall_while_held(curve)
            if not isinstance(result, InvalidInput) and fall > result.uncertainty / result.modulus:
                falls.append(100 * fall)
        if not falls:
            return ""
        return (
            f"before you quote E: the force falls by up to {in_digits(max(falls), 2)} % while the displacement is "
            "held: this E lies between the instantaneous and the relaxed one, depending on the speed of the press; "
            "diagnose gives both"
        )

    @property
    def _of_frame(self) -> str:
        """What the E of cylinders assumes of their machine; empty without any.

        A frame of stiffness K in series with a block whose reading has the stiffness k = E A/h lowers E by the share
        k/K, which is that of the uncertainty at K = k E/u.
        """
        softest_n_per_mm = []
        results = {modulus.recording: modulus.result for modulus in self.moduli}
        for block in self.reading.campaign.of(CompressionRecording):
            result = results[block.id]
            if isinstance(result, CompressionModulus):
                e_mpa, sd_mpa = to_lab("youngs_modulus_mpa", [result.modulus, result.uncertainty]).tolist()
                area_mm2 = math.pi / 4 * block.sample_diameter_mm**2
                stiffness = e_mpa * area_mm2 / block.sample_height_mm
                softest_n_per_mm.append(stiffness * e_mpa / max(sd_mpa, _LEAST_ERROR * e_mpa))
        if not softest_n_per_mm:
            return ""
        return (
            "before you quote E: it takes the displacement for the sample's alone, and a machine softer than "
            f"{in_digits(max(softest_n_per_mm), 2)} N/mm lowers it by more than its ± (stiffness_n_per_mm of a rig "
            "description takes that off)"
        )

    @property
    def _of_platens(self) -> str:
        """What the E of pressed cylinders assumes of their ends; empty where that is below its uncertainty.

        Platens that hold them raise it by 2 S², S = D/4H (Gent & Lindley, Proc. Inst. Mech. Eng. 173 (1959) 111).
        """
        raised = []
        results = {modulus.recording: modulus.result for modulus in self.moduli}
        for block in self.reading.campaign.of(CompressionRecording):
            result, share = results[block.id], 0.125 * (block.sample_diameter_mm / block.sample_height_mm) ** 2
            if not isinstance(result, CompressionModulus) or not result.is_pressed:
                continue
            if share > result.uncertainty / result.modulus:
                raised.append(100 * share)
        if not raised:
            return ""
        return (
            "before you quote E: it takes the platens for smooth, and ends that they hold, dry or bonded, raise it by "
            f"up to {in_digits(max(raised), 2)} % (1 + 2 S², S = diameter/4 heights): oil them, or "
            "press samples of two heights, which diagnose tells apart"
        )


def write_tables(results: Iterable[InvertedFile]) -> None:
    """Each file's array, sensors and elastomer, omissions, and findings."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else PIPED_WIDTH)
    for result in results:
        console.print(Text(result.title, style="bold"))
        if isinstance(result.inversion, Inversion):
            console.print(_array(result.inversion, _estimators(result.reading.campaign)))
            console.print(_sensors(result.inversion))
        if any(not isinstance(modulus.result, InvalidInput) for modulus in result.moduli):
            console.print(_elastomer(result.moduli))
        for note in result.notes:
            console.print(Text(note), soft_wrap=True)
        console.print()


def write_csv(results: Iterable[InvertedFile]) -> None:
    """d33 in rows: of the array, with the skin's tolerances and without, of each sensor, and of each sensor × indenter
    × preload.

    Findings and omissions go to standard error.
    """
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(_HEADER)
    for result in results:
        if isinstance(result.inversion, Inversion):
            writer.writerows([result.file, *row] for row in _rows(result.inversion))
        for note in result.notes:
            print(f"underskin: {result.file}: {note}", file=sys.stderr)


def _rows(inversion: Inversion) -> list[list[str]]:
    rows, cells = [], inversion.cells
    for level, d33 in (("array", inversion.absolute_d33), ("array_relative", inversion.campaign_d33)):
        if d33 is not None:
            rows.append([level, "", "", "", "", *_full(d33.d33_rows()[0]), ""])
    for name, numbers in zip(inversion.sensor_ids, inversion.sensors.d33_rows(), strict=True):
        codes = " ".join(flag.code for flag in inversion.flags if flag.sensor == name)
        rows.append(["sensor", name, "", "", "", *_full(numbers), codes])
    radii = to_lab("indenter_radius_mm", cells.indenter_radius).round(9)
    conditions = zip(cells.sensor, radii.tolist(), cells.preload.tolist(), cells.recordings.tolist(), strict=True)
    for (sensor, radius, preload, count), numbers in zip(conditions, cells.d33.d33_rows(), strict=True):
        condition = [inversion.sensor_ids[sensor], repr(radius), repr(preload), str(count)]
        rows.append(["cell", *condition, *_full(numbers), ""])
    return rows


def _full(numbers: Sequence[float]) -> list[str]:
    return ["NaN" if number != number else repr(number) for number in numbers]


def _estimators(campaign: Campaign) -> str:
    """Those of FRFs that are estimated from time series, in words; empty without any."""
    series = [recording for recording in campaign.of(FrfRecording) if recording.sample_rate_hz is not None]
    return " and ".join(dict.fromkeys(recording.estimator or "H1" for recording in series))


def _array(inversion: Inversion, estimators: str) -> Table:
    listed = Table.grid(padding=(0, 2))
    zone = inversion.zone
    quantities = ("d33 of the array", inversion.absolute_d33), ("relative to others", inversion.campaign_d33)
    for name, d33 in quantities:
        if d33 is not None:
            value, uncertainty, low, high = d33.d33_rows()[0]
            ends = f"{significant(low, 4)} to {significant(high, 4)}"
            listed.add_row(name, f"{significant(value, 4)} ± {significant(uncertainty, 2)} pC/N (95 %: {ends})")
    for name, scatter, factor, unit in (
        ("spread over sensors", inversion.spread, 100.0, "%"),
        ("scatter of gain", inversion.gain, 100.0, "%"),
        ("scatter of position", inversion.position, 1e3, "mm"),
    ):
        if scatter is not None:
            value, low, high = (factor * float(part) for part in (scatter.value, scatter.low, scatter.high))
            listed.add_row(name, f"± {value:.2g} {unit} (95 %: {low:.2g} to {high:.2g})")
    listed.add_row("skin as declared", f"± {inversion.declared_percent:.2g} % of all d33, in the array's alone")
    chosen = f"{zone.low_hz:.4g} to {zone.high_hz:.4g} Hz, as asked"
    if estimators:
        listed.add_row("FRFs of series", f"by {estimators}; its bias by noise is taken off where it is known")
    listed.add_row("band", chosen if zone.chosen_by_user else zone.reason)
    return listed


def _sensors(inversion: Inversion) -> Table:
    table = _table("sensor", "d33\npC/N", "±\npC/N", "95 % from\npC/N", "to\npC/N", remark="remark")
    for name, numbers in zip(inversion.sensor_ids, inversion.sensors.d33_rows(), strict=True):
        reasons = "; ".join(flag.reason for flag in inversion.flags if flag.sensor == name)
        table.add_row(Text(name), *_short(numbers), Text(reasons))
    return table


def _elastomer(moduli: Sequence[RecordingModulus]) -> Table:
    table = _table("recording", "E\nMPa", "±\nMPa", remark="from")
    for modulus in moduli:
        if not isinstance(modulus.result, InvalidInput):
            numbers = to_lab("youngs_modulus_mpa", [modulus.result.modulus, modulus.result.uncertainty]).tolist()
            table.add_row(
                Text(modulus.recording), *_short(numbers), f"{modulus.result.load}: {modulus.result.statement}"
            )
    return table


def _table(first: str, *numbers: str, remark: str) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column(first, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right")
    table.add_column(remark, overflow="fold")
    return table


def _short(numbers: Sequence[float]) -> list[str]:
    """A value and its limits to four significant digits, the uncertainty, second, to two."""
    digits = (4, 2, 4, 4)
    return [
        "-" if number != number else significant(number, most) for number, most in zip(numbers, digits, strict=False)
    ]


_BandHz = tuple[float, float]


class _FileErrors:
    """Prints errors of files above the progress bar, and counts them."""

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
            self._console.print(f"underskin: {of_file(name, error)}", markup=False, highlight=False, soft_wrap=True)


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
    """Print d33 and moduli of each file, or of all `together`; exit status 2 for an unreadable file or one without
    result.

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
        if together is not None and (all_readings := list(readings)):
            readings = [(together, join(together, all_readings))]
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
    """Each readable file, with its name."""
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
        other = _by_other_contact(reading, table, contact, inversion)
    except InvalidInput as error:
        inversion = error
    return InvertedFile(name, reading, inversion, elastomer.of_campaign(reading.campaign), other)


def _by_other_contact(reading: Reading, table: SigmaTable, contact: ContactName, inversion: Inversion) -> str:
    """d33 of the array with the other contact model, in words; empty where it is nearly the same."""
    try:
        other = array_d33_by_other(reading.campaign, table, inversion, contact)
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

"""The commands `diagnose` and `plan`: what recordings and model disagree about, and which recordings would resolve it.

`diagnose` writes one report (`report/1`) per campaign, named like its input; each file is written completely or not
at all. It uses all cores, or a Dask cluster, one campaign per process, so that reports do not depend on the number
of processes. With `--together` campaigns of one skin, with `--fleet` skins of one batch, are diagnosed in one
report.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from underskin.cli.rigs import EstimatorOption, RigOption, read_by, reading_notes, rig_description_in
from underskin.cli.store import LOCAL, KeyOption, Url, connect
from underskin.errors import UnderskinError, of_file
from underskin.parallel import one_blas_thread, processes

if TYPE_CHECKING:
    from underskin.client.service_client import Client
    from underskin.recordings.reading import Reading
    from underskin.surrogate.sigma_table import SigmaTable


def refuse_overwriting(files: Sequence[Path], campaigns: Sequence[str], output_dir: Path) -> None:
    """Raise BadParameter where two reports would have one name, or a report would overwrite a campaign."""
    names = [*(file.stem for file in files), *campaigns]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        sources = [(file.stem, str(file)) for file in files] + [(name, f"--campaign {name}") for name in campaigns]
        clashing = " and ".join(source for name, source in sources if name == twice[0])
        problem = (
            f"reports are named like their campaigns: {clashing} would all become {twice[0]}.json. "
            "Rename files, or run once for each, with an --output-dir of its own"
        )
        raise typer.BadParameter(problem, param_hint="FILES")
    lost = [file for file in files if (output_dir / f"{file.stem}.json").resolve() == file.resolve()]
    if lost:
        raise typer.BadParameter(f"the report would overwrite {lost[0]}", param_hint="--output-dir")


def in_words(document: Mapping[str, Any]) -> str:
    """A report's headline with its verdict, and on the next line its statement."""
    from underskin.diagnosis.reporting.headline import first_and_rest

    first, _ = first_and_rest(document)
    return f"{first} ({document['verdict']}).\n{document['statement']}"


def write_report(document: dict[str, Any], path: Path) -> None:
    """Write a report as JSON; equal reports give equal bytes."""
    _write(json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False) + "\n", path)


def write_page(
    document: dict[str, Any], path: Path, figures: Mapping[str, Any] | None = None, recorded: str = ""
) -> None:
    """Write a report as a page, with the given figures and words on what was recorded."""
    from underskin.diagnosis.reporting.html_report import page

    _write(page(document, figures, recorded), path)


def _write(text: str, path: Path) -> None:
    partial = path.with_name(f".{path.name}.part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


_NAME = re.compile(r"\w[\w .-]*")


def of_several(
    files: Sequence[Path],
    read_file: "Callable[[Path], Reading]",
    without: Sequence[str],
    output_dir: Path,
    *,
    html: bool,
    together: str | None,
    fleet: str | None,
) -> None:
    """Write NAME.json, and NAME.html with `html`; `read_file` reads one file."""
    from rich.console import Console
    from rich.progress import Progress

    from underskin.diagnosis.diagnose import diagnose_fleet, diagnose_together

    target = output_dir / f"{_name(together, fleet)}.json"
    if any(file.resolve() == target.resolve() for file in files):
        raise typer.BadParameter(f"the report would overwrite {target}", param_hint="--together, --fleet")
    readings = []
    for file in files:
        try:
            readings.append(read_file(file))
        except UnderskinError as error:
            raise UnderskinError(of_file(str(file), error)) from error
    skin_ids = sorted({reading.campaign.skin.id for reading in readings if reading.campaign.skin.id is not None})
    if together is not None and len(skin_ids) > 1:
        allowed = f"the campaigns are of several skins (skin.id): {', '.join(skin_ids)}"
        raise typer.BadParameter(allowed, param_hint="--together")
    console = Console(stderr=True)
    with Progress(console=console) as progress:
        bar = progress.add_task("diagnosing", total=1.0)

        def show(share: float) -> None:
            progress.update(bar, completed=share)

        if together is not None:
            report = diagnose_together(readings, target.stem, without=without, progress=show)
        else:
            report = diagnose_fleet(_by_skin(readings), target.stem, without=without, progress=show)
        show(1.0)
    document = dict(report)
    write_report(document, target)
    if html:
        write_page(document, target.with_suffix(".html"))
    console.print(f"{target.stem}: {in_words(document)}", markup=False, highlight=False, soft_wrap=True)
    for file, reading in zip(files, readings, strict=True):
        for note in reading_notes(reading):
            console.print(f"{file}: {note}", markup=False, highlight=False, soft_wrap=True)


def _name(together: str | None, fleet: str | None) -> str:
    """The name of the report."""
    name = together if together is not None else fleet
    if name is None or (together is not None and fleet is not None):
        raise typer.BadParameter("one of --together and --fleet", param_hint="--fleet")
    if not _NAME.fullmatch(name):
        raise typer.BadParameter(
            f"{name!r}: letters, digits, spaces, points and hyphens", param_hint="--together, --fleet"
        )
    return name


def _by_skin(readings: Sequence["Reading"]) -> dict[str, list["Reading"]]:
    """The readings by skin.id, which each must have."""
    skins: dict[str, list[Reading]] = {}
    for reading in readings:
        skin = reading.campaign.skin.id
        if skin is None:
            raise typer.BadParameter(f"{reading.campaign.name} names no skin (skin.id)", param_hint="--fleet")
        skins.setdefault(skin, []).append(reading)
    return skins


FilesArgument = Annotated[
    list[Path] | None, typer.Argument(help="Campaigns (campaign/1, JSON, or any format that is read).")
]
_REPORTS = Path("diagnosis")

Workers = Annotated[int, typer.Option(min=0, help="Processes; 0 is one for each core.")]


@dataclass(frozen=True)
class _Outcome:
    """The outcome of one campaign: verdict and statement, or why there is no report."""

    source: str
    problem: str = ""
    answer: str = ""
    notes: tuple[str, ...] = ()  # assumptions in reading, and warnings


def add_commands(app: typer.Typer) -> None:
    """Add both commands."""
    app.command(no_args_is_help=True)(diagnose)
    app.command(no_args_is_help=True)(plan)


def diagnose(
    files: FilesArgument = None,
    rig: RigOption = None,
    estimator: EstimatorOption = None,
    output_dir: Annotated[Path, typer.Option(help="Folder for the reports; made where it does not exist.")] = _REPORTS,
    html: Annotated[bool, typer.Option("--html", help="Also write each report as a page with figures.")] = False,
    workers: Workers = 0,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask cluster, whose workers must find files and folder where they are here."),
    ] = None,
    campaign: Annotated[
        list[str] | None, typer.Option(help="Id of a campaign that the service keeps and diagnoses; repeatable.")
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(help="A mechanism to leave out of the catalogue: suppose that it is not that; repeatable."),
    ] = None,
    together: Annotated[
        str | None,
        typer.Option(help="Diagnose these campaigns of one skin together, in one report of this name."),
    ] = None,
    fleet: Annotated[
        str | None,
        typer.Option(help="Diagnose the skins of these campaigns (skin.id) as a fleet, in one report of this name."),
    ] = None,
    url: Url = LOCAL,
    key: KeyOption = None,
) -> None:
    """Where recordings and model disagree, and what physics the model left out: one report a campaign."""
    from rich.console import Console
    from rich.progress import Progress

    one_blas_thread()
    files, campaign = files or [], campaign or []
    several = together is not None or fleet is not None
    _check_inputs(files, campaign, output_dir, several=several)
    description = None if rig is None else rig_description_in(rig)
    if output_dir.exists() and not output_dir.is_dir():
        raise typer.BadParameter(f"{output_dir} is a file", param_hint="--output-dir")
    output_dir.mkdir(parents=True, exist_ok=True)
    if campaign and several:
        raise typer.BadParameter("takes files; of stored campaigns ask the service", param_hint="--together, --fleet")
    read_file = partial(read_by, rig=description, estimator=estimator)
    if several:
        of_several(files, read_file, without or [], output_dir, html=html, together=together, fleet=fleet)
        return
    # Absolute, since a cluster's workers have a working folder of their own
    work = partial(
        _diagnose_file, read_file=read_file, output_dir=output_dir.resolve(), html=html, without=without or []
    )
    failed = False
    console = Console(stderr=True)
    with Progress(console=console) as progress:
        bar = progress.add_task("diagnosing", total=len(files) + len(campaign))
        for outcomes in (
            _file_outcomes(files, work, workers or os.cpu_count() or 1, scheduler),
            _stored_outcomes(campaign, output_dir, html, without or [], url, key),
        ):
            for outcome in outcomes:
                progress.advance(bar)
                failed |= bool(outcome.problem)
                line = f"underskin: {outcome.problem}" if outcome.problem else f"{outcome.source}: {outcome.answer}"
                for message in (line, *(f"{outcome.source}: {note}" for note in outcome.notes)):
                    console.print(message, markup=False, highlight=False, soft_wrap=True)
    if output_dir == _REPORTS and any(output_dir.iterdir()):
        console.print(f"reports are in {output_dir}", markup=False, highlight=False)
    if failed:
        raise typer.Exit(2)


def _check_inputs(files: Sequence[Path], campaigns: Sequence[str], output_dir: Path, *, several: bool) -> None:
    """Raise BadParameter without inputs, and where a report would overwrite a file; `several`: one report of all."""
    if not files and not campaigns:
        raise typer.BadParameter("give files or --campaign", param_hint="FILES")
    if not several:
        refuse_overwriting(files, campaigns, output_dir)


def _file_outcomes(
    files: Sequence[Path], work: Callable[[Path], _Outcome], workers: int, scheduler: str | None
) -> Iterator[_Outcome]:
    if scheduler is None and (len(files) <= 1 or workers == 1):
        for file in files:
            yield work(file)
        return
    remaining = list(files)
    while remaining:
        for file, outcome in _pool_outcomes(remaining, work, min(workers, len(remaining)), scheduler):
            remaining.remove(file)
            yield outcome
        # A process that dies ends the pool: the files that may have caused it are diagnosed one by one
        suspects = remaining[:workers]
        for file in suspects:
            outcomes = dict(_pool_outcomes([file], work, 1, scheduler))
            remaining.remove(file)
            yield outcomes.get(file, _Outcome(str(file), f"{file}: the process that worked it out was killed; memory?"))


def _pool_outcomes(
    files: Sequence[Path], work: Callable[[Path], _Outcome], workers: int, scheduler: str | None
) -> Iterator[tuple[Path, _Outcome]]:
    """The outcomes of the files that were finished before any process died."""
    with _executor(workers, scheduler) as pool:
        pending: dict[Future[_Outcome], Path] = {
            pool.submit(work, file if scheduler is None else file.resolve()): file for file in files
        }
        for done in as_completed(pending):
            file = pending[done]
            try:
                yield file, done.result()
            except BrokenExecutor:
                continue
            except Exception as error:  # one failure must not stop the other campaigns
                yield file, _Outcome(str(file), f"{file}: {type(error).__name__}: {error}")


@contextmanager
def _executor(workers: int, scheduler: str | None) -> Iterator[Executor]:
    """Processes on this machine, or a Dask cluster through the same interface."""
    if scheduler is None:
        with processes(workers) as pool:
            yield pool
        return
    try:
        from distributed import Client as Cluster
    except ImportError as error:
        raise UnderskinError("--scheduler needs Dask: pip install 'underskin[cluster]'") from error

    try:
        cluster = Cluster(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise UnderskinError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with cluster, cluster.get_executor(pure=False) as pool:
        yield pool


def _diagnose_file(
    file: Path, *, read_file: "Callable[[Path], Reading]", output_dir: Path, html: bool, without: Sequence[str]
) -> _Outcome:
    """Read, diagnose and write one campaign."""
    from underskin.diagnosis.pipeline import diagnose as work_out
    from underskin.diagnosis.pipeline import with_refused
    from underskin.diagnosis.reporting.report import report

    try:
        reading = read_file(file)
        diagnosis = with_refused(work_out(reading.campaign, _table(), without=without), reading.problems)
    except UnderskinError as error:
        return _Outcome(str(file), of_file(str(file), error))
    document = report(diagnosis)
    write_report(document, output_dir / f"{file.stem}.json")
    if html:
        from underskin.diagnosis.reporting.figures import figures
        from underskin.diagnosis.reporting.html_report import recorded_in_words

        campaign = reading.campaign
        recorded = recorded_in_words(vars(campaign.skin), map(vars, campaign.recordings))
        write_page(document, output_dir / f"{file.stem}.html", figures(diagnosis, document), recorded)
    return _Outcome(str(file), "", in_words(document), tuple(reading_notes(reading)))


@cache
def _table() -> "SigmaTable":
    """The table, loaded once per process."""
    from underskin.surrogate.sigma_table import load_table

    return load_table()


def _stored_outcomes(
    campaigns: Sequence[str], output_dir: Path, html: bool, without: Sequence[str], url: str, key: str | None
) -> Iterator[_Outcome]:
    """Diagnoses of stored campaigns by the service; all are started before the first is awaited."""
    if not campaigns:
        return
    with connect(url, key) as client:
        diagnoses = [(campaign, _start(client, campaign, without)) for campaign in campaigns]
        for campaign, started in diagnoses:
            yield started if isinstance(started, _Outcome) else _fetched(client, campaign, started, output_dir, html)


def _start(client: "Client", campaign: str, without: Sequence[str]) -> str | _Outcome:
    """The id of the diagnosis, or an outcome where it cannot be started."""
    try:
        return client.diagnoses.start(campaign, without=without).id
    except UnderskinError as error:
        return _Outcome(campaign, f"{campaign}: {error}")


def _fetched(client: "Client", campaign: str, diagnosis: str, output_dir: Path, html: bool) -> _Outcome:
    """Await one diagnosis and write its report; its page has the one figure that a report holds."""
    try:
        finished = client.diagnoses.wait(diagnosis)
    except UnderskinError as error:
        return _Outcome(campaign, f"{campaign}: {error}")
    if finished.report is None:
        return _Outcome(campaign, f"{campaign}: {finished.state}: {finished.reason or 'no report'}")
    document = dict(finished.report)
    write_report(document, output_dir / f"{campaign}.json")
    if html:
        write_page(document, output_dir / f"{campaign}.html")
    return _Outcome(campaign, answer=in_words(document))


def plan(
    file: Annotated[Path, typer.Argument(help="A campaign.")],
    preload_n: Annotated[
        tuple[float, float] | None, typer.Option(help="Lowest and highest preload that the rig can hold [N].")
    ] = None,
    indenter_radius_mm: Annotated[list[float] | None, typer.Option(help="A sphere at hand [mm]; repeatable.")] = None,
    offset_mm: Annotated[
        list[float] | None,
        typer.Option(help="How far from the sensor's centre the sphere can be put [mm]; repeatable."),
    ] = None,
    dynamic_force_n: Annotated[
        list[float] | None, typer.Option(help="A dynamic force that the shaker can give [N]; repeatable.")
    ] = None,
    dwell_s: Annotated[list[float] | None, typer.Option(help="A time to hold the preload [s]; repeatable.")] = None,
    recordings: Annotated[int, typer.Option(min=1, help="Recordings at most.")] = 8,
) -> None:
    """The recordings that best separate what a campaign leaves confusable, and the chance that they do; JSON.

    What is left out is as in the campaign; if all is and that separates nothing, what most rigs can do is tried too.
    """
    one_blas_thread()
    from underskin.diagnosis.diagnose import diagnose as diagnosed
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.recordings import read_file

    campaign = read_file(file, file.name).campaign
    limits = RigLimits(
        preload_n=preload_n,
        indenter_radius_mm=indenter_radius_mm,
        dynamic_force_n=dynamic_force_n,
        offset_mm=offset_mm,
        dwell_s=dwell_s,
        recordings=recordings,
    )
    planned = diagnosed(campaign, limits=limits)["next_experiment"] or {}
    typer.echo(json.dumps(planned, ensure_ascii=False, indent=1))

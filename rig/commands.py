"""`underskin rig`: experiments on the virtual rig."""

import json
from pathlib import Path
from typing import Annotated

import typer
import yaml

from rig.effects import FRF
from rig.wide_tails import TAILS, USUAL

rig = typer.Typer(no_args_is_help=True, help="Try an experiment on a virtual rig before building it.")

OutputDir = Annotated[Path, typer.Option(help="Folder to write; made where it does not exist.")]


@rig.command()
def run(
    experiment: Annotated[Path, typer.Argument(help="The experiment's description (experiment/1), YAML or JSON.")],
    output_dir: OutputDir,
    tdms: Annotated[bool, typer.Option("--tdms", help="Also write raw recordings and their rig description.")] = False,
) -> None:
    """Carry out an experiment: campaign.json, truth.json, and raw recordings where asked for."""
    from rig.description import parse
    from rig.output import carry_out
    from rig.reading import document

    try:
        files = carry_out(parse(document(experiment)), output_dir, tdms=tdms)
    except (ValueError, OSError, yaml.YAMLError) as error:
        typer.echo(f"underskin rig: {experiment}: {' '.join(str(error).split())}", err=True)
        raise typer.Exit(2) from error
    for file in files:
        typer.echo(str(file))


@rig.command()
def draw(
    output_dir: OutputDir,
    count: Annotated[int, typer.Option(min=1, help="How many campaigns.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same campaigns.")] = 0,
    what: Annotated[
        str | None,
        typer.Option(
            help="none, single, pair or unknown: what each hides; of kind joint: compression or indentation beside "
            "FRFs, dates or skins; default: a mixture."
        ),
    ] = None,
    kind: Annotated[
        str, typer.Option(help="frf, indentation (raw curves), compression, or joint (NNNN-1.json, NNNN-2.json …).")
    ] = "frf",
    tails: Annotated[
        str, typer.Option(help="usual, or of kind frf wide: more scatter, fewer sensors, fainter and stronger effects.")
    ] = USUAL,
) -> None:
    """Random campaigns with hidden effects, to test a diagnosis on: campaigns/NNNN.json and truth.json."""
    from rig.drawn_campaign import HIDES, JOINT, documents_and_truth

    possible = TAILS if kind == FRF else (USUAL,)
    arguments = (
        ("--kind", kind, tuple(HIDES)),
        ("--what", what, (None, *HIDES.get(kind, ()))),
        ("--tails", tails, possible),
    )
    for option, value, allowed in arguments:
        if value not in allowed:
            names = ", ".join(name for name in allowed if name)
            raise typer.BadParameter(f"{value!r}: must be one of {names}", param_hint=option)
    folder = output_dir / "campaigns"
    folder.mkdir(parents=True, exist_ok=True)
    truths = {}
    for number in range(count):
        name = f"{number:04d}"
        documents, truths[name] = documents_and_truth(seed, number, kind, what, tails)
        for order, document in enumerate(documents, start=1):
            file = f"{name}-{order}.json" if kind == JOINT else f"{name}.json"
            (folder / file).write_text(json.dumps(document) + "\n", encoding="utf-8")
    (output_dir / "truth.json").write_text(json.dumps(truths, ensure_ascii=False) + "\n", encoding="utf-8")
    typer.echo(f"{count} campaigns in {folder}, what they hide in {output_dir / 'truth.json'}")

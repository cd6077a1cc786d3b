"""The figures of docs/proof.md; the same results give the same bytes."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proof.judge import Judged, shown
from proof.statistics import calibration, share

_STYLE = Path(__file__).parents[1] / "docs" / "figures.mplstyle"
SIZES = (0.0, 4.5, 8.0, 16.0, 32.0, 64.0, 128.0, np.inf)  # effect in units of noise; √20 is the threshold of visibility


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as SVG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
    return path


def calibration_and_size(judged: Sequence[Judged], path: Path) -> Path:
    """Stated probability against frequency of right answers, and accuracy against the effect's size."""
    with mpl.rc_context(fname=_STYLE):
        figure = Figure(figsize=(7.6, 3.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        _calibration(left, judged)
        _sizes(right, judged)
        return save(figure, path)


def _calibration(axes: Axes, judged: Sequence[Judged]) -> None:
    result = calibration([judgement.probability for judgement in judged], [judgement.right for judgement in judged])
    middle, value = np.array(result.stated), np.array(result.right)
    axes.plot([0, 1], [0, 1], "k:", linewidth=0.8)
    errors = np.maximum(
        [value - np.array(result.low), np.array(result.high) - value], 0
    )  # not negative, but for rounding
    axes.errorbar(middle, value, errors, fmt="o", capsize=3)
    for x, y, count in zip(middle, value, result.count, strict=True):
        axes.annotate(str(count), (x, y), textcoords="offset points", xytext=(5, -11), fontsize=7)
    axes.set(title="calibration, ten equal bins", xlabel="stated probability", ylabel="share that was right")


def _sizes(axes: Axes, judged: Sequence[Judged]) -> None:
    kinds = {"single": "o-", "pair": "s--", "unknown": "^:"}
    for offset, (kind, style) in enumerate(kinds.items()):
        places, shares = [], []
        for number, (low, high) in enumerate(pairwise(SIZES)):
            inside = [
                judgement.right for judgement in judged if judgement.kind == kind and low <= judgement.size < high
            ]
            if inside:
                places.append(number + 0.12 * (offset - 1))
                shares.append(share(inside))
        if shares:
            value = np.array([bin_share.value for bin_share in shares])
            low_end, high_end = np.array([bin_share.interval for bin_share in shares]).T
            errors = np.maximum([value - low_end, high_end - value], 0)
            axes.errorbar(places, value, errors, fmt=style, capsize=2, label=kind, markersize=4)
    names = [f"{low:g}–{high:g}" if np.isfinite(high) else f"> {low:g}" for low, high in pairwise(SIZES)]
    axes.set_xticks(range(len(names)), names, rotation=35)
    axes.set(
        title="exact set, against the effect's size",
        xlabel="√(χ² gained by the truth), units of noise",
        ylim=(-0.05, 1.05),
    )
    if axes.get_legend_handles_labels()[0]:  # none where nothing was hidden
        axes.legend()


def confusion(judged: Sequence[Judged], path: Path) -> Path:
    """Hidden against named effects, without pairs; what no report named has no column."""
    with mpl.rc_context({"axes.grid": False, "font.size": 6.5}, fname=_STYLE):
        rows = [judgement for judgement in judged if len(judgement.truth) < 2]
        truths = sorted({judgement.truth for judgement in rows}, key=lambda names: (len(names), names))
        answers = [
            *truths,
            *sorted({judgement.answer for judgement in rows} - set(truths), key=lambda names: (len(names), names)),
        ]
        counts = np.zeros((len(truths), len(answers)), dtype=int)
        for judgement in rows:
            counts[truths.index(judgement.truth), answers.index(judgement.answer)] += 1
        figure = Figure(figsize=(1.9 + 0.24 * len(answers), 2.4 + 0.2 * len(truths)), layout="constrained")
        axes = figure.subplots()
        share_of_row = counts / counts.sum(axis=1, keepdims=True)
        axes.imshow(share_of_row, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        for row, column in np.argwhere(counts):
            colour = "white" if share_of_row[row, column] > 0.6 else "black"
            axes.text(column, row, str(counts[row, column]), ha="center", va="center", color=colour)
        axes.set_xticks(range(len(answers)), [shown(names) for names in answers], rotation=90)
        axes.set_yticks(range(len(truths)), [shown(names) for names in truths])
        axes.set(xlabel="named", ylabel="hidden")
        return save(figure, path)


def before_and_after(campaigns: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Held-out error of the base model and of the explanation, beside the noise floor, for real recordings."""
    entries = [campaign for campaign in campaigns if _held_out(campaign)]
    with mpl.rc_context(fname=_STYLE):
        figure = Figure(figsize=(7.6, 0.9 + 0.25 * len(entries)), layout="constrained")
        axes = figure.subplots()
        for index, campaign in enumerate(reversed(entries)):
            fit = campaign["report"]["fit"]
            values = fit["before"]["heldout_rmse_percent"], fit["after"]["heldout_rmse_percent"]
            axes.plot(values, [index, index], "-", color="0.7", zorder=1)
            marks = zip((*values, fit["noise_floor_percent"]), ("o", "o", "|"), ("C3", "C0", "k"), strict=True)
            for value, marker, colour in marks:
                axes.plot([value], [index], marker, color=colour, markersize=9 if marker == "|" else 6)
        axes.set_yticks(range(len(entries)), [campaign["name"] for campaign in reversed(entries)])
        axes.set(
            xscale="log", xlabel="error on held-out data, percent: red base model, blue explained, bar noise floor"
        )
        return save(figure, path)


def _held_out(campaign: Mapping[str, Any]) -> bool:
    fit = campaign["report"]["fit"]
    return bool(fit and fit["before"]["heldout_rmse_percent"] is not None)

"""Residuals of the diagnosis' plain least squares of one curve compared with those of other programs."""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.curve_peers import Curve, hertz_residual, jkr_residual, nanite_residuals
from bench.figures import Figure
from proof.real import recorded
from underskin.diagnosis.data.dataset import curve_lines, finite_samples
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.recordings.campaign import IndentationRecording, parse
from underskin.recordings.curve_course import curve_landmarks
from underskin.surrogate.sigma_table import SigmaTable, load_table

_LARGEST, _SMALLEST = 1.02, 0.98


@dataclass(frozen=True)
class Fitted:
    """The residual of our least squares of one curve."""

    percent: float  # root mean square over all raw samples, of the force's
    raw: Curve
    size: float  # [N²], the sum of squares of the raw force about its zero

    def over(self, squares: float) -> float:
        """Our residual over that of another fit, a sum of squares over the raw samples [N²]."""
        return self.percent / (100 * float(np.sqrt(squares / self.size)))


def real_campaigns() -> dict[str, dict[str, Any]]:
    """The campaigns of real indentations (`campaign/1`), where their folder is named."""
    folder = os.environ.get("UNDERSKIN_RECORDINGS")
    made = {recording.name: recording.make(Path(folder)) for recording in recorded()} if folder else {}
    return {name: document for name, document in made.items() if _indents(document)}


def accuracy() -> list[Figure]:
    """Ratios of residuals over the curves of all available campaigns."""
    table = load_table()
    return [*_of_hertz(table), *_of_jkr(table)]


def _of_hertz(table: SigmaTable) -> list[Figure]:
    ours = [fitted(curve, (), table) for document in real_campaigns().values() for curve in _single_documents(document)]
    if not ours:
        return []
    scipy = [hertz_residual(fit.raw) for fit in ours]
    ratios = [fit.over(squares) for fit, squares in zip(ours, scipy, strict=True)]
    nanite = np.sqrt(np.array(nanite_residuals([fit.raw for fit in ours])) / scipy)
    name = f"{len(ours)} real curves, Hertz, all samples"
    return [
        Figure(f"{name}: ours over SciPy's, largest", max(ratios), "×", _LARGEST, "lower"),
        Figure(f"{name}: ours over SciPy's, smallest", min(ratios), "×", _SMALLEST),
        Figure(f"{name}: nanite's over SciPy's, largest", nanite.max(), "×"),
    ]


def _of_jkr(table: SigmaTable) -> list[Figure]:
    ours = [
        fitted(_way_in(curve), ("adhesion",), table)
        for document in _sticking()
        for curve in _single_documents(document)
    ]
    if not ours:
        return []
    ratios = [fit.over(jkr_residual(fit.raw)) for fit in ours]
    name = f"{len(ours)} ways in of a sphere that sticks, JKR, all samples"
    return [
        Figure(f"{name}: ours over SciPy's, largest", max(ratios), "×", _LARGEST, "lower"),
        Figure(f"{name}: ours over SciPy's, smallest", min(ratios), "×"),
    ]


def fitted(document: Mapping[str, Any], names: tuple[str, ...], table: SigmaTable) -> Fitted:
    """Our least squares of one curve under a set of mechanisms."""
    campaign = parse(dict(document))
    lines = curve_lines(campaign, "indentation")
    (recording,) = campaign.recordings
    assert isinstance(recording, IndentationRecording)
    explanation = FittingProblem(lines, table).explain(Request(names))
    assert explanation is not None
    displacement, force = finite_samples(recording)[:2]
    about_zero = force - curve_landmarks(displacement, force).zero
    raw = Curve(1e-3 * recording.indenter_radius_mm, campaign.skin.poisson_ratio, 1e-3 * displacement, about_zero)
    return Fitted(explanation.least_squares[1], raw, float((about_zero**2).sum()))


def _indents(document: Mapping[str, Any]) -> bool:
    return all(recording.get("kind") == "indentation" for recording in document["recordings"])


def _single_documents(document: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A campaign of each recording alone, with the modulus free."""
    skin = {**document["skin"], "youngs_modulus_mpa": None}
    for recording in document["recordings"]:
        yield {**document, "skin": skin, "recordings": [recording]}


def _sticking() -> list[dict[str, Any]]:
    """The open campaigns of curves that hide adhesion alone, where their folder is named."""
    folder = os.environ.get("UNDERSKIN_CAMPAIGNS")
    if not folder:
        return []
    truth = json.loads((Path(folder) / "curves-open-truth.json").read_text(encoding="utf-8"))
    files = [Path(folder) / "curves-open" / f"{name}.json" for name in truth if truth[name]["effects"] == ["adhesion"]]
    return [json.loads(file.read_text(encoding="utf-8")) for file in files]


def _way_in(document: dict[str, Any]) -> dict[str, Any]:
    """With only the samples up to the deepest one."""
    (recording,) = document["recordings"]
    last = int(np.argmax(recording["displacement_mm"])) + 1
    columns = {name: values[:last] for name, values in recording.items() if isinstance(values, list)}
    return {**document, "recordings": [recording | columns]}

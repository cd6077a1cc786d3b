"""Pages of reports as the command writes them, and the figures that are in them."""

import base64
import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from typer.testing import CliRunner

from underskin.cli.app import app

_FIGURE = re.compile(r'Plotly\.newPlot\(\s*"figure-(\w+)",\s*')
_BETWEEN = re.compile(r"\s*,\s*")


def written(documents: Sequence[Mapping[str, Any]], *options: str, without: Sequence[str] = ()) -> tuple[Any, str]:
    """Report and page of campaigns (`campaign/1`), diagnosed by the command without these mechanisms."""
    left_out = [word for name in without for word in ("--without", name)]
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for number, document in enumerate(documents):
            file = Path(folder, str(number), "campaign.json")
            file.parent.mkdir()
            file.write_text(json.dumps(document), encoding="utf-8")
            files.append(str(file))
        out = Path(folder, "out")
        done = CliRunner().invoke(app, ["diagnose", *files, "--html", "--output-dir", str(out), *options, *left_out])
        assert done.exit_code == 0, done.output
        (report,), (page,) = out.glob("*.json"), out.glob("*.html")
        return json.loads(report.read_text("utf-8")), page.read_text("utf-8")


def figures_in(page: str) -> dict[str, go.Figure]:
    """The figures of a page, by name."""
    decoder, found = json.JSONDecoder(), {}
    for begun in _FIGURE.finditer(page):
        data, end = decoder.raw_decode(page, begun.end())
        between = _BETWEEN.match(page, end)
        assert between is not None
        layout, _ = decoder.raw_decode(page, between.end())
        layout.pop("template", None)
        found[begun[1]] = go.Figure({"data": _decoded(data), "layout": _decoded(layout)})
    return found


def _decoded(part: Any) -> Any:
    """With arrays in place of their bytes."""
    if isinstance(part, dict) and "bdata" in part:
        flat = np.frombuffer(base64.b64decode(part["bdata"]), part["dtype"])
        return flat.reshape([int(size) for size in str(part["shape"]).split(",")]) if "shape" in part else flat
    if isinstance(part, dict):
        return {name: _decoded(own) for name, own in part.items()}
    return [_decoded(own) for own in part] if isinstance(part, list) else part

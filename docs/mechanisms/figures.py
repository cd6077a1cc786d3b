"""One figure a mechanism, drawn from its panels; the same input gives the same bytes."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
from matplotlib.figure import Figure

from docs.mechanisms.signatures import panels
from underskin.surrogate.sigma_table import SigmaTable

_STYLE = Path(__file__).parents[1] / "figures.mplstyle"
_SMALL = {"font.size": 8, "legend.fontsize": "medium", "path.simplify_threshold": 0.5}


def draw(table: SigmaTable, folder: Path, names: Iterable[str]) -> list[Path]:
    """Write mechanism-NAME.svg for each name into `folder`; returns their paths."""
    paths = []
    with mpl.rc_context(cast(Any, _SMALL), fname=_STYLE):  # its type lists every known setting
        for name in names:
            shown = panels(name, table)
            figure = Figure(figsize=(3.4 * len(shown), 2.3), layout="constrained")
            for axes, panel in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
                for label, (x, y) in panel.curves.items():
                    axes.plot(x, y, label=label or None)
                axes.set_xlabel(panel.axis)
                axes.set_ylabel(panel.unit)
                if panel.logarithmic:
                    axes.set_xscale("log")
                if any(panel.curves):
                    axes.legend(fontsize=7)
            paths.append(folder / f"mechanism-{name}.svg")
            figure.savefig(paths[-1], metadata={"Date": None})
    return paths

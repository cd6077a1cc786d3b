"""docs/mechanisms.md is what `make mechanisms` writes, with a figure of each mechanism; the fits behind its priors."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from docs.mechanisms.signatures import panels
from docs.mechanisms.silicones import LAWS, RESULTS, Sample, fit, main, yeoh
from docs.mechanisms.text import document
from tests.support.repository import ROOT
from underskin.mechanisms.registry import built_in
from underskin.surrogate.sigma_table import load_table

DOCS = ROOT / "docs"


def test_the_page_is_the_catalogue_s() -> None:
    assert (DOCS / "mechanisms.md").read_text(encoding="utf-8") == document()


@pytest.mark.slow
def test_each_mechanism_has_a_figure_of_an_effect() -> None:
    for name in (mechanism.name for mechanism in built_in()):
        assert (DOCS / "figures" / f"mechanism-{name}.svg").exists()
        for panel in panels(name, load_table()):
            curves = [y for _, y in panel.curves.values()]
            assert all(np.isfinite(y).all() for y in curves)
            changed = max(np.ptp(y) for y in curves) > 0
            assert changed, (name, panel.axis)


@pytest.mark.soak
def test_figures_come_out_the_same_every_time(tmp_path: Path) -> None:
    from docs.mechanisms.figures import draw

    first, second = (
        [path.read_bytes() for path in draw(load_table(), tmp_path, ["ageing", "contact_resonance"])] for _ in range(2)
    )
    assert first == second


def test_a_laws_own_curve_gives_its_constants_back() -> None:
    strain = np.linspace(-0.6, -0.01, 60)
    exact = Sample("made", strain, 100 / 3 * yeoh(1 + strain, np.array([0.1, 0.05])))
    found = fit(exact, *LAWS["Yeoh"])
    assert found.modulus_kpa == pytest.approx(100)
    assert found.shape == pytest.approx([0.1, 0.05])


@pytest.mark.skipif("UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS names no folder")
def test_the_fits_are_those_of_the_measured_silicones(tmp_path: Path) -> None:
    main(tmp_path / "silicones.json")
    made, kept = (json.loads(path.read_text(encoding="utf-8")) for path in (tmp_path / "silicones.json", RESULTS))
    assert [row["sample"] for row in made] == [row["sample"] for row in kept]
    for new, old in zip(made, kept, strict=True):
        for law in LAWS:
            assert new[law]["modulus_kpa"] == pytest.approx(old[law]["modulus_kpa"], rel=0.02)
            assert new[law]["residual_percent"] == pytest.approx(old[law]["residual_percent"], rel=0.1)

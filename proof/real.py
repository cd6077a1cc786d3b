"""Real recordings as campaigns: units, geometry and signs as their sources state them, and nothing of what they show.

Each starts from the simplest model: the elastomer's modulus is not declared, so the base model has it free.
Source of every file, licence and known parameters: SOURCE.md beside the recordings.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from underskin.units import Floats

_MOST_SAMPLES = 1200  # the diagnosis itself works on means over neighbouring samples
_DUMBBELL_MM = (33.0, float(np.sqrt(4 * 18 / np.pi)))  # gauge length; a circle as large as 3 mm × 6 mm
_LARGEST_STRAIN = 3.0  # of the dumbbells, some of which reach nine times their length
_CYLINDER_MM = (30.0, 50.0)
_NOMINAL_TIP_MM = 5e-3  # AFM tips whose radius the source does not state: with a free modulus it does not matter
_STIFFNESS_N_PER_M = {"polymergel_creep": 0.061, "cell_stress_relaxation": 1.068}
_BLOW_SAMPLES = 8192
_BLOW_BAND_HZ = (5.0, 500.0)
_BLOW_LINES = 120


@dataclass(frozen=True)
class Recorded:
    """A campaign made of real recordings, and what the diagnosis knew besides the numbers themselves."""

    name: str
    stated: str
    make: Callable[[Path], dict[str, Any]]


def recorded() -> Iterator[Recorded]:
    """Every campaign of real recordings, in the order of the page."""
    for well, height in (("E5", 7.95), ("E6", 8.37), ("E7", 8.85)):
        yield Recorded(
            f"well-{well}",
            f"sphere of radius 2.5 mm, sample {height} mm high, one loading curve",
            partial(_wells, f"run_732*/well_{well}_*.csv", height),
        )
    for well in ("G3", "A5"):
        yield Recorded(
            f"well-{well}-july",
            "sphere of radius 2.5 mm, height unknown, the same well three times",
            partial(_wells, f"run_04*/well_{well}_*.csv", None),
        )
    for product in ("EF10", "EF30", "EF50"):
        yield Recorded(
            f"compression-{product}",
            "cylinder 30 mm high, 50 mm in diameter, samples A and B, two repeats each",
            partial(_compression, product),
        )
    for product in ("RTV615", "Ecoflex_00-10", "Ecoflex_00-30", "Ecoflex_00-50"):
        yield Recorded(
            f"tension-{product}",
            "gauge length 33 mm, 18 mm², one curve up to a strain of 3",
            partial(_tension, product),
        )
    for name in ("polymergel_creep", "cell_stress_relaxation"):
        yield Recorded(
            name,
            "approach and hold, cantilever's stiffness, a nominal tip",
            partial(_afm, name),
        )
    yield Recorded("chiaro-loading", "sphere of radius 27.5 µm, loading alone", partial(_chiaro, "loading"))
    yield Recorded("chiaro-both", "the same, loading and unloading", partial(_chiaro, "both"))
    yield Recorded("hammer", "two blows, response m_2 over force, as if an FRF of the prototype", _hammer)


def _document(name: str, skin: dict[str, Any], recordings: list[dict[str, Any]]) -> dict[str, Any]:
    skin_document = {"poisson_ratio": 0.5, "youngs_modulus_mpa": None, **skin}
    return {
        "schema": "campaign/1",
        "name": name,
        "units_checked": True,
        "skin": skin_document,
        "recordings": recordings,
    }


def _curve(
    name: str, kind: str, geometry: dict[str, float], displacement: Floats, force: Floats, time: Floats
) -> dict[str, Any]:
    """A curve of about as many samples as are used; a clock that runs backwards somewhere is left out."""
    step = max(1, len(force) // _MOST_SAMPLES)
    columns = {"displacement_mm": displacement, "force_n": force}
    if (np.diff(time) >= 0).all():
        columns["time_s"] = time - time[0]
    return {"id": name, "kind": kind, **geometry, **{key: values[::step].tolist() for key, values in columns.items()}}


def _wells(pattern: str, height_mm: float | None, folder: Path) -> dict[str, Any]:
    recordings = []
    for path in sorted((folder / "sphere-in-well").glob(pattern)):
        time, position, _, force = _numbers(path, ",", 4).T
        recordings.append(_curve(path.stem, "indentation", {"indenter_radius_mm": 2.5}, -position, -force, time))
    return _document("sphere in a well", {"thickness_mm": height_mm}, recordings)


def _compression(product: str, folder: Path) -> dict[str, Any]:
    recordings = []
    for sample in ("A1", "A2", "B1", "B2"):
        path = folder / "silicone-compression" / f"{product}_0T" / f"{product}_0T_{sample}.csv"
        time, displacement, force = _numbers(path, ",", 7).T[:3]
        geometry = dict(zip(("sample_height_mm", "sample_diameter_mm"), _CYLINDER_MM, strict=True))
        recordings.append(_curve(sample, "compression", geometry, displacement, force, time))
    return _document(f"{product} between platens", {}, recordings)


def _tension(product: str, folder: Path) -> dict[str, Any]:
    rows = _numbers(folder / "silicone-tension" / f"{product}.csv", ";", 5)
    rows = rows[: int(np.argmax(rows[:, 4])) + 1]
    time, _, _, strain, stress = rows[rows[:, 3] <= _LARGEST_STRAIN].T
    geometry = dict(zip(("sample_height_mm", "sample_diameter_mm"), _DUMBBELL_MM, strict=True))
    displacement, force = -strain * _DUMBBELL_MM[0], -stress * 18.0
    return _document(f"{product} pulled", {}, [_curve("t", "compression", geometry, displacement, force, time)])


def _afm(name: str, folder: Path) -> dict[str, Any]:
    rows = _numbers(folder / "afm-hold" / f"{name}.csv", ",", 4)
    approach = 0 if name == "polymergel_creep" else 1
    time, height, force, segment = rows[(rows[:, 3] == approach) | (rows[:, 3] == approach + 1)].T
    free = float(np.median(force[: len(force) // 100]))
    depth_mm = -1e3 * (height + (force - free) / _STIFFNESS_N_PER_M[name])
    used = force - free > 0.02 * (force.max() - free)  # in contact
    used |= segment == approach + 1
    held = segment == approach + 1
    # As many samples of the hold as of the approach, which is much shorter
    used &= ~held | (np.arange(len(held)) % max(1, int(held.sum() / (used & ~held).sum())) == 0)
    geometry = {"indenter_radius_mm": _NOMINAL_TIP_MM}
    curve = _curve(name, "indentation", geometry, depth_mm[used], force[used] - free, time[used])
    return _document(name, {}, [curve])


def _chiaro(part: str, folder: Path) -> dict[str, Any]:
    time, load, depth = _numbers(folder / "afm-hold" / "fmt-chiaro-txt_AEBP1_Indentation_002.txt", "\t", 5).T[:3]
    last = len(load) if part == "both" else int(np.argmax(load)) + 1
    curve = _curve(
        "chiaro", "indentation", {"indenter_radius_mm": 0.0275}, 1e-6 * depth[:last], 1e-6 * load[:last], time[:last]
    )
    return _document("Chiaro", {}, [curve])


def _hammer(folder: Path) -> dict[str, Any]:
    """Each blow's response over force, averaged (H1) over bands that are even in the logarithm of the frequency."""
    path = folder / "impact-hammer-lvm" / "long_single_header_multi_ch.lvm"
    rows = _numbers(path, "\t", 4)[:, 1:]
    step = 0.000977
    edges = np.geomspace(*_BLOW_BAND_HZ, _BLOW_LINES + 1)
    recordings = []
    for number, start in enumerate((0, _BLOW_SAMPLES)):
        block = rows[start : start + _BLOW_SAMPLES] - rows[start : start + _BLOW_SAMPLES].mean(axis=0)
        force, _, answer = np.fft.rfft(block, axis=0).T
        frequency = np.fft.rfftfreq(len(block), step)
        bands = [(frequency >= low) & (frequency < high) for low, high in pairwise(edges)]
        used = [band for band in bands if band.any()]
        h1 = np.array([(force[band].conj() @ answer[band]) / (force[band].conj() @ force[band]) for band in used])
        recordings.append(
            {
                "id": f"blow{number + 1}", "sensor": "m_2", "indenter_radius_mm": 4.0, "preload_n": 1.0 + number,
                "dynamic_force_n": 0.09, "frequency_hz": [float(frequency[band].mean()) for band in used],
                "frf_re_pc_per_n": h1.real.tolist(), "frf_im_pc_per_n": h1.imag.tolist(),
            }
        )  # fmt: skip
    skin = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5,
            "sensors": [{"id": "m_2", "x_mm": 0.0, "y_mm": 0.0}]}  # fmt: skip
    return _document("hammer", skin, recordings)


def _numbers(path: Path, delimiter: str, columns: int) -> Floats:
    """The rows whose first entries are all numbers; an empty first entry counts as 0."""
    rows = []
    for line in path.read_text(encoding="latin-1").splitlines():
        try:
            numbers = [float(cell or 0) for cell in line.split(delimiter)[:columns]]
        except ValueError:
            continue
        if len(numbers) == columns and any(numbers):
            rows.append(numbers)
    return np.array(rows)

"""The example skin of the start page, recorded by the virtual rig: `python scripts/make_example.py`.

A 4 × 2 array over half a year, its d33 falling slowly; in the last campaign the model lacks a heavy tip on the shaker.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import yaml

FOLDER = Path(__file__).parent.parent / "service" / "pages" / "start" / "example"
CAMPAIGNS: tuple[tuple[int, str, str, str, float, tuple[float, int], dict[str, Any]], ...] = (
    (1, "2024-05", "as built", "2024-05-14T08:30:00Z", 14.2, (130, 20), {}),
    (2, "2024-07", "after two months", "2024-07-09T09:10:00Z", 13.8, (130, 20), {}),
    (3, "2024-09", "after four months", "2024-09-17T08:45:00Z", 13.5, (130, 20), {}),
    (14, "2024-11", "after six months, new tip", "2024-11-12T10:05:00Z", 13.1, (1000, 60),
     {"contact_resonance": {"tip_mass_g": 6, "damping": 0.05}}),
)  # fmt: skip
_DIGITS = 4


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for seed, name, state, start, d33, lines, effects in CAMPAIGNS:
        described = experiment(f"example, {state}", seed, start, d33, lines, effects)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "experiment.yaml"
            file.write_text(yaml.safe_dump(described), encoding="utf-8")
            command = [sys.executable, "-m", "underskin", "rig", "run", str(file), "--output-dir", folder]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            document = json.loads((Path(folder) / "campaign.json").read_text(encoding="utf-8"))
        text = json.dumps(rounded(document), separators=(",", ":"))
        (FOLDER / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        print(f"{name}.json {len(text)} bytes")


def experiment(
    name: str, seed: int, start: str, d33: float, lines: tuple[float, int], effects: dict[str, Any]
) -> dict[str, Any]:
    """The description of the experiment for the rig."""
    return {
        "schema": "experiment/1",
        "name": name,
        "seed": seed,
        "skin": {
            "id": "example",
            "thickness_mm": 2.5,
            "youngs_modulus_mpa": 16,
            "sensor_radius_mm": 1.5,
            "d33_pc_per_n": d33,
            "array": {"columns": 4, "rows": 2, "pitch_mm": 8},
            "length_mm": 40,
            "width_mm": 20,
        },
        "design": {
            "indenters_mm": [4, 10],
            "preloads_n": [0.5, 1, 2, 3],
            "dynamic_forces_n": [0.09],
            "start": start,
        },
        "lines": {"low_hz": 1, "high_hz": lines[0], "count": lines[1]},
        "noise": {"gain": 0.02, "line": 0.01, "averages": 16},
        "effects": effects,
    }


def rounded(value: Any) -> Any:
    """The document with numbers of as many digits as an instrument gives."""
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}")
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return {name: rounded(item) for name, item in value.items()} if isinstance(value, dict) else value


if __name__ == "__main__":
    main()

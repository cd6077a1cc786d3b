"""Reports on small campaigns of the virtual rig that hide given effects."""

from typing import Any

from rig.draw import drawn, record
from rig.recorded import campaign as recorded
from tests.support.lean_reports import lean_report
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import SigmaTable


def rig_report(
    table: SigmaTable, effects: dict[str, Any], *left_out: str, gain: float = 0.02, position_mm: float = 0.0
) -> dict[str, Any]:
    """The report on three sensors of the virtual rig, pressed at four places each, in any order; searched
    outside `make soak` without the mechanisms left out."""
    description = drawn(5, 0, "none")
    description["skin"] = {
        "thickness_mm": 2.0,
        "youngs_modulus_mpa": 3.0,
        "sensor_radius_mm": 1.0,
        "d33_pc_per_n": 15.0,
        "array": {"columns": 3, "rows": 1, "pitch_mm": 8.0},
    }
    description["design"] = {
        "indenters_mm": [4.0],
        "preloads_n": [0.4, 0.8, 1.6, 3.0],
        "dynamic_forces_n": [0.05],
        "offsets_mm": [[0.0, 0.0], [0.8, 0.0], [0.0, -1.2], [-1.5, 0.6]],
        "shuffled": True,
    }
    description["noise"] |= {"gain": gain, "position_mm": position_mm}
    description["effects"] = effects
    found, refused = from_dict(recorded(record(description)))
    assert not refused
    return lean_report(found, table, *left_out)

"""An experiment's folder: campaign.json, truth.json and optionally the raw recordings with their description.

`recordings.tdms` has one group per recording: load cell and charge amplifier in volts, as LabVIEW writes them;
`rig.yaml` (`rig/1`) describes the channels. The amplifier inverts the sign of the charge, as charge amplifiers do.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from rig.effects import FRF
from rig.elastomer import campaign_of_curves, record_curves
from rig.errors import RigError
from rig.experiment import Experiment
from rig.recorded import campaign, campaign_document, record_lines, recording_headers, skin_document
from rig.time_domain import TimeSeries, record_series
from rig.true_response import TrueResponse
from rig.truth import truth_of_curves, truth_of_lines, truth_of_response

_VOLTS_PER_NEWTON = 0.5
_MILLIVOLTS_PER_PICOCOULOMB = 10.0
_PROPERTIES = {
    "indenter_radius_mm": "indenter radius [mm]",
    "preload_n": "preload [N]",
    "dynamic_force_n": "dynamic force [N]",
    "dwell_s": "dwell [s]",
    "load_cycles": "load cycles",
    "recorded_at": "recorded at",
    "sensor": "sensor",
}


def carry_out(experiment: Experiment, folder: Path, *, tdms: bool = False) -> list[Path]:
    """Record the experiment and write its folder; returns the files.

    Raises RigError if an effect or the raw files need what the experiment lacks.
    """
    if tdms and experiment.drive is None:
        raise RigError("drive", None, "required for raw recordings: lines and curves have no time series")
    if tdms and any(offset != (0.0, 0.0) for offset in experiment.design.offsets_mm):
        raise RigError("design.offsets_mm", experiment.design.offsets_mm, "must be [[0, 0]] in TDMS, which keeps none")
    series: list[TimeSeries] = []
    if experiment.kind != FRF:
        curves = record_curves(experiment)
        document, truth = campaign_of_curves(experiment, curves), truth_of_curves(experiment, curves)
    elif experiment.lines is not None:
        lines = record_lines(experiment)
        document, truth = campaign(lines), truth_of_lines(lines)
    else:
        response, series = record_series(experiment)
        document, truth = campaign_of_series(response, series), truth_of_response(response)
    folder.mkdir(parents=True, exist_ok=True)
    files = [_write_json(folder / "campaign.json", document), _write_json(folder / "truth.json", truth)]
    if tdms:
        files += [_write_tdms(folder / "recordings.tdms", response, series), _write_rig(folder / "rig.yaml", response)]
    return files


def campaign_of_series(response: TrueResponse, series: list[TimeSeries]) -> dict[str, Any]:
    """The campaign (`campaign/1`) of time series."""
    drive = response.experiment.drive
    assert drive is not None
    entries = recording_headers(response)
    for header, recorded in zip(entries, series, strict=True):
        header["sample_rate_hz"] = drive.sample_rate_hz
        header["force_n"], header["charge_pc"] = recorded.force_n.tolist(), recorded.charge_pc.tolist()
    return campaign_document(response.experiment, entries)


def _write_json(path: Path, document: dict[str, Any]) -> Path:
    path.write_text(json.dumps(document, ensure_ascii=False, separators=(",", ":")) + "\n", encoding="utf-8")
    return path


def _write_tdms(path: Path, response: TrueResponse, series: list[TimeSeries]) -> Path:
    drive = response.experiment.drive
    assert drive is not None
    timing = {"wf_increment": 1 / drive.sample_rate_hz, "wf_start_offset": 0.0, "unit_string": "V"}
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([RootObject({"name": response.experiment.name})])
        for header, recorded in zip(recording_headers(response), series, strict=True):
            stated = {_PROPERTIES[name]: value for name, value in header.items() if name in _PROPERTIES}
            volts = {
                "Load cell": recorded.force_n * _VOLTS_PER_NEWTON,
                "Charge amplifier": -recorded.charge_pc * _MILLIVOLTS_PER_PICOCOULOMB * 1e-3,
            }
            channels = [
                ChannelObject(header["id"], name, values.astype(np.float64), timing) for name, values in volts.items()
            ]
            writer.write_segment([GroupObject(header["id"], stated), *channels])
    return path


def _write_rig(path: Path, response: TrueResponse) -> Path:
    stated = [name for name in recording_headers(response)[0] if name in _PROPERTIES]
    description = {
        "schema": "rig/1",
        "name": f"virtual rig: {response.experiment.name}"[:200],
        "kind": FRF,
        "skin": {name: value for name, value in skin_document(response.experiment).items() if value is not None},
        "recording": {"id": {"property": "block"}, **{name: {"property": _PROPERTIES[name]} for name in stated}},
        "channels": {
            "force_n": {
                "channel": "Load cell", "unit": "V",
                "sensitivity": _VOLTS_PER_NEWTON, "sensitivity_unit": "V/N", "sign": 1,
            },
            "charge_pc": {
                "channel": "Charge amplifier", "unit": "V",
                "sensitivity": _MILLIVOLTS_PER_PICOCOULOMB, "sensitivity_unit": "mV/pC", "sign": -1,
            },
        },
    }  # fmt: skip
    path.write_text(yaml.safe_dump(description, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return path

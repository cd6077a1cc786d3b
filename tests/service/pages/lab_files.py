"""Files as a lab's instruments write them, for pages to be shown."""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter


def frf_tdms(document: Mapping[str, Any]) -> bytes:
    """A campaign's FRFs: a group a recording, which says what pressed where; columns labelled with their units."""
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        for entry in document["recordings"]:
            name = entry["id"]
            told = {
                "sensor": entry["sensor"],
                "indenter radius [mm]": entry["indenter_radius_mm"],
                "preload [mN]": 1000 * entry["preload_n"],
            }
            columns = (
                ("Frequency", "Hz", entry["frequency_hz"]),
                ("FRF real", "pC/N", entry["frf_re_pc_per_n"]),
                ("FRF imaginary", "pC/N", entry["frf_im_pc_per_n"]),
            )
            channels = [
                ChannelObject(name, head, np.array(values), {"unit_string": unit}) for head, unit, values in columns
            ]
            writer.write_segment([RootObject({"operator": "me"}), GroupObject(name, told), *channels])
    return buffer.getvalue()


def shaker_tdms(gain_pc_per_n: float, *, load_cell: str = "Load cell") -> bytes:
    """Two seconds of a shaker: a load cell of 0.5 V/N, and an amplifier of 10 mV/pC that turns the sign."""
    random = np.random.default_rng(3)
    force = 1 + 0.09 * random.normal(size=2048)
    charge = gain_pc_per_n * (force - 1) + 0.001 * random.normal(size=2048)
    buffer = io.BytesIO()
    timing = {"wf_increment": 1 / 1024, "wf_start_offset": 0.0, "unit_string": "V"}
    with TdmsWriter(buffer) as writer:
        channels = [
            ChannelObject("press 1", load_cell, 0.5 * force, timing),
            ChannelObject("press 1", "Amplifier", -0.01 * charge, timing),
        ]
        writer.write_segment([RootObject({}), GroupObject("press 1", {}), *channels])
    return buffer.getvalue()


SHAKER_RIG = """\
schema: rig/1
kind: frf
skin: {thickness_mm: 2.5, youngs_modulus_mpa: 16, poisson_ratio: 0.5, sensor_radius_mm: 1.5,
       sensors: [{id: s01, x_mm: 0, y_mm: 0}]}
recording: {sensor: s01, indenter_radius_mm: 4, preload_n: 1, dynamic_force_n: 0.09, dwell_s: 30}
channels:
  force_n: {channel: Load cell, unit: V, sensitivity: 0.5, sensitivity_unit: V/N}
  charge_pc: {channel: Amplifier, unit: V, sensitivity: 10, sensitivity_unit: mV/pC, sign: -1}
"""

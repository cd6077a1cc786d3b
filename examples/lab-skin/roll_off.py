"""The campaign as a charge amplifier with an upper corner would record it: `python roll_off.py CAMPAIGN CORNER_HZ`."""

import json
import sys
from pathlib import Path

import numpy as np

path, corner_hz = Path(sys.argv[1]), float(sys.argv[2])
campaign = json.loads(path.read_text(encoding="utf-8"))
for recording in campaign["recordings"]:
    frf = np.array(recording["frf_re_pc_per_n"]) + 1j * np.array(recording["frf_im_pc_per_n"])
    frf = frf / (1 + 1j * np.array(recording["frequency_hz"]) / corner_hz)
    recording |= {"frf_re_pc_per_n": frf.real.tolist(), "frf_im_pc_per_n": frf.imag.tolist()}
path.write_text(json.dumps(campaign), encoding="utf-8")

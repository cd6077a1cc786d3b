"""The campaign as a recorder that averages two samples would store it: `python average_samples.py CAMPAIGN MS`."""

import json
import sys
from pathlib import Path

import numpy as np

path, interval_s = Path(sys.argv[1]), 1e-3 * float(sys.argv[2])
campaign = json.loads(path.read_text(encoding="utf-8"))
for recording in campaign["recordings"]:
    frf = np.array(recording["frf_re_pc_per_n"]) + 1j * np.array(recording["frf_im_pc_per_n"])
    frf = frf * (1 + np.exp(-2j * np.pi * np.array(recording["frequency_hz"]) * interval_s)) / 2
    recording |= {"frf_re_pc_per_n": frf.real.tolist(), "frf_im_pc_per_n": frf.imag.tolist()}
path.write_text(json.dumps(campaign), encoding="utf-8")

"""`python roll_off.py CAMPAIGN CORNER_HZ`: the campaign as a charge amplifier with that upper corner would record it."""

import json
import sys

import numpy as np

path, corner_hz = sys.argv[1], float(sys.argv[2])
with open(path, encoding="utf-8") as file:
    campaign = json.load(file)
for recording in campaign["recordings"]:
    frf = np.array(recording["frf_re_pc_per_n"]) + 1j * np.array(recording["frf_im_pc_per_n"])
    frf = frf / (1 + 1j * np.array(recording["frequency_hz"]) / corner_hz)
    recording |= {"frf_re_pc_per_n": frf.real.tolist(), "frf_im_pc_per_n": frf.imag.tolist()}
with open(path, "w", encoding="utf-8") as file:
    json.dump(campaign, file)

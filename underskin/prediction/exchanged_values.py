"""Preloads and spheres that look exchanged: loads beyond what a skin bears, which all come within range once exchanged.

Contact radius and depth depend on F R, which an exchange of the numbers of F [N] and R [mm] leaves unchanged; the load
parameter L = F/(R² E) does change. A small sphere pressed hard makes L equally large: an exchange is one of two
explanations where every preload [N] is above every radius [mm], and none otherwise.
"""

from collections.abc import Sequence

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.physics import hertz
from underskin.recordings.campaign import FrfRecording, SkinDescription
from underskin.surrogate.contact_model import ContactModel
from underskin.units import Floats, Mask, to_si

_BEYOND = 0.5  # of the recordings as declared, at the least
_WITHIN = 0.9  # of the recordings once exchanged, at the least
_LARGEST_MM = 30.0  # radius of a ball that a laboratory has: beyond it a preload in mN is likelier


def exchanged_values(
    skin: SkinDescription, recorded: Sequence[FrfRecording], contact_model: ContactModel
) -> list[Finding]:
    """A finding where preload and sphere of the recordings look exchanged."""
    if not recorded or skin.youngs_modulus_mpa is None:
        return []
    modulus = float(to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa))
    preload = np.array([recording.preload_n for recording in recorded])
    radius_mm = np.array([recording.indenter_radius_mm for recording in recorded])

    def beyond(force: Floats, sphere_mm: Floats) -> Mask:
        load = hertz.load_parameter(force, to_si("indenter_radius_mm", sphere_mm), modulus)
        return np.asarray(load > contact_model.domain["load_parameter"][1])

    as_declared = beyond(preload, radius_mm)
    as_exchanged = ~beyond(radius_mm, preload) & (preload < _LARGEST_MM)
    if as_declared.mean() < _BEYOND or as_exchanged.mean() < _WITHIN or preload.min() <= radius_mm.max():
        return []
    arguments = {"beyond": int(as_declared.sum()), "recordings": len(recorded)}
    return [Finding(Reason.PRELOAD_AND_RADIUS_EXCHANGED, "", "preload_n", arguments)]

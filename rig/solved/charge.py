"""Charge over force of a disc under the layer, from solved courses of indentation.

A sphere's course gives, at some indentations, force and pressure on the base. The share of the force that a disc of
radius rT at the offset e bears, Q/(d33 F) = ∫ p(r) w(r) 2πr dr / F, w the share of the circle of radius r inside the
disc, in parts within which w is smooth, is a polynomial of F^(1/3), fitted to the course. The recorded FRF is the first
harmonic of Q at F + Fd sin ωt.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rig.solved.layer import Floats, PressedLayer, Sublayer

_STEPS, _DEGREE, _PLACES = 13, 5, 400
_MARGIN = 0.85  # the course reaches this much beyond the forces asked for
_PHASES = np.sin(2 * np.pi * (np.arange(16) + 0.5) / 16)


@dataclass(frozen=True)
class Skin:
    """What is solved, thickness and modulus of the main layer 1: sublayers from the base up, and a free edge."""

    sublayers: tuple[Sublayer, ...]
    lateral: float | None = None


@dataclass(frozen=True)
class ChargeCurve:
    """Forces [E h²], contact radii [h] and base pressures [E] (steps, places) at radii `r` [h] of one sphere."""

    force: Floats
    contact: Floats
    r: Floats
    pressure: Floats

    def share(self, sensor: float, offset: float) -> Floats:
        """Polynomial in F^(1/3), highest power first, of the share of the force on a disc of this radius at an
        offset [h]."""
        near, far = abs(sensor - offset), sensor + offset
        within = np.linspace(0, near, _PLACES)
        across = (near + far) / 2 - (far - near) / 2 * np.cos(np.linspace(0, np.pi, _PLACES))
        borne = np.zeros(len(self.force))
        for r, part in ((within, np.full(_PLACES, float(offset < sensor))), (across, inside(across, sensor, offset))):
            pressure = np.array([np.interp(r, self.r, row, right=0.0) for row in self.pressure])
            borne += np.trapezoid(pressure * part * 2 * np.pi * r, r, axis=1)
        return np.polyfit(np.cbrt(self.force), borne / self.force, _DEGREE)

    def contact_radius(self, force: Floats) -> Floats:
        """Contact radius at forces, interpolated [h]."""
        return np.interp(np.cbrt(force), np.cbrt(self.force), self.contact)


def inside(r: Floats, sensor: float, offset: float) -> Floats:
    """Share of the circle of radius r about the contact's axis that lies inside the disc."""
    if offset < 1e-9:
        return (r < sensor).astype(float) + 0.5 * (r == sensor)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (r * r + offset * offset - sensor * sensor) / (2 * r * offset)
    return np.where(r == 0, float(offset < sensor), np.arccos(np.clip(cosine, -1, 1)) / np.pi)


@lru_cache(maxsize=8)
def solve(skin: Skin, radius: float, lowest: float, highest: float, fineness: float = 1.5) -> ChargeCurve:
    """The course of a sphere [h] over forces from `lowest` to `highest` [E h²]."""
    softest = min(part.material.modulus for part in skin.sublayers if part.thickness > 0.3)
    widest = np.cbrt(0.5625 * highest * radius / softest)
    pressed = PressedLayer(skin.sublayers, radius, float(widest), fineness, skin.lateral)
    end = float(pressed.r.max())
    r = np.linspace(0, end, int(end * 500) + 1)
    depth, force, steps = 0.5 * np.cbrt(0.5625 * _MARGIN * lowest * radius) ** 2 / radius, 0.0, []
    ratio = (highest / lowest) ** (0.6 / _STEPS)  # of the depth, as F ~ δ^(3/2) or steeper
    while force < highest / _MARGIN:
        force = pressed.press(float(depth))
        if force > _MARGIN * lowest:
            steps.append((force, pressed.contact_radius(), pressed.base_pressure(r)))
            depth *= ratio
        else:
            depth *= max(ratio, min(1.5, (_MARGIN * lowest / force) ** 0.5 + 0.02))
    forces, contacts, pressures = zip(*steps, strict=True)
    return ChargeCurve(np.array(forces), np.array(contacts), r, np.array(pressures))


def harmonic(share: Floats, force: Floats, dynamic: Floats) -> Floats:
    """First harmonic of F·share(F) at F + Fd sin ωt over Fd; equal weights at equal phases are exact up to the 15th."""
    at = force[:, None] + dynamic[:, None] * _PHASES
    return np.asarray(2 * np.mean(at * np.polyval(share, np.cbrt(at)) * _PHASES, axis=1) / dynamic)

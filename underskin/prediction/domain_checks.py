"""Why the base model says nothing of a recording, in words that name what exceeds which limit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.prediction.pressed_skin import Transmission
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.conditions import SkinDescription
from underskin.surrogate.contact_model import ContactModel
from underskin.units import Floats, Mask

_MOST_CHARGE = 1.0  # C/N
_LIKE_MILLI = 100.0  # N: from here on a preload that fits as 1/1000 may be in mN


@dataclass(frozen=True)
class RowConditions:
    """A row's force, sphere and elastomer, as a lab writes them."""

    preload_n: float
    indenter_radius_mm: float
    youngs_modulus_mpa: float
    poisson_ratio: float


def usable(level: Floats, noise: Floats, sigma: Floats, transmitted: Transmission) -> Mask:
    """The rows inside the table's domain, at an offset that it reaches, with a line in the band and below 1 C/N."""
    return transmitted.inside & np.isfinite(sigma) & (np.hypot(level, noise) < _MOST_CHARGE)


def reasons(
    recorded: Sequence[FrfRecording],
    skin: SkinDescription,
    transmitted: Transmission,
    level: Floats,
    contact_model: ContactModel,
) -> Iterator[Finding]:
    """Of each recording that is not `usable` why; `level` is its averaged FRF [C/N], NaN without a line in the band."""
    for row, recording in enumerate(recorded):
        if skin.poisson_ratio != INCOMPRESSIBLE or not transmitted.inside[row]:
            assert skin.youngs_modulus_mpa is not None
            pressed = RowConditions(
                recording.preload_n, recording.indenter_radius_mm, skin.youngs_modulus_mpa, skin.poisson_ratio
            )
            limit = beyond(pressed, [float(part[row]) for part in _numbers(transmitted)], contact_model)
            yield Finding(Reason.BEYOND_TABLE, recording.id, "preload_n", {"limit": limit})
        elif not np.isfinite(level[row]):
            yield Finding(Reason.NO_LINE_IN_BAND, recording.id, "frequency_hz")
        elif not abs(level[row]) < _MOST_CHARGE:
            arguments = {"frf_pc_per_n": float(1e12 * level[row])}
            yield Finding(Reason.IMPOSSIBLE_FRF, recording.id, "frf_pc_per_n", arguments)
        else:
            yield Finding(Reason.PLACE_BEYOND_TABLE, recording.id, "position_mm")


def _numbers(transmitted: Transmission) -> tuple[Floats, Floats, Floats]:
    return (
        transmitted.small_strain_a_over_h,
        np.broadcast_to(transmitted.rt_over_h, transmitted.a_over_h.shape),
        transmitted.load_parameter,
    )


def beyond(pressed: RowConditions, numbers: Sequence[float], contact_model: ContactModel) -> str:
    """What of ν, or of `numbers`, a/h, rT/h and L, is outside the table's domain, with F, R and E."""
    if pressed.poisson_ratio != INCOMPRESSIBLE:
        return f"Poisson's ratio = {pressed.poisson_ratio:g}: the table is of incompressible elastomer, 0.5"
    over_h, rt_over_h, load = numbers
    force, radius, modulus = pressed.preload_n, pressed.indenter_radius_mm, pressed.youngs_modulus_mpa
    most_a, most_rt, most_load = (contact_model.domain[name][1] for name in ("a_over_h", "rt_over_h", "load_parameter"))
    row = f"F = {force:g} N, R = {radius:g} mm, E = {modulus:g} MPa, L = {load:.3g}, a/h = {over_h:.3g}"
    if rt_over_h > most_rt:  # first, since no force changes it
        return f"{row}: rT/h = {rt_over_h:.3g} exceeds {most_rt:g}: the sensor is too large for this thickness"
    if load > most_load:
        most = most_load * radius**2 * modulus
        slip = "; is the preload in mN?" if force >= _LIKE_MILLI and force / 1000 <= most else ""
        return f"{row}: L = {load:.3g} exceeds {most_load:g}: at most {most:.3g} N with this sphere{slip}"
    at_most, at_row = contact_model.load_over_cube(np.array([most_a, over_h]))[0].tolist()
    most = force * (most_a / over_h) ** 3 * (at_most / at_row)
    return f"{row}: a/h = {over_h:.3g} exceeds {most_a:g}: at most {most:.3g} N with this sphere"

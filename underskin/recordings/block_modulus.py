"""The modulus that the first loading branch of a compressed or pulled sample tells. SI inside.

Two laws are tried, each over the first part of the curve that it holds: the incompressible neo-Hookean solid between
smooth platens, nominal stress = (E/3)(λ⁻² − λ) with λ = 1 − strain, compression positive; and Hooke's straight line,
nominal stress = E strain. That which holds over more strain is the sample's; where both hold equally far the line if it
leaves less, else the neo-Hookean one.
"""

from dataclasses import dataclass

import numpy as np

from underskin.recordings.campaign import CompressionRecording
from underskin.recordings.loading_branch import FEWEST, loading_branch
from underskin.units import Floats, to_lab, to_si

# Largest departure from a law: of the stress that it spans, of the stress there, and of that of the whole curve
_STRAIGHT, _LOCALLY, _LEAST = 0.012, 0.05, 2e-3
_LEAVES = 0.02  # departure from it, of the stress, at which the curve no longer follows the law
_EARLY = 0.1  # the first such part starts below this share of the stress at its end
_POINTS = 400
_LEAST_STRETCH = 0.05  # of λ: a sample that is pressed to less is none
_FOOT_ROUNDS = 2  # by which the foot of the curve is found, from which strain counts
_FOOT = 0.01  # of the strain at a part's end: a part that starts nearer to the foot starts at it
_SMOOTH = 5  # degree of the polynomial that stands for a curve of few points
_LONGER = 1.15  # times as much strain: a law that holds over so much more is the better one
_BETTER = 0.8  # of the other's departure: of two that hold equally far, the line is the better law then


@dataclass(frozen=True)
class CompressionModulus:
    """E by the law that holds over the first part of the curve [Pa], its standard uncertainty, the part's ends, and
    where the curve leaves the law.

    Strains count from the foot of the curve, compression or tension positive. `leaves_at_strain` and `leaves_at_stress`
    are None where the curve follows the law to its end; `departure` is the root mean square of what it leaves of the
    part, over the stress that it spans. The uncertainty holds noise and the change of slope within the part;
    friction at the platens and the sample's size are not in it.
    """

    modulus: float
    uncertainty: float
    first_strain: float
    last_strain: float
    leaves_at_strain: float | None
    leaves_at_stress: float | None
    is_straight: bool
    departure: float

    @property
    def statement(self) -> str:
        """Which law, and where it holds, in words."""
        law = "straight" if self.is_straight else "neo-Hookean"
        first = 0.0 if abs(self.first_strain) < _FOOT * self.last_strain else self.first_strain
        follows = f"{law} from {100 * first:.3g} to {100 * self.last_strain:.3g} % strain"
        if self.leaves_at_strain is None or self.leaves_at_stress is None:
            return f"{follows}, and not seen to leave the {'line' if self.is_straight else 'law'}"
        stress = float(to_lab("mean_stress_mpa", self.leaves_at_stress))
        off = "line" if self.is_straight else "law"
        return f"{follows}; leaves the {off} at {stress:.3g} MPa, {100 * self.leaves_at_strain:.3g} % from its foot"


def of_compression(recording: CompressionRecording) -> CompressionModulus:
    """The modulus of a `compression` recording."""
    return compression_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("sample_height_mm", recording.sample_height_mm)),
        float(to_si("sample_diameter_mm", recording.sample_diameter_mm)),
    )


def compression_modulus(displacement: Floats, force: Floats, height: float, diameter: float) -> CompressionModulus:
    """The modulus of a cylinder; compression positive, or tension with both negative.

    Raises InvalidInput where the loading branch has too few points, or does not load.
    """
    along, load = loading_branch(displacement, force)
    stress = load / (np.pi / 4 * diameter**2)
    sign = 1.0 if stress[-1] >= stress[0] else -1.0
    noise = _noise(along, stress) / np.sqrt(max(1.0, len(along) / _POINTS))
    foot = float(along[np.abs(load).argmin()])
    line = _by_law(along, stress, height, sign, noise, foot, straight=True)
    if (along.max() - foot) / height > 1 - _LEAST_STRETCH:  # through all of the sample: a slip of units
        return line
    neo_hookean = _by_law(along, stress, height, sign, noise, foot, straight=False)
    by_law, by_line = (one.last_strain - one.first_strain for one in (neo_hookean, line))
    if max(by_law, by_line) > _LONGER * min(by_law, by_line):
        return line if by_line > by_law else neo_hookean
    return line if line.departure < _BETTER * neo_hookean.departure else neo_hookean


def _by_law(
    along: Floats, stress: Floats, height: float, sign: float, noise: float, foot: float, *, straight: bool
) -> CompressionModulus:
    """By one law; `foot` is about where the stress is 0, `sign` 1 where it grows with the displacement's pressing."""
    for _ in range(_FOOT_ROUNDS):
        strain, binned = _thinned(sign * (along - foot) / height, sign * stress)
        stretched = strain if straight else sign * _neo_hookean(sign * strain)
        first, last = _first_straight(stretched, binned, noise)
        part = slice(first, last + 1)
        slope, level = (float(value) for value in np.polyfit(stretched[part], binned[part], 1))
        if not slope > 0 or straight:
            break
        foot -= sign * height * level / slope
    middle = (first + last + 1) // 2
    halves = [
        np.polyfit(stretched[half], binned[half], 1)[0] for half in (slice(first, middle), slice(middle, last + 1))
    ]
    span = stretched[part] - stretched[part].mean()
    rest = binned[part] - level - slope * stretched[part]
    by_noise = noise / np.sqrt(span @ span)
    leaves = _leaves(stretched, binned, slope, level, last, noise)
    foot_strain = -level / slope if straight and slope else 0.0  # else counted from there already
    return CompressionModulus(
        modulus=slope,
        uncertainty=float(np.hypot(by_noise, (halves[1] - halves[0]) / np.sqrt(12))),
        first_strain=float(strain[first] - foot_strain),
        last_strain=float(strain[last] - foot_strain),
        leaves_at_strain=None if leaves is None else float(strain[leaves] - foot_strain),
        leaves_at_stress=None if leaves is None else float(binned[leaves]),
        is_straight=straight,
        departure=float(np.sqrt(np.mean(rest**2)) / max(float(np.ptp(binned[part])), 1e-300)),
    )


def _neo_hookean(strain: Floats) -> Floats:
    """Nominal stress over E at strains, compression positive."""
    stretch = np.maximum(1.0 - strain, _LEAST_STRETCH)
    return np.asarray((stretch**-2 - stretch) / 3)


def _thinned(strain: Floats, stress: Floats) -> tuple[Floats, Floats]:
    """Means over equal bins of strain, in order."""
    bins = np.clip(((strain - strain.min()) / np.ptp(strain) * _POINTS).astype(int), 0, _POINTS - 1)
    _, member, count = np.unique(bins, return_inverse=True, return_counts=True)
    return np.bincount(member, strain) / count, np.bincount(member, stress) / count


def _noise(along: Floats, values: Floats) -> float:
    """Of one point: by the second difference, which a smooth curve of many points hardly has, and at most by what a
    smooth polynomial leaves, since few points bend from one to the next by more than their noise."""
    if len(values) < 3:
        return 0.0
    by_difference = float(1.4826 * np.median(np.abs(np.diff(values, n=2))) / np.sqrt(6))
    place = 2 * (along - along.min()) / np.ptp(along) - 1
    degree = min(_SMOOTH, len(values) - 3)
    powers = np.polynomial.legendre.legvander(place, degree)
    left = values - powers @ np.linalg.lstsq(powers, values, rcond=None)[0]
    freedom = max(len(values) - degree - 1, 1)
    return min(by_difference, float(np.sqrt(left @ left / freedom)))


def _first_straight(strain: Floats, stress: Floats, noise: float) -> tuple[int, int]:
    """First and last point of the longest straight part among those that start early.

    A toe is passed over, a start that is steeper is not: there the stress lies below the line.
    """
    best = (0, min(len(strain), FEWEST) - 1)
    least = _LEAST * float(np.ptp(stress))
    for first in range(0, len(strain) - FEWEST, max(1, len(strain) // 100)):
        for last in range(len(strain) - 1, first + FEWEST - 2, -max(1, len(strain) // 200)):
            if strain[last] - strain[first] <= strain[best[1]] - strain[best[0]]:
                break
            if stress[first] > _EARLY * stress[last]:
                continue
            part = slice(first, last + 1)
            middle, level = float(strain[part].mean()), float(stress[part].mean())
            x, y = strain[part] - middle, stress[part] - level
            rest = stress - level - (x @ y) / (x @ x) * (strain - middle)
            most = _STRAIGHT * (stress[last] - stress[first])
            allowed = np.minimum(most, _LOCALLY * np.abs(stress[part]) + least) + 4 * noise
            if (np.abs(rest[part]) <= allowed).all() and (rest[:first] >= -most - 4 * noise).all():
                best = (first, last)
                break
    return best


def _leaves(strain: Floats, stress: Floats, slope: float, level: float, last: int, noise: float) -> int | None:
    """The first point from which on the curve stays off the line."""
    line = level + slope * strain
    off = np.abs(stress - line) > _LEAVES * np.abs(stress) + 3 * noise
    off[: last // 2] = False
    staying = np.flatnonzero(~off)
    start = int(staying[-1]) + 1 if len(staying) else last
    return start if start < len(strain) else None

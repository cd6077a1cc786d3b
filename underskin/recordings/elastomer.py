"""The elastomer's modulus from the same bench: a compressed cylinder, or a sphere pressed in. SI inside.

Compression: nominal stress F/A over nominal strain d/H; the modulus is the slope of the first part that is straight.
Indentation: Hertz on a half space, F = F0 + (4/3) E/(1 − ν²) √R (d − d0)^(3/2), with the contact point d0 free.
Both use the first loading branch, up to the largest force.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from underskin.errors import InvalidInput, too_few, unequal_lengths, unusable
from underskin.recordings.campaign import Campaign, CompressionRecording, CurveRecording, IndentationRecording
from underskin.recordings.exchanged_columns import look_exchanged
from underskin.units import Floats, to_lab, to_si

_STRAIGHT = 0.02  # largest departure from a straight line, of the stress it spans
_LEAVES = 0.02  # departure from that line, of the stress, at which the curve is no longer linear
_EARLY = 0.1  # the first straight part starts below this share of the stress at its end
_POINTS = 400
_FEWEST = 8
_AIR = 5  # points before contact that make a force offset known


@dataclass(frozen=True)
class CompressionModulus:
    """Slope of the first straight part [Pa], its standard uncertainty, its ends, and where the curve leaves it.

    `leaves_at_strain` and `leaves_at_stress` are None where the curve stays straight to its end. The uncertainty holds
    noise and the change of slope within the straight part; friction at the platens and the sample's size are not in it.
    """

    modulus: float
    uncertainty: float
    first_strain: float
    last_strain: float
    leaves_at_strain: float | None
    leaves_at_stress: float | None

    @property
    def statement(self) -> str:
        """Where it is straight, in words."""
        straight = f"straight from {100 * self.first_strain:.3g} to {100 * self.last_strain:.3g} % strain"
        if self.leaves_at_strain is None or self.leaves_at_stress is None:
            return f"{straight}, and not seen to leave the line"
        stress = float(to_lab("mean_stress_mpa", self.leaves_at_stress))
        return f"{straight}; leaves the line at {stress:.3g} MPa, {100 * self.leaves_at_strain:.3g} % from its foot"


@dataclass(frozen=True)
class IndentationModulus:
    """Hertz' modulus [Pa] with its standard uncertainty, the contact point d0 [m] and what the fit leaves [N].

    The uncertainty goes by the residuals and their correlation from point to point. `residual` far above the sensor's
    noise says that Hertz is not the whole story, and that E is a number for this curve only.
    """

    modulus: float
    uncertainty: float
    contact_point: float
    residual: float

    @property
    def statement(self) -> str:
        """Where contact begins and what Hertz leaves, in words."""
        contact = float(to_lab("displacement_mm", self.contact_point))
        return f"Hertz, contact from {contact:.4g} mm; it leaves {self.residual:.2g} N (root mean square)"


@dataclass(frozen=True)
class RecordingModulus:
    """What a recording says of the elastomer; `result` is the reason where it says nothing."""

    recording: str
    kind: str
    result: CompressionModulus | IndentationModulus | InvalidInput


def of_campaign(campaign: Campaign) -> list[RecordingModulus]:
    """What each recording of kind `compression` or `indentation` says of the elastomer."""
    moduli = []
    for recording in campaign.recordings:
        result: CompressionModulus | IndentationModulus | InvalidInput
        try:
            if isinstance(recording, CompressionRecording):
                _require_height(recording)
                result = of_compression(recording)
            elif isinstance(recording, IndentationRecording):
                result = of_indentation(recording, campaign.skin.poisson_ratio)
            else:
                continue
            if not result.modulus > 0:
                raise unusable("force_n", None, "must rise with the displacement: no modulus follows from a fall")
        except InvalidInput as error:
            result = error
        moduli.append(RecordingModulus(recording.id, recording.kind, result))
    return moduli


def of_compression(recording: CompressionRecording) -> CompressionModulus:
    """The modulus of a `compression` recording."""
    require_own_columns(recording)
    return compression_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("sample_height_mm", recording.sample_height_mm)),
        float(to_si("sample_diameter_mm", recording.sample_diameter_mm)),
    )


def of_indentation(recording: IndentationRecording, poisson_ratio: float) -> IndentationModulus:
    """The modulus of an `indentation` recording."""
    require_own_columns(recording)
    return indentation_modulus(
        to_si("displacement_mm", recording.displacement_mm),
        to_si("force_n", recording.force_n),
        float(to_si("indenter_radius_mm", recording.indenter_radius_mm)),
        poisson_ratio,
    )


def _require_height(recording: CompressionRecording) -> None:
    """Raises InvalidInput where a block would be pressed by more than its height, from where its force is least."""
    if len(recording.displacement_mm) != len(recording.force_n):
        return
    rest = recording.displacement_mm[np.argmin(np.abs(recording.force_n))]
    moved = float(np.max(recording.displacement_mm) - rest)
    if moved >= recording.sample_height_mm:
        height = f"must stay below sample_height_mm, {recording.sample_height_mm:g}"
        raise unusable("displacement_mm", moved, f"{height}: is it in mm, or exchanged with force_n, or tension?")


def require_own_columns(recording: CurveRecording) -> None:
    """Raises InvalidInput where force and displacement of a curve look exchanged."""
    is_sphere = isinstance(recording, IndentationRecording)
    if look_exchanged(recording.displacement_mm, recording.force_n, sphere=is_sphere):
        seen = "moves as a force does, and force_n as a stage"
        raise unusable("displacement_mm", seen, "the two columns look exchanged: exchange their names or channels")


def compression_modulus(displacement: Floats, force: Floats, height: float, diameter: float) -> CompressionModulus:
    """The modulus of a cylinder; compression positive, or tension with both negative.

    Raises InvalidInput where the loading branch has too few points, or does not load.
    """
    strain, stress = _loading(displacement / height, force / (np.pi / 4 * diameter**2))
    sign = 1.0 if stress[-1] >= stress[0] else -1.0
    noise = _noise(stress)
    strain, stress = _thinned(sign * strain, sign * stress)
    noise /= np.sqrt(max(1.0, len(displacement) / _POINTS))
    first, last = _first_straight(strain, stress, noise)
    part = slice(first, last + 1)
    slope, level = np.polyfit(strain[part], stress[part], 1)
    middle = (first + last + 1) // 2
    halves = [np.polyfit(strain[half], stress[half], 1)[0] for half in (slice(first, middle), slice(middle, last + 1))]
    span = strain[part] - strain[part].mean()
    by_noise = noise / np.sqrt(span @ span)
    leaves = _leaves(strain, stress, slope, level, last, noise)
    return CompressionModulus(
        modulus=float(slope),
        uncertainty=float(np.hypot(by_noise, (halves[1] - halves[0]) / np.sqrt(12))),
        first_strain=float(strain[first]),
        last_strain=float(strain[last]),
        leaves_at_strain=None if leaves is None else float(strain[leaves] + level / slope),
        leaves_at_stress=None if leaves is None else float(stress[leaves]),
    )


def indentation_modulus(displacement: Floats, force: Floats, radius: float, poisson_ratio: float) -> IndentationModulus:
    """Hertz' modulus with a free contact point, and a free force offset where points before contact show it.

    Raises InvalidInput where the loading branch has too few points, does not load, or leaves the modulus open.
    """
    depth, load = _loading(displacement, force)
    contact = _contact_point(depth, load, offset=True)
    with_offset = int((depth < contact).sum()) >= _AIR
    if not with_offset:
        contact = _contact_point(depth, load, offset=False)
    design = _hertz_design(depth, contact, with_offset)
    fitted = np.linalg.lstsq(design, load, rcond=None)[0]
    residual = load - design @ fitted
    # d0 is a parameter as well: its column is the slope of the model.
    slope = -1.5 * fitted[0] * np.sqrt(np.maximum(depth - contact, 0))
    jacobian = np.column_stack([design, slope])
    freedom = max(1, len(load) - jacobian.shape[1])
    variance = float(residual @ residual) / freedom * _correlation_factor(residual)
    deviation = float(np.sqrt(variance)) * _amplification(jacobian)
    per_stiffness = 0.75 * (1 - poisson_ratio**2) / np.sqrt(radius)
    return IndentationModulus(
        modulus=float(fitted[0] * per_stiffness),
        uncertainty=float(deviation * per_stiffness),
        contact_point=contact,
        residual=float(np.sqrt(np.mean(residual**2))),
    )


def _amplification(jacobian: Floats) -> float:
    """The first parameter's standard deviation over that of the noise; raises InvalidInput where it has none."""
    size = np.linalg.norm(jacobian, axis=0)
    shape = jacobian / np.where(size > 0, size, 1)
    normal = shape.T @ shape
    if np.linalg.matrix_rank(normal, hermitian=True) < len(normal):
        allowed = "must tell the modulus from the contact point: more samples in contact"
        raise unusable("displacement_mm", f"{np.count_nonzero(jacobian[:, 0])} samples in contact", allowed)
    return float(np.sqrt(np.linalg.inv(normal)[0, 0]) / size[0])


def _loading(along: Floats, load: Floats) -> tuple[Floats, Floats]:
    """The branch up to the largest load."""
    if len(along) != len(load):
        raise unequal_lengths("force_n", len(load), len(along), "displacement_mm")
    top = int(np.argmax(np.abs(load - load[0])))
    if top + 1 < _FEWEST:
        raise too_few("force_n", f"largest at entry {top}", f"must load over at least {_FEWEST} entries")
    if along[top] == along[0]:
        raise unusable("displacement_mm", float(along[top]), "must change while the force rises")
    return along[: top + 1], load[: top + 1]


def _thinned(strain: Floats, stress: Floats) -> tuple[Floats, Floats]:
    """Means over equal bins of strain, in order."""
    bins = np.clip(((strain - strain.min()) / np.ptp(strain) * _POINTS).astype(int), 0, _POINTS - 1)
    _, member, count = np.unique(bins, return_inverse=True, return_counts=True)
    return np.bincount(member, strain) / count, np.bincount(member, stress) / count


def _noise(values: Floats) -> float:
    """Of one point, by the second difference, which a smooth curve hardly has."""
    return float(1.4826 * np.median(np.abs(np.diff(values, n=2))) / np.sqrt(6)) if len(values) > 2 else 0.0


def _first_straight(strain: Floats, stress: Floats, noise: float) -> tuple[int, int]:
    """First and last point of the longest straight part among those that start early (a toe is passed over)."""
    best = (0, min(len(strain), _FEWEST) - 1)
    for first in range(0, len(strain) - _FEWEST, max(1, len(strain) // 100)):
        for last in range(len(strain) - 1, first + _FEWEST - 2, -max(1, len(strain) // 200)):
            if strain[last] - strain[first] <= strain[best[1]] - strain[best[0]]:
                break
            if stress[first] > _EARLY * stress[last]:
                continue
            part = slice(first, last + 1)
            x, y = strain[part] - strain[part].mean(), stress[part] - stress[part].mean()
            rest = np.abs(y - (x @ y) / (x @ x) * x)
            if rest.max() <= _STRAIGHT * (stress[last] - stress[first]) + 4 * noise:
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


def _hertz_design(depth: Floats, contact: float, offset: bool) -> Floats:
    pressed = np.maximum(depth - contact, 0) ** 1.5
    return np.column_stack([pressed, np.ones_like(pressed)]) if offset else pressed[:, None]


def _contact_point(depth: Floats, load: Floats, *, offset: bool) -> float:
    """d0 of the least squares in force; before the first point where the recording starts in contact."""

    def misfit(contact: float) -> float:
        design = _hertz_design(depth, contact, offset)
        rest = load - design @ np.linalg.lstsq(design, load, rcond=None)[0]
        return float(rest @ rest)

    span = float(np.ptp(depth))
    guesses = np.linspace(depth.min() - (0 if offset else span), depth.max() - 0.02 * span, 200)
    best = int(np.argmin([misfit(float(guess)) for guess in guesses]))
    around = float(guesses[max(best - 1, 0)]), float(guesses[min(best + 1, len(guesses) - 1)])
    return float(minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": 1e-9 * span}).x)


def _correlation_factor(residual: Floats) -> float:
    """How much fewer independent points there are, for residuals that are alike from one to the next."""
    power = float(residual @ residual)
    if power == 0:
        return 1.0
    alike = float(np.clip(residual[1:] @ residual[:-1] / power, 0.0, 0.99))
    return (1 + alike) / (1 - alike)

"""The force of indentation curves by a sphere, sample by sample, under a set of mechanisms. SI.

Base model: Hertz on a half space, F = (4/3) E/(1 − ν²) √R (d − d0)^(3/2), with the contact point d0 and, where none is
declared, E free; for deep indentation Sneddon's law of the sphere; and `strain_share` of the effect of finite strain on
the depth. Stages: declared value → material → contact radius, depth and force together with the stage's compliance,
through the history where the body relaxes. Zero, drift and gain of the load cell are in the covariance
(diagnosis/noise).

The contact, elastic and relaxing, is in sphere_contact.

Arrays are (points, curves, samples), with 1 where nothing differs: points of the fit coordinates, samples of a curve.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Parameter
from underskin.mechanisms.laws.adhesion import Adhesion as AdhesionLaw
from underskin.mechanisms.models.composition import (
    STRAIN_SHARE,
    contact_point,
    modulus_parameter,
    required_modulus,
    thickness_parameter,
)
from underskin.mechanisms.models.curve_state import Curve, Samples, numbers, speeds
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.mechanisms.models.sphere_contact import (
    Adhesion,
    Layers,
    Path,
    Sphere,
    Stiffening,
    edges,
    in_contact,
    layer_ratios,
    relaxing,
    relaxing_on_stage,
)
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording, SkinDescription
from underskin.recordings.curve_course import (
    curve_landmarks,
    presses_again,
    snap_in_interval,
    touch,
    visible_contact,
)
from underskin.recordings.modulus import estimate
from underskin.units import Floats, Mask, to_si

_CONTACT_SD, _CONTACT_BOUND = 0.1, 0.8  # of the range of displacement: the contact point's prior and bounds


class IndentationModel(CurveModel):
    """The force of indentations under a set of mechanisms.

    For measured curves, contact points and an undeclared modulus have priors around the base model's own fits. For
    conditions alone the priors are those of the declared modulus, with contact at displacement 0.
    """

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Compute all that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = conditions.of(IndentationConditions)
        sticks = any(mechanism.name == AdhesionLaw.name for mechanism in mechanisms)
        nuisances = _nuisances(recordings, conditions.skin, sticks)
        super().__init__(mechanisms, conditions, "indentation", recordings, nuisances)
        self._ids = [recording.id for recording in recordings]
        stiffnesses = [recording.stage_stiffness_n_per_mm for recording in recordings]
        self._stage_compliance = np.array([0.0 if stage is None else 1e-3 / stage for stage in stiffnesses])[
            :, None
        ]  # m/N
        self._speed = speeds(self.displacement, self.time)
        self._radius = to_si("indenter_radius_mm", [recording.indenter_radius_mm for recording in recordings])[:, None]
        contacts = [_visible_contact(recording, sticks) for recording in recordings]
        self._seen, self._seen_contact = (
            self._arranged([masks[number].astype(float) for masks in contacts]) > 0 for number in (0, 1)
        )
        self.hidden_jumps = sticks and not bool(self._seen.all())
        middles = np.array([nuisance.start for nuisance in nuisances[len(nuisances) - len(recordings) :]])
        deepest = self.displacement.max(axis=1) - 1e-3 * middles
        # A sphere that moves in the air before it touches presses once
        travels = [
            np.maximum(recording.displacement_mm, middle) for recording, middle in zip(recordings, middles, strict=True)
        ]
        self._again = np.array([presses_again(travel) for travel in travels])
        self._deep = (deepest > PARABOLOID * self._radius[:, 0]).astype(float)[:, None]

    def _force(self, curve: Curve, contact: Floats, alike: bool) -> tuple[Floats, Mask]:
        travel = self.displacement - contact
        samples = Samples(self._ids, travel, self.time, self._speed)
        for law in curve.laws:
            travel = law.pressed_travel(samples, travel)
        force, inside = self._force_at(curve, travel, alike)
        for law in curve.laws:
            force = law.measured_force(samples, force)
        return force, inside

    def _force_at(self, curve: Curve, travel: Floats, alike: bool) -> tuple[Floats, Mask]:
        relaxation, adhesion = curve.relaxes, _adhesion(curve)
        sphere = self._sphere(curve, 1.0 if relaxation is None else relaxation.at_rest)
        if relaxation is not None:
            relaxing_force = relaxing if curve.stage_stiffness is None else relaxing_on_stage
            return self._relaxing(
                sphere, partial(relaxing_force, sphere, relaxation, adhesion), adhesion, travel, alike
            )
        if adhesion is None:
            depth = np.maximum(travel, 0.0)
            a = sphere.radius_at(depth, None)
            force = np.where(travel > 0, sphere.at(a)[0], 0.0)
            return force, sphere.inside(a) | (travel <= 0)
        contact_mask = self._as_seen(in_contact(travel, self._last_travel(sphere, adhesion.separation)), alike)
        a = edges(
            sphere, travel, contact_mask, adhesion.work, adhesion.separation if curve.work_of_separation else None
        )
        force = np.where(contact_mask, sphere.force_at(travel, a), 0.0)
        return force, sphere.inside(a) | ~contact_mask

    def _as_seen(self, contact_mask: Mask, alike: bool) -> Mask:
        """The contact as snap-in and pull-off show it: they are events, whose place no law of equilibrium predicts to a
        sample. Of points that are `alike`, the first one's, for all."""
        seen = np.where(self._seen, self._seen_contact, contact_mask[:1] if alike else contact_mask)
        return np.broadcast_to(seen, contact_mask.shape)

    def _last_travel(self, sphere: Sphere, work: Floats) -> Floats:
        """The travel at which contact ends (points, curves, 1): where δ + F/k is least under the stage known to be
        compliant (although its deflection has been subtracted), else under the sphere's own stage."""
        least, travel = sphere.pull_off(work)
        if np.any(self._stage_compliance):
            on_stage = replace(sphere, compliance=sphere.compliance + self._stage_compliance)
            radius, _ = on_stage.pull_off(work)
            travel = np.where(self._stage_compliance > 0, sphere.travel(np.maximum(radius, least), work), travel)
        return travel

    def _relaxing(
        self,
        sphere: Sphere,
        force_on: Callable[[Path], tuple[Floats, Mask]],
        adhesion: Adhesion | None,
        travel: Floats,
        alike: bool,
    ) -> tuple[Floats, Mask]:
        """As `_force_at` through the history, which begins at the touch of a recording, between two samples."""
        path = _with_touch(travel, self.time, self._again)
        force, own_contact = force_on(path)
        own_contact = own_contact & (travel >= 0).cumsum(axis=-1).astype(bool)  # the touch lies after its sample
        contact_mask = self._as_seen(own_contact, alike)
        force = np.where(contact_mask, force, 0.0)
        if sphere.layers is None:  # a half space, which has no tables to leave
            return force, np.ones_like(contact_mask)
        least = sphere.pull_off(None if adhesion is None else adhesion.work)[0]
        a = sphere.radius_at(np.maximum(path.travel, 0.0), None, least)
        return force, sphere.inside(a) | ~contact_mask

    def _sphere(self, curve: Curve, at_rest: Floats | float) -> Sphere:
        """With E(0), which is `at_rest` times the stated modulus."""
        poisson_ratio = numbers(curve.poisson_ratio)
        layers = None
        if curve.layered:
            assert curve.thickness is not None
            poisson_ratios = poisson_ratio.ravel().tolist()
            distinct = poisson_ratios[:1] if len(set(poisson_ratios)) == 1 else poisson_ratios
            layers = Layers(numbers(curve.thickness), [layer_ratios(value) for value in distinct])
        stiffening = None if curve.stiffening is None else Stiffening(*map(numbers, curve.stiffening))
        compliance = 0.0 if curve.stage_stiffness is None else 1.0 / numbers(curve.stage_stiffness)
        reduced = at_rest * numbers(curve.modulus) / (1 - poisson_ratio**2)
        assert curve.strain_share is not None
        return Sphere(reduced, self._radius, layers, stiffening, compliance, self._deep, numbers(curve.strain_share))


def _adhesion(curve: Curve) -> Adhesion | None:
    if curve.work_of_adhesion is None:
        return None
    work = numbers(curve.work_of_adhesion)
    return Adhesion(work, work if curve.work_of_separation is None else numbers(curve.work_of_separation))


def _with_touch(travel: Floats, time: Floats, again: Mask) -> Path:
    """The path with its last sample before contact moved to the touch, travel 0."""
    touched = travel >= 0
    first = np.where(touched.any(axis=-1), touched.argmax(axis=-1), travel.shape[-1])
    time = np.broadcast_to(time, travel.shape).copy()
    travel = travel.copy()
    point, curve = np.nonzero((first > 0) & (first < travel.shape[-1]))
    then = first[point, curve]
    before, after = travel[point, curve, then - 1], travel[point, curve, then]
    share = before / (before - after)
    time[point, curve, then - 1] += share * (time[point, curve, then] - time[point, curve, then - 1])
    travel[point, curve, then - 1] = 0.0
    first_contact = np.where((first > 0) & (first < travel.shape[-1]), first - 1, first)
    return Path(travel, time, first_contact, again)


def _visible_contact(recording: IndentationConditions, sticks: bool) -> tuple[Mask, Mask]:
    """As `visible_contact`; nothing shows of conditions alone, nor where nothing `sticks`."""
    if not (sticks and isinstance(recording, IndentationRecording)):
        nothing = np.zeros(len(recording.displacement_mm), dtype=bool)
        return nothing, nothing
    return visible_contact(recording.displacement_mm, recording.force_n, recording.time_s)


def _nuisances(recordings: Sequence[IndentationConditions], skin: SkinDescription, sticks: bool) -> list[Parameter]:
    """The nuisance parameters; raises InvalidInput where no measured curve loads, or one does not move.

    Where the contact `sticks`, a visible snap-in bounds the contact point.
    """
    estimates, contact_points, refused = [], [], None
    for recording in recordings:
        span = float(np.ptp(to_si("displacement_mm", recording.displacement_mm)))
        contact, interval = 0.0, None
        if isinstance(recording, IndentationRecording):
            features = curve_landmarks(recording.displacement_mm, recording.force_n, recording.time_s)
            force = recording.force_n - features.drift * times_of(recording)
            columns = [np.asarray(column, dtype=float).tobytes() for column in (recording.displacement_mm, force)]
            try:
                modulus, contact = _hertz(*columns, recording.indenter_radius_mm, skin.poisson_ratio)
                estimates.append(modulus if modulus > 0 else _secant_modulus(recording, skin.poisson_ratio))
            except InvalidInput as refusal:
                refused = refusal.at(f"recordings[{recording.id}].{refusal.field}")
                # A curve that does not load begins where it shows least force.
                contact = float(to_si("displacement_mm", recording.displacement_mm[int(np.abs(force).argmin())]))
            if features.snap_in is not None:
                contact = float(to_si("displacement_mm", touch(recording.displacement_mm, features.snap_in)))
            if refused is not None and span == 0:
                raise refused
            if sticks:
                interval = snap_in_interval(recording.displacement_mm, recording.force_n, recording.time_s)
        sd, bound = _CONTACT_SD * span, _CONTACT_BOUND * span
        if interval is not None:
            before, contact, after = (float(to_si("displacement_mm", place)) for place in interval)
            sd, bound = 0.5 * (after - before), after - before
        contact_points.append(contact_point(recording.id, contact, sd, bound))
    if refused is not None and not estimates:
        raise refused
    thickness = [] if skin.thickness_mm is None else [thickness_parameter(skin)]
    if not estimates:
        required_modulus(skin)
    return [modulus_parameter(skin, estimates), STRAIN_SHARE, *thickness, *contact_points]


def _secant_modulus(recording: IndentationRecording, poisson_ratio: float) -> float:
    """Hertz's modulus [Pa] from the ranges of force and travel, for a curve that does not load."""
    force, travel = (float(np.ptp(to_si(name, getattr(recording, name)))) for name in ("force_n", "displacement_mm"))
    radius = float(to_si("indenter_radius_mm", recording.indenter_radius_mm))
    return max(0.75 * (1 - poisson_ratio**2) * force / (np.sqrt(radius) * max(travel, 1e-300) ** 1.5), 1e-300)


@lru_cache(maxsize=1024)  # a diagnosis composes some dozen models of the same recordings
def _hertz(displacement_mm: bytes, force_n: bytes, radius_mm: float, poisson_ratio: float) -> tuple[float, float]:
    """Modulus [Pa] and contact point [m] of the base model's own fit."""
    fit = estimate(
        to_si("displacement_mm", np.frombuffer(displacement_mm)),
        to_si("force_n", np.frombuffer(force_n)),
        float(to_si("indenter_radius_mm", radius_mm)),
        poisson_ratio,
    )
    return fit.modulus, fit.contact_point

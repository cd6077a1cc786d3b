"""The force of indentation curves, sample by sample, under a set of mechanisms.

Base model: Hertz on a half space, F = (4/3) E/(1 − ν²) √R (d − d0)^(3/2), with the contact point d0 and, where none is
declared, E free; under a sphere that is pressed deep, Sneddon's law of the whole sphere in its place; and a share of
what finite strain adds to the depth. Stages: declared value → material → contact radius, depth and force together with
the stage's give, through the body's history where it relaxes. What the load cell adds, a zero, a drift and a gain,
stands in the covariance (diagnosis/noise).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from underskin.autodiff import constant
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.models.creeping_contact import Adhesion, Path, relaxing, relaxing_on_stage
from underskin.mechanisms.models.curve_state import Curve, Samples, numbers
from underskin.mechanisms.models.curves import CurveModel, declared_modulus, times_of
from underskin.mechanisms.models.nuisances import (
    STRAIN_SHARE,
    contact_point,
    modulus_parameter,
    required_modulus,
    thickness_parameter,
)
from underskin.mechanisms.models.sphere_contact import (
    Layers,
    Sphere,
    Stiffening,
    edges,
    in_contact,
    layer_ratios,
)
from underskin.mechanisms.parameter import Parameter
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import IndentationRecording
from underskin.recordings.conditions import Conditions, IndentationConditions, SkinDescription
from underskin.recordings.curve_course import course, touch
from underskin.recordings.sphere_modulus import estimate
from underskin.units import Floats, Mask, to_si

_CONTACT_SD, _CONTACT_BOUND = 0.1, 0.8  # of the range of displacement: the contact point's prior and bounds


class IndentationModel(CurveModel):
    """The force of indentations under a set of mechanisms.

    Of measured curves, contact points and an undeclared modulus have priors around the base model's own fits. Of
    conditions alone they are those expected of the declared modulus, with contact at displacement 0.
    """

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Work out everything that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = [entry for entry in conditions.recordings if isinstance(entry, IndentationConditions)]
        nuisances = _nuisances(recordings, conditions.skin)
        super().__init__(mechanisms, conditions, "indentation", recordings, nuisances)
        self._ids = [entry.id for entry in recordings]
        known = [entry.stage_stiffness_n_per_mm for entry in recordings]
        self._give = np.array([0.0 if stage is None else 1e-3 / stage for stage in known])[:, None]  # m/N
        self._radius = to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in recordings])[:, None]
        middles = np.array([nuisance.start for nuisance in nuisances[len(nuisances) - len(recordings) :]])
        deepest = self.displacement.max(axis=1) - 1e-3 * middles
        self._whole = (deepest > PARABOLOID * self._radius[:, 0]).astype(float)[:, None]

    def _curve(self, own: dict[str, Values], nuisances: Values) -> Curve:
        thickness = self._skin.thickness_mm
        modulus = declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"]
        curve = Curve(
            modulus=modulus,
            poisson_ratio=constant(self._skin.poisson_ratio, 0, modulus.value.shape[:-1]),
            strain_share=nuisances[STRAIN_SHARE.name],
            thickness=None if thickness is None else to_si("thickness_mm", thickness) * nuisances["thickness"],
        )
        for mechanism in self._mechanisms:
            mechanism.on_curve(curve, own[mechanism.name])
        return curve

    def _force(self, curve: Curve, contact: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        travel = self.displacement - contact
        samples = Samples(self._ids, travel, self.time)
        for law in curve.laws:
            travel = law.moved(samples, travel)
        force, held, inside = self._force_at(curve, travel, held)
        for law in curve.laws:
            force = law.read(samples, force)
        return force, held, inside

    def _force_at(self, curve: Curve, travel: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        sphere, adhesion = self._sphere(curve), _adhesion(curve)
        relaxation = curve.prony_pairs
        if relaxation is not None:
            on = relaxing if curve.stage_stiffness is None else relaxing_on_stage
            return self._relaxing(sphere, partial(on, sphere, relaxation, adhesion), adhesion, travel, held)
        if adhesion is None:
            depth = np.maximum(travel, 0.0)
            a = sphere.radius_at(depth, None)
            force = np.where(travel > 0, sphere.at(a)[0], 0.0)
            return force, travel > 0, sphere.inside(a) | (travel <= 0)
        if held is None:
            held = in_contact(travel, self._last_travel(sphere, adhesion.separation))
        a = edges(sphere, travel, held, adhesion.work, adhesion.separation if curve.work_of_separation else None)
        force = np.where(held, sphere.force_at(travel, a), 0.0)
        return force, held, sphere.inside(a) | ~held

    def _last_travel(self, sphere: Sphere, work: Floats) -> Floats:
        """The travel at which contact ends (points, curves, 1): where δ + F/k is least under the stage that is known to
        give although its deflection has been subtracted, else as the sphere's own stage has it."""
        least, travel = sphere.pull_off(work)
        if np.any(self._give):
            on_stage = replace(sphere, give=sphere.give + self._give)
            radius, _ = on_stage.pull_off(work)
            travel = np.where(self._give > 0, sphere.travel(np.maximum(radius, least), work), travel)
        return travel

    def _relaxing(
        self,
        sphere: Sphere,
        force_on: Callable[[Path], tuple[Floats, Mask]],
        adhesion: Adhesion | None,
        travel: Floats,
        held: Mask | None,
    ) -> tuple[Floats, Mask, Mask]:
        """The same through the history, which begins where a recording touches, between two samples."""
        path = _with_touch(travel, self.time)
        force, own = force_on(path)
        own = own & (travel >= 0).cumsum(axis=-1).astype(bool)  # the touch lies after its sample
        held = own if held is None else held
        force = np.where(held, force, 0.0)
        if sphere.layers is None:  # a half space, which has no tables to leave
            return force, held, np.ones_like(held)
        least = sphere.pull_off(None if adhesion is None else adhesion.work)[0]
        a = sphere.radius_at(np.maximum(path.travel, 0.0), None, least)
        return force, held, sphere.inside(a) | ~held

    def _sphere(self, curve: Curve) -> Sphere:
        poisson_ratio = numbers(curve.poisson_ratio)
        layers = None
        if curve.layered:
            assert curve.thickness is not None
            each = poisson_ratio.ravel().tolist()
            alike = each[:1] if len(set(each)) == 1 else each
            layers = Layers(numbers(curve.thickness), [layer_ratios(value) for value in alike])
        stiffening = None if curve.stiffening is None else Stiffening(*map(numbers, curve.stiffening))
        give = 0.0 if curve.stage_stiffness is None else 1.0 / numbers(curve.stage_stiffness)
        reduced = numbers(curve.modulus) / (1 - poisson_ratio**2)
        assert curve.strain_share is not None
        return Sphere(reduced, self._radius, layers, stiffening, give, self._whole, numbers(curve.strain_share))


def _adhesion(curve: Curve) -> Adhesion | None:
    if curve.work_of_adhesion is None:
        return None
    work = numbers(curve.work_of_adhesion)
    return Adhesion(work, work if curve.work_of_separation is None else numbers(curve.work_of_separation))


def _with_touch(travel: Floats, time: Floats) -> Path:
    """The path, with the touch, travel 0, in the place of the last sample before it."""
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
    begins = np.where((first > 0) & (first < travel.shape[-1]), first - 1, first)
    return Path(travel, time, begins)


def _nuisances(recordings: Sequence[IndentationConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisances' parameters; raises InvalidInput where no measured curve loads, or one does not move."""
    estimates, contact_points, refused = [], [], None
    for entry in recordings:
        span = float(np.ptp(to_si("displacement_mm", entry.displacement_mm)))
        begins = 0.0
        if isinstance(entry, IndentationRecording):
            seen = course(entry.displacement_mm, entry.force_n, entry.time_s)
            force = entry.force_n - seen.drift * times_of(entry)
            columns = [np.asarray(column, dtype=float).tobytes() for column in (entry.displacement_mm, force)]
            try:
                modulus, begins = _hertz(*columns, entry.indenter_radius_mm, skin.poisson_ratio)
                estimates.append(modulus if modulus > 0 else _secant_modulus(entry, skin.poisson_ratio))
            except InvalidInput as refusal:
                refused = refusal.at(f"recordings[{entry.id}].{refusal.field}")
                # A curve that does not load begins where it shows least force.
                begins = float(to_si("displacement_mm", entry.displacement_mm[int(np.abs(force).argmin())]))
            if seen.snap_in is not None:
                begins = float(to_si("displacement_mm", touch(entry.displacement_mm, seen.snap_in)))
            if refused is not None and span == 0:
                raise refused
        contact_points.append(contact_point(entry.id, begins, _CONTACT_SD * span, _CONTACT_BOUND * span))
    if refused is not None and not estimates:
        raise refused
    thickness = [] if skin.thickness_mm is None else [thickness_parameter(skin)]
    if not estimates:
        required_modulus(skin)
    return [modulus_parameter(skin, estimates), STRAIN_SHARE, *thickness, *contact_points]


def _secant_modulus(entry: IndentationRecording, poisson_ratio: float) -> float:
    """Of a curve that does not load: Hertz's modulus [Pa] of the range of force over the range of travel."""
    force, travel = (float(np.ptp(to_si(name, getattr(entry, name)))) for name in ("force_n", "displacement_mm"))
    radius = float(to_si("indenter_radius_mm", entry.indenter_radius_mm))
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

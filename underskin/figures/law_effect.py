"""The effect of a mechanism on the FRF of a reference rig, or on a force curve, at three strengths;
and mechanisms that act alike on FRFs of the reference campaign, and so are confused with each other.

The reference rig: h 2.5 mm, rT 1.5 mm, E 2 MPa, d33 at the centre of its prior; a sphere of 4 mm above a sensor,
preload 1 N, dynamic force 0.3 N, held for 60 s after 10,000 load cycles; its neighbours are 4 mm away. Curves: that
sphere pressed in by 0.4 mm, or a cylinder 30 mm wide and 15 mm high compressed by 40 %.

Each mechanism at its usual strength changes the relative response of every line. The part that d33, and the modulus and
the thickness within their priors, can absorb is projected out, at 1 % noise on each line; the cosine between the
remainders of two mechanisms measures their similarity: 1 where these recordings cannot distinguish them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.mechanisms import CATALOGUE, Kind, Mechanism, Model, Normal, Parameter, Stage, Unsupported, compose
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, to_lab

RIG = "h 2.5 mm, rT 1.5 mm, E 2 MPa, sphere radius 4 mm, preload 1 N, dynamic force 0.3 N, 60 s, 10,000 cycles"
STRENGTHS = (0.5, 1.0, 2.0)  # times the usual strength
_WEAKER = (0.25, 0.5, 1.0)  # where twice the usual one cannot be
_QUOTED_HZ = 30.0
_MAINS = 50.0 * np.arange(1, 7)[:, None] + np.array([-3.0, -1.5, -0.5, 0.0, 0.5, 1.5, 3.0])
_FREQUENCY = np.unique(np.concatenate([np.geomspace(1, 1000, 160), _MAINS.ravel()]))


@dataclass(frozen=True)
class EffectPanel:
    """Curves over the common axis: of the base model, and at each strength."""

    title: str
    base: Floats
    curves: tuple[Floats, ...]


@dataclass(frozen=True)
class LawEffect:
    """The common axis, logarithmic or not; the strengths in words; two panels: magnitude [pC/N] and phase [°] of an
    FRF, or force and its change [N] of a curve. `changes`: in words how much of the first each strength changes."""

    axis: str
    x: Floats
    logarithmic: bool
    strengths: tuple[str, ...]
    panels: tuple[EffectPanel, EffectPanel]

    @property
    def changes(self) -> tuple[str, ...]:
        """For an FRF at its largest change, at 30 Hz where that is uniform; for a curve at its largest force."""
        return tuple(self._change(*pair) for pair in zip(*(panel.curves for panel in self.panels), strict=True))

    def _change(self, first: Floats, second: Floats) -> str:
        base, other = (panel.base for panel in self.panels)
        if not self.logarithmic:
            at = int(np.argmax(base))
            return f"{_signed(100 * (first[at] / base[at] - 1))} % at the largest force"
        size = np.abs(first * np.exp(1j * np.radians(second)) - base * np.exp(1j * np.radians(other)))
        at = int(np.argmin(np.abs(self.x - _QUOTED_HZ)))
        at = int(np.argmax(size)) if size.max() > 1.001 * size[at] else at
        percent, degrees = 100 * (first[at] / base[at] - 1), second[at] - other[at]
        return f"{_signed(percent)} %, {_signed(degrees)}° at {float(f'{self.x[at]:.2g}'):g} Hz"


def _signed(value: float) -> str:
    """To two significant digits; rounding errors are 0."""
    return f"{float(f'{value:.2g}'):+g}".replace("-", "−") if abs(value) > 1e-6 else "0"


def law_effect(name: str, table: SigmaTable) -> LawEffect:
    """The effect of a mechanism of the catalogue on the reference rig.

    Raises
    ------
    Unsupported
        Where the rig lacks what the mechanism reads, such as a temperature.
    """
    kind = CATALOGUE[name].kinds[0]
    campaign = drawn_campaign(kind)
    base, with_it = compose([], campaign, table, kind), compose([name], campaign, table, kind)
    drawn = base.recording == len(campaign.recordings) - 1
    nuisances = [parameter.start for parameter in base.parameters]
    parameters = with_it.parameters[: len(with_it.parameters) - len(base.parameters)]
    rows = strengths(parameters)
    without = np.asarray(base.predict(np.array(nuisances)).value[drawn])
    results = [_excursion(with_it, parameters, np.array([*row, *nuisances]), drawn) for row in rows]
    words = tuple(_in_words(parameters, row) for row in rows)
    recording = campaign.recordings[-1]
    if isinstance(recording, FrfRecording):
        magnitude, phase = (
            EffectPanel(title, of(without), tuple(map(of, results)))
            for title, of in (("magnitude, pC/N", _magnitude), ("phase, degrees", _phase))
        )
        return LawEffect("frequency, Hz", _FREQUENCY, True, words, (magnitude, phase))
    force = EffectPanel("force, N", without, tuple(results))
    changes = tuple(result - without for result in results)
    change = EffectPanel("change of force, N", np.zeros_like(without), changes)
    return LawEffect("displacement, mm", recording.displacement_mm, False, words, (force, change))


def lacking(mechanism: Mechanism) -> str | None:
    """What the reference rig lacks for the mechanism, in words; None where it can be drawn."""
    kind = mechanism.kinds[0]
    return mechanism.unsupported(drawn_campaign(kind), kind)


def strengths(parameters: Sequence[Parameter]) -> list[list[float]]:
    """Fit coordinates of the parameters at each of three strengths; once without a strength parameter."""
    if all(parameter.limit is None for parameter in parameters):
        return [[usual(parameter) for parameter in parameters]]
    for factors in (STRENGTHS, _WEAKER):
        rows = [[_scaled(parameter, factor) for parameter in parameters] for factor in factors]
        pairs = [pair for row in rows for pair in zip(parameters, row, strict=True)]
        if all(parameter.bounds[0] <= at <= parameter.bounds[1] for parameter, at in pairs):
            break
    return [
        [float(np.clip(at, *parameter.bounds)) for parameter, at in zip(parameters, row, strict=True)] for row in rows
    ]


def drawn_campaign(kind: Kind) -> Campaign:
    """The reference campaign of a kind; the last recording is the one that is drawn, of curves the only one."""
    campaign = reference_campaign(kind)
    first, *others = campaign.recordings
    if not isinstance(first, FrfRecording):
        return replace(campaign, recordings=tuple(others))
    sensor = campaign.skin.sensors[0]
    drawn = replace(
        first,
        id="drawn",
        sensor=sensor.id,
        indenter_radius_mm=4.0,
        preload_n=1.0,
        dynamic_force_n=0.3,
        position_mm=(sensor.x_mm, sensor.y_mm),
        load_cycles=10_000,
        dwell_s=60.0,
        frequency_hz=_FREQUENCY,
        frf_re_pc_per_n=np.full(len(_FREQUENCY), 5.0),
        frf_im_pc_per_n=np.zeros(len(_FREQUENCY)),
    )
    return replace(campaign, recordings=(*campaign.recordings, drawn))


def _excursion(model: Model, parameters: Sequence[Parameter], fit: Floats, rows: Array) -> Array:
    """The FRF [C/N] or the force [N]; for a mechanism that acts on the scatter only, one standard deviation away."""
    prediction = model.predict(fit)
    value = prediction.value[rows]
    if any(parameter.acts_on == "line_variance" for parameter in parameters):
        return np.asarray(value + np.sqrt(prediction.pickup_variance[rows] / 2) * (1 + 1j))
    spread = [
        parameter.from_fit(at)
        for parameter, at in zip(parameters, fit, strict=False)
        if parameter.acts_on == "gain_spread"
    ]
    return np.asarray(value * np.exp(sum(spread)))


def _magnitude(frf: Array) -> Floats:
    return np.asarray(to_lab("frf_pc_per_n", np.abs(frf)))


def _phase(frf: Array) -> Floats:
    return np.asarray(np.degrees(np.angle(frf)))


def usual(parameter: Parameter) -> float:
    """The fit coordinate used in figures."""
    return parameter.typical if parameter.shown is None else parameter.to_fit(parameter.shown)


def _scaled(parameter: Parameter, factor: float) -> float:
    """`factor` times the distance from the limit; shape parameters are unchanged."""
    middle = usual(parameter)
    if parameter.limit is None:
        return middle
    limit = None if parameter.moves_covariance else parameter.fit_limit
    if limit is not None:
        return limit + factor * (middle - limit)
    return middle + float(np.log(factor)) * (-1 if parameter.limit == np.inf else 1)


def _in_words(parameters: Sequence[Parameter], row: Sequence[float]) -> str:
    """The strengths with their units."""
    words = [
        f"{parameter.name.replace('_', ' ')} {float(f'{parameter.from_fit(at):.2g}'):g} {parameter.unit}".removesuffix(
            " -"
        )
        for parameter, at in zip(parameters, row, strict=True)
        if parameter.limit is not None
    ]
    return ", ".join(words) or "with it"


_NOISE = 0.01  # of each line, relative


@dataclass(frozen=True)
class Twin:
    """Another mechanism and its similarity (0 to 1); axes of a campaign, and kinds of recordings, on which only one
    of the two shows."""

    name: str
    alike: float
    axes: tuple[str, ...]
    kinds: tuple[str, ...]


def law_twins(table: SigmaTable) -> Mapping[str, tuple[Twin, ...]]:
    """For each mechanism of FRFs that changes their mean all the others, the most similar first."""
    campaign = reference_campaign("frf")
    base = compose([], campaign, table)
    start = [parameter.start for parameter in base.parameters]
    prediction = base.predict(np.array(start))
    nuisances = np.array([_relative(slope, prediction.value) for slope in prediction.slopes])
    priors = np.diag(
        [parameter.prior.sd**-2 if isinstance(parameter.prior, Normal) else 0.0 for parameter in base.parameters]
    )
    projection = np.linalg.inv(nuisances @ nuisances.T + priors) @ nuisances
    directions: dict[str, Floats] = {}
    for name, mechanism in CATALOGUE.items():
        if not mechanism.acts_on_frfs or not mechanism.moves_predictions:
            continue
        try:
            model = compose([name], campaign, table)
        except Unsupported:
            continue
        parameters = model.parameters[: len(model.parameters) - len(base.parameters)]
        if any(parameter.moves_covariance for parameter in parameters):
            continue
        fit = np.array([*(usual(parameter) for parameter in parameters), *start])
        change = _relative(model.predict(fit).value - prediction.value, prediction.value)
        change = change - nuisances.T @ (projection @ change)
        directions[name] = change / np.linalg.norm(change)
    return {name: _ranked_twins(name, directions) for name in directions}


def _relative(change: Array, response: Array) -> Floats:
    """Real and imaginary part over the response's magnitude, in standard deviations of the noise."""
    relative = change / np.abs(response) / _NOISE
    return np.concatenate([relative.real, relative.imag])


def _ranked_twins(name: str, directions: Mapping[str, Floats]) -> tuple[Twin, ...]:
    mechanism = CATALOGUE[name]
    twins = []
    for other in directions:
        if other != name:
            rival = CATALOGUE[other]
            distinguishing = _in_only_one(_axes(mechanism), _axes(rival)), _in_only_one(mechanism.kinds, rival.kinds)
            twins.append(Twin(other, float(abs(directions[name] @ directions[other])), *distinguishing))
    return tuple(sorted(twins, key=lambda twin: -twin.alike))


def _axes(mechanism: Mechanism) -> tuple[str, ...]:
    """Axes on which it shows; a lab's own law of lines names those that it reads, and changes the phase too."""
    return (*mechanism.axes, "phase") if mechanism.stage is Stage.LINES else mechanism.axes


def _in_only_one(first: Sequence[str], second: Sequence[str]) -> tuple[str, ...]:
    """Names in only one of two lists, in their order."""
    return tuple(name for name in dict.fromkeys((*first, *second)) if (name in first) != (name in second))

"""Laws that nobody listed, of indentation curves: what they change from sample to sample, over depth, force or time.

Where they enter: the force of the contact, F (1 + u), as the modulus has it where nothing sticks and no stage gives;
the gain of the cell, F (1 + u); the force that the cell reads, F + u; the place of the surface along the travel, d + u.
What they follow: the depth beyond the contact point, the force of the contact, the time since a recording began. Forms
are those of laws over recordings (forms.py), with powers and with a step where the sphere turns back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import ClassVar

import numpy as np

from underskin.autodiff import Differentiated, exp
from underskin.mechanisms.base import Kind, Stage, Values
from underskin.mechanisms.models.curve_state import Curve, Samples
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.mechanisms.unnamed.axes import Axis
from underskin.mechanisms.unnamed.forms import Feature, Shape, shapes
from underskin.mechanisms.unnamed.laws import PREFIX, Spoken, UnnamedLaw, changes
from underskin.mechanisms.unnamed.vocabulary import ActsOn, Form
from underskin.units import Floats

_ENTERS: tuple[tuple[ActsOn, str, tuple[Form, ...]], ...] = (  # where, what it follows, and the forms it may have there
    ("modulus", "displacement_mm", ("linear", "power", "saturating", "threshold")),
    ("modulus", "time_s", ("linear", "power", "saturating", "threshold", "step")),
    ("gain", "force_n", ("linear", "power", "saturating", "threshold")),
    ("force", "time_s", ("power", "saturating", "threshold", "step", "periodic")),  # a linear drift every cell may have
    ("force", "displacement_mm", ("saturating", "periodic", "peak")),
    ("position", "displacement_mm", ("power", "saturating", "threshold", "periodic")),
    ("position", "time_s", ("linear", "power", "saturating", "threshold", "step")),
)
_FORMS: Mapping[Form, float] = {
    "linear": 0.25, "power": 0.25, "saturating": 0.2, "threshold": 0.1, "step": 0.1, "periodic": 0.1, "peak": 0.1,
}  # fmt: skip
_RELATIVE, _OF_LARGEST = 0.2, 0.1  # sds of the prior: of a relative change; of the largest force or depth
_MOST = 0.9  # what they are bounded by
_LEVELS = 31  # at which an axis is looked at
_LEAST = 1e-6  # of the range: powers begin at 0
TURN = "turn"  # the variant of a step
_REASON = "how a change grows over the measured range: 0.5 with its root, 2 with its square"


@dataclass(frozen=True)
class Extent:
    """How far the curves of a campaign reach: depth [mm], force [N], and time [s] since each recording began; when each
    recording begins and when it turns back [s], by its id."""

    depth_mm: float
    force_n: float
    time_s: float
    begins: Mapping[str, float]
    turns: Mapping[str, float]


class CurveLaw(UnnamedLaw):
    """A law that changes what each sample of a curve shows."""

    kinds: ClassVar[tuple[Kind, ...]] = ("indentation",)
    stage = Stage.CURVE
    order = 200

    def __init__(self, acts_on: ActsOn, axis: Axis, shape: Shape, extent: Extent) -> None:
        """Bind the form to how far the curves of a campaign reach."""
        self.name = PREFIX + "__".join(filter(None, (acts_on, axis.name, shape.form, shape.variant)))
        self.spoken = Spoken(acts_on, axis.name, shape.form)
        self.axis, self.shape = axis, shape
        self._extent = extent
        unit, share, whole = {
            "force": ("N", _OF_LARGEST, extent.force_n),
            "position": ("mm", _OF_LARGEST, extent.depth_mm),
        }.get(acts_on, ("-", _RELATIVE, 1.0))
        amplitudes = changes("law_change", unit, share * whole, shape.count, _MOST / share)
        self.amplitudes = tuple(entry.name for entry in amplitudes)
        self.parameters_bound = (*amplitudes, *shape.bending)
        self.grid = shape.points

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Change its samples."""
        own = {name: of_samples(value) for name, value in values.items()}
        curve.laws.append(_Bound(self, own))

    def features(self, samples: Samples, force: Floats, values: Values) -> Sequence[Feature]:
        """Of samples (points, curves, samples) where the contact bears the `force` [N]."""
        return self.shape.features(self._along(samples, force), values)

    def _along(self, samples: Samples, force: Floats) -> Floats:
        """The axis at each sample."""
        if self.axis.name == "displacement_mm":
            return np.asarray(1e3 * np.maximum(samples.travel, 0.0))
        if self.axis.name == "force_n":
            return np.maximum(force, 0.0)
        origin = self._extent.turns if self.shape.variant == TURN else self._extent.begins
        return np.asarray(samples.time - np.array([origin[name] for name in samples.ids])[:, None])


@dataclass(frozen=True)
class _Bound:
    """A law at values of its parameters (points, 1, 1)."""

    law: CurveLaw
    values: Values

    def moved(self, samples: Samples, travel: Floats) -> Floats:
        """The travel [m] at which a sphere presses."""
        if self.law.spoken.acts_on != "position":
            return travel
        return travel + 1e-3 * self._change(samples, np.zeros_like(travel))

    def read(self, samples: Samples, force: Floats) -> Floats:
        """The force [N] that is read where the contact bears `force`."""
        if self.law.spoken.acts_on == "position":
            return force
        change = self._change(samples, force)
        return force + change if self.law.spoken.acts_on == "force" else force * (1 + change)

    def _change(self, samples: Samples, force: Floats) -> Floats:
        features = self.law.features(samples, force, self.values)
        parts = [
            self.values[name].value * (one.value if isinstance(one, Differentiated) else one)
            for name, one in zip(self.law.amplitudes, features, strict=True)
        ]
        return np.asarray(reduce(add, parts))


def curve_laws(extent: Extent, *, timed: bool) -> list[tuple[CurveLaw, float]]:
    """The laws of a campaign of indentations, each with its log share of the prior; `timed` where the samples have
    times."""
    ranges = {"displacement_mm": extent.depth_mm, "force_n": extent.force_n, "time_s": extent.time_s}
    axes = {
        name: Axis(name, {str(place): value for place, value in enumerate(np.linspace(0, high, _LEVELS).tolist())})
        for name, high in ranges.items()
        if high > 0 and (timed or name != "time_s")
    }
    entries = [(acts_on, axes[name], forms) for acts_on, name, forms in _ENTERS if name in axes]
    laws: list[tuple[CurveLaw, float]] = []
    for acts_on, axis, forms in entries:
        for form in forms:
            own = _shapes(form, axis, extent)
            share = _FORMS[form] / sum(_FORMS[one] for one in forms) / len(entries)
            laws += [(CurveLaw(acts_on, axis, shape, extent), float(np.log(share / len(own)))) for shape in own]
    return laws


def _shapes(form: Form, axis: Axis, extent: Extent) -> list[Shape]:
    if form == "power":
        return [_power(axis)]
    if form == "step":  # a step elsewhere is none that a curve could show beside its contact point
        return [Shape("step", lambda x, _: [(x > 0).astype(float)], variant=TURN)] if extent.turns else []
    own = [shape for shape in shapes(axis) if shape.form == form]
    return own if form == "periodic" else own[:1]


def _power(axis: Axis) -> Shape:
    """(x/x_end)^n."""
    exponent = Parameter("law_exponent", "-", 0.2, 6.0, Normal(float(np.log(1.5)), 0.7), "log", None, _REASON)

    def growing(x: Floats, values: Values) -> list[Feature]:
        return [exp(values["law_exponent"] * np.log(np.maximum(x / axis.high, _LEAST)))]

    return Shape("power", growing, bending=(exponent,), grid=tuple((float(np.log(n)),) for n in (0.5, 2.0, 3.0)))


def of_samples(value: Differentiated) -> Differentiated:
    """A number of each point (points, 1), as samples take it: (points, 1, 1)."""
    return Differentiated(value.value[..., None], np.zeros((0, *value.value.shape, 1)))

"""A force curve as mechanisms change it: the elastomer, the stage, and relaxation. SI."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.models.relaxation import Relaxation
from underskin.units import Floats


@dataclass(frozen=True)
class Samples:
    """The samples before any law: `travel` from the contact point [m] (points, curves, samples), `time` [s] (curves,
    samples), and the recordings' `ids`."""

    ids: Sequence[str]
    travel: Floats
    time: Floats


class SampleLaw(Protocol):
    """A law that changes samples one by one."""

    def pressed_travel(self, samples: Samples, travel: Floats) -> Floats:
        """The travel at which the sphere presses [m] (points, curves, samples)."""

    def measured_force(self, samples: Samples, force: Floats) -> Floats:
        """The measured force [N] where the contact force is `force` [N] (points, curves, samples)."""


@dataclass
class Curve:
    """The quantities that govern an indentation or compression; each is one number per point of the fit coordinates."""

    modulus: Differentiated  # E [Pa]
    poisson_ratio: Differentiated
    strain_share: Differentiated | None = None  # of an indentation: that of finite strain's correction (Sphere)
    thickness: Differentiated | None = None  # h [m]
    layered: bool = False
    work_of_adhesion: Differentiated | None = None  # [J/m²]
    work_of_separation: Differentiated | None = None  # the same where it is no larger
    stiffening: tuple[Differentiated, ...] | None = None  # of an indentation: c, q and m (Stiffening)
    yeoh: tuple[Differentiated, ...] | None = None  # of a compression: c2 = C20/C10, c3 = C30/C10 and m (2: Yeoh's law)
    relaxation: tuple[tuple[Differentiated, Differentiated], ...] = ()  # g and τ [s] of each Prony pair
    stage_stiffness: Differentiated | None = None  # [N/m]
    platen_friction: Differentiated | None = None  # 0 to 1
    laws: list[SampleLaw] = field(default_factory=list)

    @property
    def prony_pairs(self) -> Relaxation | None:
        """The Prony pairs, (points, 1, 1, pairs); None without relaxation."""
        if not self.relaxation:
            return None
        fraction, time = (np.stack([numbers(pair[part]) for pair in self.relaxation], axis=-1) for part in range(2))
        return Relaxation(fraction, time)


def numbers(quantity: Differentiated) -> Floats:
    """A quantity's value at each point, with axes for curves and samples: (points, 1, 1)."""
    return quantity.value[..., None]

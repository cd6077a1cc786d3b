"""A characterisation curve on its way through a model: the elastomer, the bench, and the flow of time. SI."""

from dataclasses import dataclass, fields, replace
from typing import Any

from underskin.autodiff import Differentiated, constant


@dataclass
class Curve:
    """What an indentation or compression is governed by; each number is a Differentiated of one row."""

    modulus: Differentiated  # E [Pa]
    poisson_ratio: Differentiated
    thickness: Differentiated | None = None  # h [m]
    layered: bool = False
    work_of_adhesion: Differentiated | None = None  # [J/m²]
    yeoh: tuple[Differentiated, Differentiated] | None = None  # c2 = C20/C10 and c3 = C30/C10
    relaxation: tuple[Differentiated, Differentiated] | None = None  # g and τ [s]
    stage_stiffness: Differentiated | None = None  # [N/m]
    platen_friction: Differentiated | None = None  # 0 to 1

    @property
    def reduced_modulus(self) -> Differentiated:
        """E' = E/(1 − ν²) [Pa]."""
        return self.modulus / (1 - self.poisson_ratio**2.0)

    def fixed(self, variables: int) -> "Curve":
        """The same numbers, which none of so many variables changes."""
        return replace(self, **{field.name: _fixed(getattr(self, field.name), variables) for field in fields(self)})


def _fixed(number: Any, variables: int) -> Any:
    if isinstance(number, tuple):
        return tuple(_fixed(part, variables) for part in number)
    return constant(number.value, variables) if isinstance(number, Differentiated) else number


def stiffened(stretch: Differentiated, yeoh: tuple[Differentiated, Differentiated]) -> Differentiated:
    """Yeoh's nominal uniaxial stress over E/3, compression positive: (λ⁻² − λ)(1 + 2 c2 I + 3 c3 I²), I = I1 − 3."""
    invariant = stretch * stretch + 2.0 / stretch - 3.0
    neo_hookean = 1.0 / (stretch * stretch) - stretch
    return neo_hookean * (1.0 + 2.0 * yeoh[0] * invariant + 3.0 * yeoh[1] * invariant * invariant)

"""The mechanism `strain_stiffening`."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from underskin.autodiff import Differentiated, chain, exp, log, where
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.physics.uniaxial import neo_hookean
from underskin.physics.uniaxial import stiffening as nominal_stress
from underskin.recordings.campaign import CompressionRecording, Conditions
from underskin.units import Array, Floats

_STRAIN = 0.2  # of the contact, times R/a
_NEWTON_STEPS = 8
_LEAST_STRETCH = 0.02
_ALPHAS = (-20.0, -5.0, 2.0, 5.0)  # of brain, between, neo-Hookean, of rubbers
_STRAINS, _BELOW = 101, 0.995  # strains compared with a neo-Hookean solid's, and what is less than 1 in two digits
_COMPARED = 0.1  # the strain at which laws of curves and of FRFs are compared, as large as a contact's
_LOCKED = 0.05  # of 1 + q c J, which is 0 where Gent's law locks
_LEAST_FORM = 1e-3  # of q, below which (1 + q c J)^(1/q) is taken there

_OF_CONTACTS = "1 for a neo-Hookean solid, 1.1 to 1.2 for the silicones of docs/mechanisms.md; filled elastomers more"
_M = "m of J = 3 (I/3)^(m/2): 2 for most elastomers, 1 where the modulus grows with the strain itself"
_M_OF_CONTACT = "m of J = 3 (I/3)^(m/2): 2 of laws in I, 1 where the modulus grows with the strain of the contact"
_C = "c of (1 + q c J)^(1/q): 0.1 for a silicone (2 C20/C10), 1/Jm of Gent's law, 40 for tissue-like gels"
_Q = "q of (1 + q c J)^(1/q): 1 is Yeoh's law, 0 an exponential, -1 Gent's"
_C2 = "c2 of the silicones of docs/mechanisms.md: -0.03 to 0.09 over their range, -0.2 to 0.6 below 40 %"
_C3 = "c3 of the silicones of docs/mechanisms.md: 0 to 0.03 over their range, -0.4 to 0.1 below 40 %"
_ALPHA = "α of Ogden's law: 2 is neo-Hookean, the silicones of docs/mechanisms.md have 2 to 4.8, brain has -20"
_SMALL_C2 = "c2 of the silicones of docs/mechanisms.md is 0.1 and, below 40 %, up to 0.6; the table ends at 7"
_ENDS, _FORMS = (1.0, 2.0), (-2.0, 2.0)

_COEFFICIENT = Parameter(
    "stiffening", "-", 0.0, 40.0, HeavyTailed(1.0, 4.0), "linear", limit=0.0, shown=5.0, reason=_OF_CONTACTS
)
_OF_CONTACT = Parameter("second_over_first", "-", 0.0, 7.0, HeavyTailed(0.0, 1.0), "linear", 0.0, _SMALL_C2, shown=1.0)
_EXPONENT = Parameter(
    "stiffening_exponent", "-", 1.0, 2.0, Normal(2.0, 0.3), "linear", None, _M, shown=2.0, starts=_ENDS, closed=_ENDS
)
_SPHERE = (
    Parameter("stiffening_coefficient", "-", 1e-2, 300.0, Normal(0.0, 2.0), "log", None, _C, shown=5.0, closed=(1e-2,)),
    Parameter(
        "stiffening_form", "-", -2.0, 2.0, Uniform(), "linear", None, _Q, shown=1.0, starts=(-1.0, 1.0), closed=_FORMS
    ),
    replace(_EXPONENT, prior=Uniform(), reason=_M_OF_CONTACT),
)
_CYLINDER = (
    Parameter("second_over_first", "-", -1.0, 2.0, Normal(0.0, 0.3), "linear", 0.0, _C2, shown=0.1),
    Parameter("third_over_first", "-", -1.0, 1.0, Normal(0.0, 0.1), "linear", 0.0, _C3, shown=0.02),
    _EXPONENT,
    Parameter(
        "ogden_exponent", "-", -40.0, 20.0, HeavyTailed(2.0, 2.0), "linear", 2.0, _ALPHA, shown=2.0, starts=(2.0, -10.0)
    ),
)


class StrainStiffening(Mechanism):
    """A modulus that grows with strain."""

    name = "strain_stiffening"
    plain = """The elastomer's modulus changes with its strain, and mostly grows, so at high loads the force rises more,
    and a contact grows less, than a constant modulus would have it."""
    law = """FRF: E = E0 (1 + s ε), ε = 0.2 a/R the contact's representative strain, a³ = 3FR(1 − ν²)/(4E), solved
    together; or Yeoh's law, (G/2)(K + c2 K²), K = I1 − 3, in the solved contact: σ plus what tables/contact.h5 has for
    c2 over the contact at E0; or both. Curves: J = 3 (I/3)^(m/2), I = λ² + 2/λ − 3, λ = 1 − strain; compression:
    nominal stress 2E/(3α) (λ^(−α/2 − 1) − λ^(α − 1)) (1 + 2 c2 J + 3 c3 J²): Ogden's law at c2 = c3 = 0, Yeoh's at α =
    2 and m = 2, a modulus that grows with the strain itself at m = 1; under a sphere (1 + q c J)^(1/q) at ε multiplies
    the modulus of the neo-Hookean contact."""
    assumptions = """incompressible and isotropic; a contact is as stiff as a uniaxial sample at its representative
    strain, as s takes it: the a in it is Hertz' also where the contact is the layer's or sticks; c2's stress on the
    base is that of a frictionless sphere on the incompressible layer. With c2 = c3 = 0 and α = 2 a compression is
    neo-Hookean, as the base model is, and so is a sphere's contact at c = 0."""
    source = """Ogden, Proc. R. Soc. A 326 (1972) 565; Yeoh, Rubber Chem. Technol. 66 (1993) 754; Tabor, The Hardness of
    Metals (1951), for 0.2 a/R; Lin, Dimitriadis & Horkay, J. Biomech. Eng. 129 (2007) 904."""
    stage = Stage.MATERIAL
    order = 40
    kinds = ("frf", "indentation", "compression")
    axes = ("preload_n", "indenter_radius_mm", "displacement_mm")

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The stiffening coefficient, or for curves the law's constants."""
        return {"frf": (_COEFFICIENT, _OF_CONTACT), "indentation": _SPHERE, "compression": _CYLINDER}[kind]

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """Of measured cylinders c2 and c3 by linear least squares at m = 2 and several α."""
        curves = conditions.of(CompressionRecording)
        return [(*_polynomial(curves, alpha), 2.0, alpha) for alpha in _ALPHAS] if curves else ()

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Stiffen each contact by its own strain; a curve takes the law."""
        if isinstance(state, Contacts):
            strain = _STRAIN * state.hertz_radius / state.indenter_radius
            excess = values["stiffening"] * strain
            ratio, slope = _radius_ratio(excess.value)
            state.modulus = state.modulus * (1.0 + excess * chain(ratio, (slope, excess)))
            state.second_over_first = values["second_over_first"]
        elif "stiffening_form" in values:
            state.stiffening = tuple(values[f"stiffening_{name}"] for name in ("coefficient", "form", "exponent"))
        else:
            state.stiffened = tuple(values[parameter.name] for parameter in _CYLINDER)


def shared_parameters(kind: Kind, values: Values) -> Mapping[str, Differentiated]:
    """s of 1 + s ε for the law of an indentation: the relative increase of the modulus at ε = 0.1, over ε. A
    cylinder is strained so much more that its law gives no information on such small strains."""
    if kind == "frf":
        return values
    if kind == "compression":
        return {}
    shortened = 1.0 - _COMPARED
    invariant = shortened**2 + 2.0 / shortened - 3.0
    coefficient, form, exponent = (values[f"stiffening_{name}"] for name in ("coefficient", "form", "exponent"))
    grown = coefficient * (3.0 * exp(exponent * (0.5 * np.log(invariant / 3.0))))
    nonzero_form = where(np.abs(form.value) > _LEAST_FORM, form, _LEAST_FORM)
    power = 1.0 + nonzero_form * grown
    factor = exp(log(where(power.value > _LOCKED, power, _LOCKED)) / nonzero_form)
    return {"stiffening": (factor - 1.0) / _COMPARED}


def meaning(values: Mapping[str, float], conditions: Conditions) -> str:
    """Where a compressed or pulled sample is softer than a neo-Hookean solid of its modulus, over what was recorded."""
    if "ogden_exponent" not in values:
        return ""
    law = [np.array(values[parameter.name]) for parameter in _CYLINDER]
    cylinders = conditions.of(CompressionRecording)
    strains = [1.0 - _stretch(curve) for curve in cylinders]
    said = []
    for how, sign in (("pressed", 1.0), ("pulled", -1.0)):
        farthest = max(float(np.nanmax(sign * strain)) for strain in strains)
        strain = np.linspace(0.0, min(farthest, 1.0) if sign > 0 else farthest, _STRAINS)[1:-1]
        stretch = 1.0 - sign * strain
        if farthest > 0 and (beside := nominal_stress(stretch, *law) / neo_hookean(stretch)).min() < _BELOW:
            places = dict.fromkeys((int(beside.argmin()), len(strain) - 1))
            parts = [f"{beside[place]:.2g} at {100 * strain[place]:.0f} % strain" for place in places]
            said.append(f"as it is {how}, its force over that of a neo-Hookean solid is {' and '.join(parts)}")
    return f"A{'; '.join(said)[1:]}." if said else ""


def _stretch(curve: CompressionRecording) -> Floats:
    """λ of each sample, from where the force is least."""
    unloaded = curve.displacement_mm[np.abs(curve.force_n).argmin()]
    return np.asarray(1.0 - (curve.displacement_mm - unloaded) / curve.sample_height_mm)


def _polynomial(curves: Sequence[CompressionRecording], alpha: float) -> tuple[float, float]:
    """c2 and c3 of the least residual of nominal stress at m = 2."""
    rows = []
    for curve in curves:
        stretch = np.maximum(_stretch(curve), _LEAST_STRETCH)
        ogden = nominal_stress(stretch, *map(np.array, (0.0, 0.0, 2.0, alpha)))
        invariant = stretch**2 + 2.0 / stretch - 3.0
        columns = ogden, 2.0 * ogden * invariant, 3.0 * ogden * invariant**2
        rows.append(np.column_stack([*columns, curve.force_n / curve.sample_diameter_mm**2]))
    *design, stress = np.concatenate(rows).T
    first, second, third = np.linalg.lstsq(np.column_stack(design), stress, rcond=None)[0]
    return (second / first, third / first) if first > 0 else (0.0, 0.0)


def _radius_ratio(excess: Array) -> tuple[Array, Array]:
    """y = a/a0 with y³ (1 + x y) = 1, and dy/dx: the stiffened contact's radius for x = s ε0."""
    y = 1 / np.cbrt(1 + excess)
    for _ in range(_NEWTON_STEPS):
        y = y - (y**3 + excess * y**4 - 1) / (3 * y**2 + 4 * excess * y**3)
    return y, -(y**4) / (3 * y**2 + 4 * excess * y**3)

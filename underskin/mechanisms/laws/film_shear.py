"""The mechanism `film_shear`."""

import math

from underskin.mechanisms.base import HeavyTailed, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import Contacts

_FILM, _POISSON = 0.05, 0.35  # thickness [mm] that the ratio is stated for (sensor films: 0.009 to 0.11), and PVDF's ν
_LAG = "a film of 3 GPa and 0.03 mm on 0.01 mm of epoxy (1 GPa in shear) has 0.03 mm, on a soft glue line 0.5 mm"
_RATIO = "stretched PVDF has 0.7, P(VDF-TrFE) 0.3, and films are 0.009 to 0.11 mm thick"


class FilmShear(Mechanism):
    """A sensor film that the skin's shear stretches on a glue line that yields."""

    name = "film_shear"
    plain = """The squeezed skin drags the sensor's film outwards on the glue beneath it, and the stretched film gives
    charge of its own beside that of the pressure, in another shape around the contact."""
    law = """Q = d33 ∫ T3 + d31 ∫ (T1 + T2): in place of the transmission M(k) stands M + c h λ² k M_s/(1 + (λk)²), k in
    1/h, λ = ℓ/h, M_s(k) the layer's shear at the base under a normal stress, c = (1 + ν_f) (d31/d33)/t, and ℓ = √(E_f
    t/((1 − ν_f²) k_g)) the length over which a glue of stiffness k_g [N/m³] takes up the film's tension; from the
    membrane's k_g ℓ² (u'' + u'/r − u/r²) + τ = k_g u and T1 + T2 = E_f (u' + u/r)/(1 − ν_f)."""
    assumptions = """a linear membrane that reaches beyond the sensor, isotropic in its plane and so stiff that the skin
    is bonded to it; the linear layer's shear; d31 of the opposite sign of d33, as in PVDF. The ratio is that of a film
    0.05 mm thick, of another one of thickness t it is d31/d33 times 0.05 mm/t; where ℓ is small beside the thickness,
    only ratio · ℓ² shows. At rT/h 0.6, a/h 0.3, h 2.5 mm and ratio 0.4, ℓ of 0.05 mm adds 1.7 % to a centred press and
    −0.3 % at r̂/h 1; 0.25 mm adds 39 % and −4 %. Charge by stretch counts as stress where d33 changes with it."""
    source = """Volkersen, Luftfahrtforschung 15 (1938) 41, and Cox, Br. J. Appl. Phys. 3 (1952) 72, for the shear lag;
    Sneddon, Fourier Transforms (1951), chapter 10, for M_s, whose closed form stands in
    underskin/physics/elastic_layer.py; Measurement Specialties, Piezo Film Sensors
    Technical Manual (1999), for d31 (23 and 11 pC/N) over d33 (−33 and −38) and for films."""
    stage = Stage.MATERIAL
    order = 70
    axes = ("position_mm", "preload_n", "indenter_radius_mm")
    needs = "a declared thickness_mm"
    parameters_stated = (
        Parameter("shear_lag", "mm", 0.005, 3.0, HeavyTailed(math.log(0.035), 0.6), "log", 0.0, _LAG, shown=0.2),
        Parameter("lateral_ratio", "-", 0.1, 4.0, Normal(math.log(0.5), 0.6), "log", 0.0, _RATIO, shown=0.4),
    )

    def act(self, state: Contacts, values: Values) -> None:
        """Set the charge by stretch and the shear lag."""
        state.film = (1e3 * (1 + _POISSON) / _FILM) * values["lateral_ratio"], 1e-3 * values["shear_lag"]

"""The mechanism `compressible_layer`."""

from underskin.mechanisms.base import Kind, Mechanism, Parameter, Stage, Uniform, Values
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings.campaign import Conditions

_REASON = "solid elastomers 0.48 to 0.5, filled and slightly porous ones 0.4, foams 0.3"


class CompressibleLayer(Mechanism):
    """A skin with a Poisson ratio below 0.5."""

    name = "compressible_layer"
    plain = """The skin's material can be squeezed together a little in volume, so it passes the pressure on in another
    shape, which shows beside the sensors and with centred presses looks like another d33."""
    law = "ν < 0.5 in Hertz' E' = E/(1 − ν²), in the layer's transmission M and in its compliance K."
    assumptions = """isotropic linear elasticity; what finite strain adds is the incompressible table's, entered with L
    (0.75/(1 − ν²))², which keeps q0/E. For a centred contact nearly a pure gain, not to be told from d33."""
    source = """Sneddon, Fourier Transforms (1951), chapter 10; the closed forms of M and K stand in
    underskin/physics/elastic_layer.py."""
    stage = Stage.MATERIAL
    order = 10
    kinds = ("frf", "indentation")
    axes = ("position_mm", "preload_n", "indenter_radius_mm")
    needs = "a skin declared with poisson_ratio 0.5; of indentations alone also a declared modulus or thickness"
    parameters_stated = (
        Parameter("poisson_ratio", "-", 0.30, 0.5, Uniform(), "linear", limit=0.5, shown=0.4, reason=_REASON),
    )

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """A skin that is declared compressible has its ν in the base model; a free E of indentations takes up any ν."""
        skin = conditions.skin
        if skin.poisson_ratio != INCOMPRESSIBLE:
            return f"the skin is declared compressible already (poisson_ratio {skin.poisson_ratio:g})"
        if kind == "indentation" and skin.youngs_modulus_mpa is None and skin.thickness_mm is None:
            return "neither youngs_modulus_mpa nor thickness_mm is declared: E/(1 − ν²) is all that the curves tell"
        return None

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Set ν."""
        state.poisson_ratio = values["poisson_ratio"]

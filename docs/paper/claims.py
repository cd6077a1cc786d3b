"""The paper's verifiable statements, each with the value that this project computes."""

import numpy as np

from docs.paper.figures import varied_contacts
from docs.paper.layer_claims import Claim, surface_deflection, tension
from docs.paper.markdown import ceiling, percent
from docs.paper.prototype import (
    BEST_FIT_D33_PC_PER_N,
    DYNAMIC_FORCE_N,
    FLAT_UP_TO_HZ,
    INDENTERS_MM,
    LINEAR_UP_TO_MPA,
    MODULUS_MPA,
    PITCH_MM,
    PRELOADS_N,
    RHO,
    SKIN,
    THICKNESS_MM,
    Press,
    preload_at_peak_pressure,
    press,
)
from docs.paper.prototype_figures import frf_pc_per_n, off_centre
from tablegen import linear_layer
from underskin.physics import charge_response, elastic_layer, half_space, hertz
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SMALL_SENSOR, _WIDE_SENSOR = 0.2, 1.0
_FAR = np.linspace(0, 3, 301)
_SPEED_OF_SOUND = 1000.0  # m/s, the paper's
_THICKER_MM = np.linspace(1.5, 5.0, 71)


def checked(table: SigmaTable) -> list[Claim]:
    """All rows except the half space's error, which has a section of its own."""
    small, large = (press(table, radius, PRELOADS_N) for radius in INDENTERS_MM)
    return [
        _identities(),
        *_point_like(),
        _thickness(),
        surface_deflection(),
        tension(),
        _rigid_base(),
        _incompressible(),
        *_load(table),
        _longitudinal(),
        _resonances(),
        _flat(),
        _slope(),
        _two_megapascals(table, small, large),
        _dynamic_force(table),
        _best_fit(small, large),
        _array(small),
        _dispersion(small),
        _pitch(),
    ]


def _identities() -> Claim:
    a, rho = 0.7, 0.9  # any pair shows it
    error = max(
        abs(float(half_space.sigma(0, rho) / half_space.gamma_n(0, rho)) - 1),
        abs(float(half_space.sigma(a, 0) / half_space.delta(a)) - 1),
    )
    return Claim(
        "On a point sensor σ is δ(a/h); the intercepts of σ and γ are the same (figure 8)",
        f"both within {ceiling(error)}; in closed form δ = 1/(1 + (a/h)²)",
        "holds",
    )


def _point_like() -> list[Claim]:
    sensor = percent(float(half_space.gamma_n(0, _SMALL_SENSOR)), 1.0)
    in_layer = percent(float(linear_layer.gamma_n(0, _SMALL_SENSOR)), float(linear_layer.gamma_n(0, 0)))
    edge, far = (_against_point(half_space.gamma_n(at, _WIDE_SENSOR), half_space.gamma_n(at, 0.0)) for at in (1.0, 1.5))
    on_scale = 100 * float(
        np.max(np.abs(half_space.gamma_n(_FAR, _WIDE_SENSOR) - half_space.gamma_n(_FAR, 0.0))[_FAR >= 1])
    )
    wide = _against_point(half_space.sigma(2.0, _WIDE_SENSOR), half_space.delta(2.0))
    wide_layer = _against_point(linear_layer.sigma(2.0, _WIDE_SENSOR), linear_layer.sigma(2.0, 0.0))
    return [
        Claim(
            "For rT/h = 0.2 the sensor can be treated as point-like (figures 4 and 8)",
            f"largest error {sensor:+.1f} % in the half space and {in_layer:+.1f} % in the layer, under the force and "
            "at a = 0",
            "holds within 5 to 6 %",
        ),
        Claim(
            "For rT/h = 1 it can, where the force is at least the sensor's radius away (figure 4)",
            f"γ is {edge:+.0f} % off at r̂ = rT and {far:+.0f} % at 1.5 rT; at most {on_scale:.1f} % of γ(0, 0)",
            "does not hold: the curves are close only on the scale of the figure",
        ),
        Claim(
            "For rT/h = 1 it can, where the contact radius is at least twice the thickness (figure 8)",
            f"at a/h = 2 σ is {wide:+.1f} % off in the half space and {wide_layer:+.1f} % in the layer",
            "holds within a tenth",
        ),
    ]


def _against_point(extended: Floats, point: Floats) -> float:
    return percent(float(extended), float(point))


def _thickness() -> Claim:
    contact = float(hertz.contact_radius(1.0, INDENTERS_MM[0] * 1e-3, SKIN.youngs_modulus)) * 1e3
    rho = 1.5 / _THICKER_MM
    charge = charge_response.gain(linear_layer.sigma(contact / _THICKER_MM, rho), rho)
    fall = percent(float(np.interp(5.0, _THICKER_MM, charge)), float(np.interp(2.5, _THICKER_MM, charge)))
    return Claim(
        "A thicker layer means weaker signals (section 2.1)",
        f"charge per force falls throughout from 1.5 to 5 mm (rT 1.5 mm, R 4 mm, 1 N): from 2.5 to 5 mm {fall:+.0f} %",
        "holds" if bool(np.all(np.diff(charge) < 0)) else "does not hold",
    )


def _rigid_base() -> Claim:
    layer, half = float(linear_layer.sigma(0, 0)), float(half_space.sigma(0, 0))
    pressed = percent(float(linear_layer.sigma(0.3, RHO)), float(half_space.sigma(0.3, RHO)))
    return Claim(
        "The finite layer follows the half space's trend but differs in quantity, by the rigid substrate (figure 10)",
        f"under a point force σ is {layer:.4f} instead of {half:.0f}, {percent(layer, half):+.0f} %; at the "
        f"prototype's contacts {pressed:+.0f} %",
        "holds",
    )


def _incompressible() -> Claim:
    soft = elastic_layer.sigma(elastic_layer.Layer(0.48), 0.3, RHO)
    change = percent(float(soft), float(linear_layer.sigma(0.3, RHO)))
    return Claim(
        "An elastomer of ν = 0.48 is sufficiently close to incompressible (section 2.2)",
        f"σ of the exact layer changes by {change:+.1f} % (a/h 0.3, rT/h 0.6)",
        "holds within a percent",
    )


def _load(table: SigmaTable) -> list[Claim]:
    contact, load = varied_contacts()
    sigma = table.sigma(contact, RHO, load).sigma
    steps = np.diff(sigma)
    rises, largest = int((steps > 0).sum()), 100 * float((steps / sigma[:-1]).max())
    return [
        Claim(
            "R/h is equivalent to a/h (equation 16)",
            "a/h = (R/h) (9L/16)^(1/3): only for one L is one a measure of the other",
            "holds together with L",
        ),
        Claim(
            "σ over a/h oscillates when F and R are varied at fixed E, because it depends on L too (figures 10 and 11)",
            f"of {len(steps)} steps to the next larger a/h {rises} go up, by up to {largest:.1f} %; at one a/h σ grows "
            "with L, and in a layer without finite strain not at all",
            "holds: L acts through finite strain alone",
        ),
    ]


def _longitudinal() -> Claim:
    frequency = _SPEED_OF_SOUND / (4 * THICKNESS_MM * 1e-3)
    return Claim(
        "Longitudinal waves in the layer resonate at about 100 kHz (section 3)",
        f"v/4h = {frequency / 1e3:.0f} kHz for the paper's 1000 m/s",
        "holds",
    )


def _resonances() -> Claim:
    radius = INDENTERS_MM[0] * 1e-3
    contact_radius = float(hertz.contact_radius(1.0, radius, SKIN.youngs_modulus))
    stiffness = 2 * contact_radius * float(SKIN.youngs_modulus) / (1 - 0.5**2)
    mass = stiffness / (2 * np.pi * FLAT_UP_TO_HZ) ** 2
    by_preload = 100 * ((PRELOADS_N[-1] / PRELOADS_N[0]) ** (1 / 6) - 1)
    by_radius = 100 * ((INDENTERS_MM[1] / INDENTERS_MM[0]) ** (1 / 6) - 1)
    return Claim(
        "Resonances depend on the preload and on the size of the indenter (section 3.2.2)",
        f"the base model has none. A mass on the Hertz contact's spring (2aE/(1 − ν²) = {stiffness / 1e3:.1f} kN/m at "
        f"R 4 mm, 1 N) resonates {by_preload:.0f} % higher at 3 than at 0.5 N and {by_radius:.0f} % higher with 10 "
        f"than with 4 mm; below {1e3 * mass:.0f} g it stays above 130 Hz",
        "as a contact resonance would",
    )


def _flat() -> Claim:
    lag = np.degrees(np.arctan(0.1))
    return Claim(
        "From 1 to 130 Hz the FRF is flat, its imaginary part about a tenth of the real one: the viscoelastic part "
        "(figure 14)",
        f"the base model is real and flat. A tenth is a phase of {lag:.1f}°. Under force control the stress through an "
        "incompressible linear layer does not depend on its modulus, nor on its loss",
        "flat: holds; the elastomer's loss does not give the imaginary part",
    )


def _slope() -> Claim:
    stretch = _neo_hookean_stretch(LINEAR_UP_TO_MPA / MODULUS_MPA)
    steeper = 100 * ((1 + 2 * stretch**-3) / 3 - 1)
    return Claim(
        "The elastomer's modulus is 16 MPa, non-linear from about 2 MPa on (figure 13)",
        f"a neo-Hookean cylinder that slips carries 2 MPa at {100 * (1 - stretch):.1f} % strain, with a slope "
        f"{steeper:.0f} % steeper than at first",
        "as the simplest rubber would; whether 16 MPa is its modulus has a section below",
    )


def _neo_hookean_stretch(stress_over_modulus: float) -> float:
    """The stretch at which uniaxial compression carries a nominal stress: (1/3)(λ^(−2) − λ) = stress/E."""
    roots = np.roots([1.0, 3 * stress_over_modulus, 0.0, -1.0])
    return float(roots[np.isreal(roots)].real.max())


def _two_megapascals(table: SigmaTable, small: Press, large: Press) -> Claim:
    a, load, sigma = small.a_over_h[-1], small.load_parameter[-1], small.table[-1]
    by_a, _, by_load = (float(slope) for slope in table.gradient(a, RHO, load))
    edge = 100 * (a / 3 * by_a + load * by_load) / sigma
    reaches = preload_at_peak_pressure(INDENTERS_MM[0], LINEAR_UP_TO_MPA)
    return Claim(
        "2 MPa are reached only under the small sphere at high preloads, which suggests why it leaves the model "
        "(figure 15)",
        f"q0 reaches 2 MPa at {reaches:.2f} N and {small.peak_pressure_mpa[-1]:.2f} MPa at 3 N under R 4 mm; under "
        f"R 10 mm at most {large.peak_pressure_mpa[-1]:.2f} MPa. Finite strain adds "
        f"{percent(sigma, small.linear[-1]):+.1f} % to σ there, a contact edge that moves with the load {edge:+.1f} %",
        "the pressures hold; neither effect is large",
    )


def _dynamic_force(table: SigmaTable) -> Claim:
    lightest = press(table, INDENTERS_MM[0], [PRELOADS_N[0], PRELOADS_N[0] + DYNAMIC_FORCE_N])
    radius = percent(lightest.contact_radius_mm[1], lightest.contact_radius_mm[0])
    change = max(
        abs(percent(pressed.table[1], pressed.table[0]))
        for pressed in (
            press(table, sphere, [PRELOADS_N[0], PRELOADS_N[0] + DYNAMIC_FORCE_N]) for sphere in INDENTERS_MM
        )
    )
    return Claim(
        "A dynamic force of 0.09 N does not change the contact radius significantly (section 3.2.4)",
        f"at 0.5 N the radius moves by {radius:.1f} %, σ by {change:.2f} % at most",
        "holds for σ",
    )


def _best_fit(small: Press, large: Press) -> Claim:
    plateaus = [frf_pc_per_n(pressed.table) for pressed in (small, large)]
    by_half_space = BEST_FIT_D33_PC_PER_N * np.concatenate(
        [pressed.table / pressed.half_space for pressed in (small, large)]
    )
    return Claim(
        "d33 = 14 pC/N fits the FRFs over preload under both spheres best (figure 15)",
        f"with it the model gives {plateaus[0].max():.2f} to {plateaus[0].min():.2f} pC/N (R 4 mm) and "
        f"{plateaus[1].max():.2f} to {plateaus[1].min():.2f} pC/N (R 10 mm) from 0.5 to 3 N. Read with the half "
        f"space's σ the same FRFs would give {by_half_space.min():.1f} to {by_half_space.max():.1f} pC/N",
        "cannot be repeated: the measured FRFs are not at hand as numbers",
    )


def _array(small: Press) -> Claim:
    at = dict(zip(PRELOADS_N, small.table, strict=True))
    return Claim(
        "d33 is 22 pC/N at 3 N (41 sensors) and 14 pC/N at 1 N (12 sensors): it depends on the preload, and the lower "
        "value is ageing (figure 16)",
        f"σ falls by {-percent(at[3.0], at[1.0]):.1f} % from 1 to 3 N while d33 would rise by "
        f"{percent(22.0, 14.0):.0f} %",
        "transmission does not explain it; preload and age changed together, so that which of them does cannot be told",
    )


def _dispersion(small: Press) -> Claim:
    a = float(small.a_over_h[-1])
    falls = [100 * (off_centre(a, offset) - 1) for offset in (0.25, 0.5, 1.0)]
    return Claim(
        "Sensors scatter because of the indenter's position, rT, h, d33 and bending (figure 16)",
        f"a force 0.25, 0.5 and 1 mm off centre gives {falls[0]:+.1f}, {falls[1]:+.1f} and {falls[2]:+.1f} %, always "
        "to one side (linear layer, R 4 mm, 3 N)",
        "position alone makes a one-sided scatter of this size",
    )


def _pitch() -> Claim:
    away = PITCH_MM / THICKNESS_MM
    layer, half = (model.gamma_n([0.0, away], RHO) for model in (linear_layer, half_space))
    return Claim(
        "An array does not modify the analysis of a single sensor (section 1; pitch 8 mm)",
        f"a force on one sensor puts {100 * layer[1] / layer[0]:.3f} % of its stress on the next "
        f"({100 * half[1] / half[0]:.2f} % in a half space)",
        "holds for the elastomer; crosstalk in cables is another matter",
    )

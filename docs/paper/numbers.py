"""The paper's reported numbers, each beside what this project computes for it."""

from dataclasses import dataclass

import numpy as np

from docs.paper.markdown import ceiling
from docs.paper.prototype import (
    BEST_FIT_D33_PC_PER_N,
    DYNAMIC_FORCE_N,
    INDENTERS_MM,
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
from tablegen import linear_layer
from underskin.physics import charge_response, half_space, hertz
from underskin.surrogate.sigma_table import SigmaTable

_LINEAR_UP_TO_MPA = 2.0
_LAST_FLAT_HZ = 130.0


@dataclass(frozen=True)
class Number:
    """One row: the quantity, the paper's value, ours, and why they differ (or what follows)."""

    quantity: str
    paper: str
    ours: str
    why: str


def reported(table: SigmaTable) -> list[Number]:
    """All rows but the half space's error, which has a section of its own."""
    small, large = (press(table, radius, PRELOADS_N) for radius in INDENTERS_MM)
    return [
        *_limits(table),
        *_hertz(small),
        _best_fit(small, large),
        _off_the_model(table, small, large),
        _array(small),
        _pitch(),
        _flat(),
        _imaginary(),
        _resonance(),
        _stress_strain(),
        _dynamic_force(small),
    ]


def _limits(table: SigmaTable) -> list[Number]:
    a, rho = 0.7, 0.9  # any pair shows it
    half = float(half_space.sigma(0, 0))
    identities = max(
        abs(float(half_space.sigma(0, rho) / half_space.gamma_n(0, rho)) - 1),
        abs(float(half_space.sigma(a, 0) / half_space.delta(a)) - 1),
    )
    return [
        Number("δ(0) = γ(0, 0), half space", "1", f"{half:.6f}", "—"),
        Number(
            "σ(0, ρ) = γ(0, ρ) and σ(a/h, 0) = δ(a/h)",
            "equal",
            f"equal within {ceiling(identities)}",
            "δ(a/h) = 1/(1 + (a/h)²) in closed form.",
        ),
        Number(
            "σ(0, 0), bonded layer",
            "not given",
            f"{float(linear_layer.sigma(0, 0)):.5f} exact, {float(table.sigma(0, 0).sigma):.5f} from the table",
            "The rigid base raises the stress under a point force by more than a half.",
        ),
    ]


def _hertz(small: Press) -> list[Number]:
    load = small.load_parameter[-1]
    radius_ratio = small.contact_radius_mm[-1] / small.indenter_radius_mm
    pressure_ratio = small.peak_pressure_mpa[-1] / MODULUS_MPA
    return [
        Number(
            "prototype",
            "h 2.5 mm, rT 1.5 mm (ρ 0.6), E 16 MPa, ν 0.5, R 4 and 10 mm, F 0.5–3 N",
            f"the same (ρ {RHO:.1f})",
            "Taken over as input; a, a/h and L that follow are in the next section.",
        ),
        Number(
            "(a/R)³ = (3/4)(1 − ν²) L, at R 4 mm, 3 N",
            "equation 16",
            f"a/R {radius_ratio:.5f} from 7–10, "
            f"{float(hertz.contact_radius_over_indenter_radius(load)):.5f} from L {load:.5f}",
            "The same Hertz contact written twice.",
        ),
        Number(
            "q0/E from L, at R 4 mm, 3 N",
            "equation 16",
            f"{pressure_ratio:.5f} from 7–10, {float(hertz.peak_pressure_over_modulus(load)):.5f} from L",
            "The same.",
        ),
    ]


def _best_fit(small: Press, large: Press) -> Number:
    plateaus = [BEST_FIT_D33_PC_PER_N * charge_response.gain(pressed.table, RHO) for pressed in (small, large)]
    by_half_space = BEST_FIT_D33_PC_PER_N * np.concatenate(
        [pressed.table / pressed.half_space for pressed in (small, large)]
    )
    return Number(
        "best-fit d33, two indenters",
        "14 pC/N",
        f"FRF plateaus for 14 pC/N: {plateaus[0].max():.2f}–{plateaus[0].min():.2f} pC/N (R 4 mm), "
        f"{plateaus[1].max():.2f}–{plateaus[1].min():.2f} pC/N (R 10 mm), 0.5–3 N",
        "The measured FRFs were not found as numbers, so the fit itself cannot be repeated. Read with the half "
        f"space's σ, the same FRFs would give {by_half_space.min():.1f}–{by_half_space.max():.1f} pC/N.",
    )


def _off_the_model(table: SigmaTable, small: Press, large: Press) -> Number:
    a, load, sigma = small.a_over_h[-1], small.load_parameter[-1], small.table[-1]
    by_a, _, by_load = (float(slope) for slope in table.gradient(a, RHO, load))
    edge = 100 * (a / 3 * by_a + load * by_load) / sigma
    reaches = preload_at_peak_pressure(INDENTERS_MM[0], _LINEAR_UP_TO_MPA)
    return Number(
        "small indenter at high preload",
        "off the model",
        f"q0 reaches 2 MPa at {reaches:.2f} N and {small.peak_pressure_mpa[-1]:.2f} MPa at 3 N under R 4 mm; "
        f"under R 10 mm it stays below {large.peak_pressure_mpa[-1]:.2f} MPa",
        "Only the small indenter leaves the range in which the elastomer was linear. In the base model, finite strain "
        f"adds {100 * (sigma / small.linear[-1] - 1):+.1f} % there, and a contact edge that moves with the load would "
        f"add {edge:+.1f} %: neither is large.",
    )


def _array(small: Press) -> Number:
    at = dict(zip(PRELOADS_N, small.table, strict=True))
    return Number(
        "array: d33 at 3 N (41 sensors) and 1 N (12 sensors)",
        "22 and 14 pC/N",
        f"σ falls by {100 * (1 - at[3.0] / at[1.0]):.1f} % from 1 to 3 N; d33 rises by 57 %",
        "No transmission of the base model makes up 57 %. The paper ties the lower value to the latest runs: age and "
        "preload are confounded in it.",
    )


def _pitch() -> Number:
    away = PITCH_MM / THICKNESS_MM
    layer = linear_layer.gamma_n([0.0, away], RHO)
    half = half_space.gamma_n([0.0, away], RHO)
    return Number(
        "array",
        "64 sensors, pitch 8 mm",
        f"a force on one sensor puts {100 * layer[1] / layer[0]:.3f} % of its stress on the next one "
        f"({100 * half[1] / half[0]:.2f} % in a half space)",
        f"8 mm is {away:.1f} thicknesses: the elastomer hardly couples neighbours.",
    )


def _flat() -> Number:
    return Number(
        "flat zone of the FRF",
        "about 1–130 Hz",
        "flat at all frequencies",
        "The base model has no inertia, no relaxation and no amplifier.",
    )


def _imaginary() -> Number:
    lag = np.degrees(np.arctan(0.1))
    return Number(
        "imaginary part",
        "about a tenth of the real part",
        "0",
        f"A tenth is a phase of {lag:.1f}°. Under force control, stress transmission through an incompressible linear "
        "layer does not depend on its modulus, so the elastomer's own loss does not give it.",
    )


def _resonance() -> Number:
    radius = INDENTERS_MM[0] * 1e-3
    contact_radius = float(hertz.contact_radius(1.0, radius, SKIN.youngs_modulus))
    stiffness = 2 * contact_radius * float(SKIN.youngs_modulus) / (1 - 0.5**2)
    mass = stiffness / (2 * np.pi * _LAST_FLAT_HZ) ** 2
    by_preload = 100 * ((PRELOADS_N[-1] / PRELOADS_N[0]) ** (1 / 6) - 1)
    by_radius = 100 * ((INDENTERS_MM[1] / INDENTERS_MM[0]) ** (1 / 6) - 1)
    return Number(
        "resonances",
        "move with preload and indenter",
        "none",
        f"A mass on the Hertz contact's spring (2aE/(1−ν²) = {stiffness / 1e3:.1f} kN/m at R 4 mm, 1 N) resonates "
        f"{by_preload:.0f} % higher at 3 than at 0.5 N and {by_radius:.0f} % higher with 10 than with 4 mm; above "
        f"130 Hz it takes less than {1e3 * mass:.0f} g. Qualitatively that is what the paper sees.",
    )


def _stress_strain() -> Number:
    stretch = _neo_hookean_stretch(_LINEAR_UP_TO_MPA / MODULUS_MPA)
    steeper = 100 * ((1 + 2 * stretch**-3) / 3 - 1)
    return Number(
        "stress–strain slope of the elastomer",
        "16 MPa, non-linear above 2 MPa",
        f"E = 16 MPa is taken over; neo-Hookean at 2 MPa: strain {100 * (1 - stretch):.1f} %, tangent {steeper:.0f} % "
        "steeper",
        "So even the simplest rubber model is visibly non-linear there; the table has that model's finite strain.",
    )


def _neo_hookean_stretch(stress_over_modulus: float) -> float:
    """The stretch at which uniaxial compression carries a nominal stress: (1/3)(λ^(−2) − λ) = stress/E."""
    roots = np.roots([1.0, 3 * stress_over_modulus, 0.0, -1.0])
    return float(roots[np.isreal(roots)].real.max())


def _dynamic_force(small: Press) -> Number:
    frf = BEST_FIT_D33_PC_PER_N * charge_response.gain(small.table[1], RHO)
    return Number(
        "dynamic force",
        "0.09 N",
        f"charge amplitude {DYNAMIC_FORCE_N * frf:.2f} pC (R 4 mm, 1 N, 14 pC/N)",
        "The FRF of the base model does not depend on it.",
    )

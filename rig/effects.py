"""The effects that can be switched on: law, parameters and the kinds of recordings that they act on.

The first part has the names of the project's catalogue (docs/mechanisms.md), the second is physics that is not in it.
The laws are the rig's own: physical, not always in the catalogue's parametrisation. Names carry units.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rig import checks
from rig.errors import RigError

FRF, INDENTATION, COMPRESSION = "frf", "indentation", "compression"
_PRESSED = (FRF, INDENTATION)

Values = dict[str, float | str]


@dataclass(frozen=True)
class Effect:
    """`parameters`: name to lowest and highest value; `laws`: names of its laws, the first by default."""

    law: str
    kinds: tuple[str, ...]
    parameters: Mapping[str, tuple[float, float]]
    laws: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()  # parameters that only some laws need, or that only some bodies have
    only_curves: tuple[str, ...] = ()  # optional parameters that recordings of kind frf do not have


EFFECTS: dict[str, Effect] = {
    "moving_contact_edge": Effect(
        "a fraction m of the contact edge follows the load: (1−m) σ + m d(Fσ)/dF", (FRF,), {"mobile_fraction": (0, 1)}
    ),
    "layered_contact": Effect("contact radius and pressure of a sphere on the layer with its base", _PRESSED, {}),
    "misalignment": Effect("all positions are displaced by one vector", (FRF,), {"x_mm": (-5, 5), "y_mm": (-5, 5)}),
    "adhesion": Effect(
        "JKR theory, on the layer where layered_contact is on; the way back may have a larger work of separation",
        _PRESSED,
        {"work_j_per_m2": (0, 5), "work_of_separation_j_per_m2": (0, 20)},
        optional=("work_of_separation_j_per_m2",),
        only_curves=("work_of_separation_j_per_m2",),
    ),
    "strain_stiffening": Effect(
        "with the contact strain e = 0.2 a/R (of a cylinder, beside its neo-Hookean law: u/H): linear E (1 + c e), "
        "limited E/(1 − c e)",
        (FRF, INDENTATION, COMPRESSION),
        {"coefficient": (0, 20)},
        ("linear", "limited"),
    ),
    "compressible_layer": Effect("ν of the layer", _PRESSED, {"poisson_ratio": (0.2, 0.5)}),
    "interface_slip": Effect(
        "glue line deformable in shear: shear stress κ (G/h) u_r", (FRF,), {"glue_stiffness": (0, 1e6)}
    ),
    "preload_dependent_d33": Effect(
        "with the sensor's mean stress T: linear 1 + β T, saturating 1 + β T/(1 + T/Ts)",
        (FRF,),
        {"beta_per_mpa": (-20, 20), "saturation_mpa": (1e-4, 100)},
        ("linear", "saturating"),
        optional=("saturation_mpa",),
    ),
    "sensor_spread": Effect("log-normal gain of each sensor", (FRF,), {"sd": (0, 1)}),
    "ageing": Effect(
        "after N load cycles: log 1 − r log10(1 + N/n0), exponential 1 − r (1 − e^(−N/n0))",
        (FRF,),
        {"rate": (0, 1), "cycles": (1, 1e9)},
        ("log", "exponential"),
    ),
    "contact_resonance": Effect(
        "a tip mass on the contact spring of the layer (E unrelaxed), 1/(1 − (ω/ω0)² + 2iζω/ω0)",
        (FRF,),
        {"tip_mass_g": (0, 500), "damping": (1e-3, 2)},
    ),
    "amplifier_high_pass": Effect("iωτ/(1 + iωτ)", (FRF,), {"corner_hz": (0, 1000)}),
    "amplifier_low_pass": Effect(
        "one pole, 1/(1 + iωτ), or Butterworth's two, 1/(1 + √2 iωτ − (ωτ)²)",
        (FRF,),
        {"corner_hz": (1e-2, 1e9)},
        ("first_order", "second_order"),
    ),
    "sensor_relaxation": Effect(
        "a ladder of Debye terms, nearly (iω/ω30)^(−n) from 0.1 Hz to 10 kHz, or one step 1 + s/(1 + iω/ω_s)",
        (FRF,),
        {"exponent": (0, 0.4), "step": (0, 5), "corner_hz": (1e-3, 1e4)},
        ("ladder", "step"),
        optional=("exponent", "step", "corner_hz"),
    ),
    "contact_creep": Effect(
        "standard linear solid: relaxes to E (1 − g) with τ; under constant load a³ grows with its creep compliance; "
        "of curves a second pair (g, τ) may relax too",
        (FRF, INDENTATION, COMPRESSION),
        {"fraction": (0, 0.95), "time_s": (1e-3, 1e6), "fraction_2": (0, 0.95), "time_2_s": (1e-3, 1e6)},
        optional=("fraction_2", "time_2_s"),
        only_curves=("fraction_2", "time_2_s"),
    ),
    "mains_pickup": Effect(
        "a charge at the mains frequency and a third of it at its third harmonic",
        (FRF,),
        {"charge_pc": (0, 1000), "mains_hz": (50, 60)},
    ),
    "amplitude_nonlinearity": Effect(
        "a fraction m of the contact edge follows the whole cycle: first harmonic of Fσ over Fd",
        (FRF,),
        {"mobility": (0, 1)},
    ),
    "crosstalk": Effect(
        "a fraction of the charge of each sensor within 1.2 pitch is added", (FRF,), {"fraction": (0, 1)}
    ),
    "timing_delay": Effect("delay of the charge", (FRF,), {"delay_us": (-1e4, 1e4)}),
    "instrument_compliance": Effect(
        "compliance of the stage, F/k", (INDENTATION, COMPRESSION), {"stiffness_n_per_mm": (1e-3, 1e6)}
    ),
    "liquid_drag": Effect(
        "a liquid drags on the moving sphere, c dz/dt", (INDENTATION,), {"coefficient_n_s_per_mm": (0, 1e3)}
    ),
    "platen_friction": Effect(
        "friction f at the ends of the cylinder: stiffer by 1 + 2 f S², S = diameter/(4 height)",
        (COMPRESSION,),
        {"friction": (0, 1)},
    ),
    "modulus_error": Effect("true E = factor · declared", (FRF, INDENTATION), {"factor": (0.2, 5)}),
    "thickness_error": Effect("true h = factor · declared", (FRF,), {"factor": (0.5, 2)}),
}

UNCATALOGUED: dict[str, Effect] = {
    "bending_substrate": Effect(
        "the plate bends between its supports: gain 1 + A (1 − X²)(1 − Y²), X, Y the position over the half plate",
        (FRF,),
        {"amplitude": (-1, 2)},
    ),
    "preload_leak": Effect(
        "charge leaks through a crack under load: high-pass with a corner proportional to (F/1 N)^p",
        (FRF,),
        {"corner_hz": (0, 100), "power": (0, 4)},
    ),
    "temperature_drift": Effect(
        "gain 1 + A sin(2π t/period) with the time of day", (FRF,), {"amplitude": (0, 1), "period_h": (0.1, 100)}
    ),
    "stage_wobble": Effect(
        "the true position moves on a circle from recording to recording",
        (FRF,),
        {"amplitude_mm": (0, 5), "period_recordings": (2, 1000)},
    ),
    "hysteretic_d33": Effect(
        "gain 1 − A where the previous preload was higher", (FRF,), {"amplitude": (-1, 1)}
    ),
    "rattle": Effect(
        "a loose part at a fixed frequency: 1 + A/(1 − (ω/ω1)² + 2iζω/ω1) − A",
        (FRF,),
        {"hz": (1, 1e4), "amplitude": (-2, 2), "damping": (1e-3, 1)},
    ),
    "notch": Effect(
        "notch: (s² + d b s + ω1²)/(s² + b s + ω1²)", (FRF,), {"hz": (1, 1e4), "left": (0, 5), "width_hz": (0.1, 1e4)}
    ),
    "cable_motion": Effect(
        "the cable vibrates above its resonance: 1 + A s²/(s² + 1.4 ω1 s + ω1²)",
        (FRF,),
        {"hz": (1, 1e4), "amplitude": (-2, 2)},
    ),
    "cracked_electrode": Effect(
        "the gain is lower by A from one load cycle on", (FRF,), {"amplitude": (-1, 1), "at_cycle": (0, 1e9)}
    ),
    "force_ripple": Effect(
        "ripple of the force with the pitch of the spindle: A F sin(2π u/pitch)",
        (INDENTATION, COMPRESSION),
        {"amplitude": (0, 1), "pitch_mm": (1e-4, 10)},
    ),
    "force_drift": Effect(
        "warming of the force cell: a force proportional to the square root of time",
        (INDENTATION, COMPRESSION),
        {"n_per_root_s": (-1, 1)},
    ),
    "thermal_drift": Effect(
        "the frame warms: displacement drifts by D (1 − e^(−t/τ))",
        (INDENTATION,),
        {"drift_mm": (-1, 1), "time_s": (1e-3, 1e6)},
    ),
    "guide_friction": Effect(
        "friction of the guide against the motion, μF, which turns round within a slip after each reversal",
        (INDENTATION,),
        {"friction": (0, 0.5), "slip_mm": (1e-7, 10)},
    ),
    "nonlinear_cell": Effect(
        "the force cell is not linear: F (1 + c F/range)",
        (INDENTATION,),
        {"nonlinearity": (-0.5, 0.5), "range_n": (1e-9, 1e4)},
    ),
    "plastic_set": Effect(
        "the surface stays behind: it sinks by a share of the largest depth so far", (INDENTATION,), {"ratio": (0, 0.8)}
    ),
    "flattened_tip": Effect(
        "the sphere is worn flat over a radius b: contact at δ = a √(a² − b²)/R", (INDENTATION,), {"radius_mm": (0, 10)}
    ),
    "rough_surface": Effect(
        "asperities close first: a further displacement s ln(1 + F/F_s)",
        (INDENTATION,),
        {"height_mm": (0, 1), "force_n": (1e-12, 100)},
    ),
    "tilted_platen": Effect(
        "the end face comes into contact gradually over a wedge", (COMPRESSION,), {"wedge_mm": (0, 5)}
    ),
}  # fmt: skip

_IN_CATALOGUE = {"amplitude_nonlinearity": "moving_contact_edge"}  # one law, at any amplitude and in its limit
ALL_EFFECTS = {**EFFECTS, **UNCATALOGUED}


def in_catalogue(effect: str) -> str:
    """The name of an effect in the catalogue of PHYSICS.md, section 8; `unknown` where it is not in it."""
    return "unknown" if effect in UNCATALOGUED else _IN_CATALOGUE.get(effect, effect)


def checked(kind: str, document: Any) -> dict[str, Values]:
    """The effects of a description, every parameter given and within its range; raises RigError."""
    given = checks.mapping("effects", document, tuple(ALL_EFFECTS))
    result: dict[str, Values] = {}
    for name, parameters in given.items():
        effect, field = ALL_EFFECTS[name], f"effects.{name}"
        if kind not in effect.kinds:
            raise RigError(field, kind, f"acts on recordings of kind {', '.join(effect.kinds)}")
        allowed = (*effect.parameters, *(("law",) if effect.laws else ()))
        stated = checks.mapping(field, {} if parameters is None else parameters, allowed)
        values: Values = {}
        if effect.laws:
            values["law"] = checks.choice(f"{field}.law", stated.get("law", effect.laws[0]), effect.laws)
        for parameter, (low, high) in effect.parameters.items():
            if parameter in stated:
                values[parameter] = checks.number(f"{field}.{parameter}", stated[parameter], low, high)
                if kind == FRF and parameter in effect.only_curves:
                    raise RigError(f"{field}.{parameter}", stated[parameter], "only for indentation and compression")
            elif parameter not in effect.optional:
                raise RigError(
                    f"{field}.{parameter}", None, f"required, {low:g} to {high:g}{checks.in_unit(parameter)}"
                )
        for parameter in needed_by_law(name, values):
            if parameter not in values:
                raise RigError(f"{field}.{parameter}", None, f"required by the law {values['law']}")
        _check_together(field, values)
        result[name] = values
    return result


def _check_together(field: str, values: Values) -> None:
    """Raise RigError where parameters of one effect exclude each other."""
    if ("fraction_2" in values) != ("time_2_s" in values):
        raise RigError(f"{field}.time_2_s", values.get("time_2_s"), "required with fraction_2, and only with it")
    if "fraction_2" in values and float(values["fraction"]) + float(values["fraction_2"]) > 0.95:
        raise RigError(f"{field}.fraction_2", values["fraction_2"], "must leave 0.05 of the modulus unrelaxed")
    work, separation = (values.get(name) for name in ("work_j_per_m2", "work_of_separation_j_per_m2"))
    if work is not None and separation is not None and float(separation) < float(work):
        allowed = f"must be at least work_j_per_m2, {float(work):g} J/m²"
        raise RigError(f"{field}.work_of_separation_j_per_m2", separation, allowed)


def needed_by_law(name: str, values: Values) -> tuple[str, ...]:
    """Which of an effect's optional parameters its law needs."""
    return {
        ("preload_dependent_d33", "saturating"): ("saturation_mpa",),
        ("sensor_relaxation", "ladder"): ("exponent",),
        ("sensor_relaxation", "step"): ("step", "corner_hz"),
    }.get((name, str(values.get("law"))), ())


def of(effects: Mapping[str, Values], name: str, parameter: str) -> float:
    """A parameter's value; 0 where the effect is off."""
    return float(effects[name][parameter]) if name in effects else 0.0

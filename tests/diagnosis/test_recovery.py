"""Every mechanism of the catalogue is recovered on every kind of recording that it acts on.

The recordings are those of the virtual rig, which shares no code with the diagnosis, or are drawn here: each campaign
hides one mechanism.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import underskin
from bench.soak import SOAK
from rig.description import parse
from rig.elastomer import campaign_of_curves, record_curves
from rig.recorded import campaign, record_lines
from tests.support.lean_reports import beside
from tests.support.sticking_punch import sticking_spheres
from tests.support.yielding_bodies import REDUCED, WAVE_NUMBERS, layer, press, transmitted
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import from_dict

_PRESENT = 0.8  # probability of the mechanism, or of those that these recordings cannot tell from it
_LEFT_OPEN = 0.2  # of its set, where the answer is ambiguous
# Among which it is sought, in `make soak` among all
_RIVALS = {
    "frf": ("modulus_error", "thickness_error", "sensor_spread", "moving_contact_edge", "contact_resonance"),
    **dict.fromkeys(  # on a layer
        ("sticking_contact", "elastic_tip", "film_shear"),
        ("modulus_error", "thickness_error", "moving_contact_edge", "layered_contact"),
    ),
    "indentation": ("modulus_error", "layered_contact", "instrument_compliance", "strain_stiffening"),
    "compression": ("modulus_error", "platen_friction", "strain_stiffening", "cell_collapse", "instrument_compliance"),
}


@dataclass(frozen=True)
class Hidden:
    """An effect of the rig, and what the report calls its parameters, where both have the same."""

    effect: Mapping[str, Any]
    reported: Mapping[str, str] = field(default_factory=dict)


HIDDEN: dict[tuple[str, str], Hidden] = {
    ("frf", "moving_contact_edge"): Hidden({"mobile_fraction": 0.8}, {"mobile_fraction": "mobile_fraction"}),
    ("frf", "layered_contact"): Hidden({}),
    ("frf", "misalignment"): Hidden({"x_mm": 0.5, "y_mm": -0.3}, {"offset_x": "x_mm", "offset_y": "y_mm"}),
    ("frf", "adhesion"): Hidden({"work_j_per_m2": 1.5}, {"work_of_adhesion": "work_j_per_m2"}),
    ("frf", "strain_stiffening"): Hidden({"coefficient": 6.0}, {"stiffening": "coefficient"}),
    ("frf", "compressible_layer"): Hidden({"poisson_ratio": 0.44}, {"poisson_ratio": "poisson_ratio"}),
    ("frf", "interface_slip"): Hidden({"glue_stiffness": 0.5}, {"glue_stiffness": "glue_stiffness"}),
    ("frf", "preload_dependent_d33"): Hidden({"beta_per_mpa": 1.5}, {"stress_coefficient": "beta_per_mpa"}),
    ("frf", "sensor_spread"): Hidden({"sd": 0.15}, {"spread": "sd"}),
    ("frf", "ageing"): Hidden({"rate": 0.2, "cycles": 500.0}, {"loss": "rate", "onset": "cycles"}),
    ("frf", "contact_resonance"): Hidden(
        {"tip_mass_g": 3.0, "damping": 0.05}, {"tip_mass": "tip_mass_g", "damping_ratio": "damping"}
    ),
    ("frf", "amplifier_high_pass"): Hidden({"corner_hz": 1.0}, {"corner": "corner_hz"}),
    ("frf", "amplifier_low_pass"): Hidden({"corner_hz": 250.0}, {"low_pass_corner": "corner_hz"}),
    ("frf", "sensor_relaxation"): Hidden({"exponent": 0.04}, {"exponent": "exponent"}),
    ("frf", "contact_creep"): Hidden(
        {"fraction": 0.5, "time_s": 20.0}, {"relaxed_fraction": "fraction", "relaxation_time": "time_s"}
    ),
    ("frf", "mains_pickup"): Hidden({"charge_pc": 0.2, "mains_hz": 50.0}, {"charge": "charge_pc"}),
    ("frf", "crosstalk"): Hidden({"fraction": 0.2}, {"fraction": "fraction"}),
    ("frf", "timing_delay"): Hidden({"delay_us": 80.0}, {"delay": "delay_us"}),
    ("frf", "modulus_error"): Hidden({"factor": 1.4}, {"modulus_factor": "factor"}),
    ("frf", "sticking_contact"): Hidden({"share": 1.0}, {"sticking_share": "share"}),
    ("frf", "elastic_tip"): Hidden({"ratio": 1.0}, {"modulus_ratio": "ratio"}),
    ("frf", "film_shear"): Hidden({"lag_mm": 0.3, "ratio": 0.5}, {"shear_lag": "lag_mm", "lateral_ratio": "ratio"}),
    ("frf", "thickness_error"): Hidden({"factor": 1.15}, {"thickness_factor": "factor"}),
    ("indentation", "layered_contact"): Hidden({}),
    ("indentation", "adhesion"): Hidden(
        {"work_j_per_m2": 0.3, "work_of_separation_j_per_m2": 0.5},
        {"work_of_adhesion": "work_j_per_m2", "work_of_separation": "work_of_separation_j_per_m2"},
    ),
    ("indentation", "strain_stiffening"): Hidden({"coefficient": 6.0}),  # in another parametrisation
    ("indentation", "compressible_layer"): Hidden({"poisson_ratio": 0.4}, {"poisson_ratio": "poisson_ratio"}),
    ("indentation", "contact_creep"): Hidden(
        {"fraction": 0.4, "time_s": 4.0}, {"relaxed_fraction": "fraction", "relaxation_time": "time_s"}
    ),
    ("indentation", "instrument_compliance"): Hidden({"stiffness_n_per_mm": 6.0}, {"stiffness": "stiffness_n_per_mm"}),
    ("indentation", "liquid_drag"): Hidden(
        {"coefficient_n_s_per_mm": 0.2}, {"drag_coefficient": "coefficient_n_s_per_mm"}
    ),
    ("indentation", "modulus_error"): Hidden({"factor": 1.5}, {"modulus_factor": "factor"}),
    ("compression", "strain_stiffening"): Hidden({"coefficient": 3.0}),  # in another parametrisation
    ("compression", "contact_creep"): Hidden(
        {"fraction": 0.3, "time_s": 10.0}, {"relaxed_fraction": "fraction", "relaxation_time": "time_s"}
    ),
    ("compression", "platen_friction"): Hidden({"friction": 0.5}),  # solved here, a formula in the rig
    ("compression", "instrument_compliance"): Hidden(
        {"stiffness_n_per_mm": 200.0}, {"stiffness": "stiffness_n_per_mm"}
    ),
    ("compression", "modulus_error"): Hidden({"factor": 1.5}, {"modulus_factor": "factor"}),
    ("compression", "cell_collapse"): Hidden(
        {"collapse": 0.08, "packed": 0.75}, {"collapse_strain": "collapse", "densification_strain": "packed"}
    ),
    ("compression", "cyclic_softening"): Hidden(
        {"lost": 0.35, "strain": 0.2}, {"softened_fraction": "lost", "softening_strain": "strain"}
    ),
}


def frfs(name: str) -> dict[str, Any]:
    """Three sensors of a soft skin, pressed so that all axes vary."""
    description = {
        "schema": "experiment/1", "name": name, "seed": 41, "kind": "frf",
        "skin": {"thickness_mm": 2.0, "youngs_modulus_mpa": 4.0, "sensor_radius_mm": 1.0, "d33_pc_per_n": 14.0,
                 "array": {"columns": 3, "rows": 1, "pitch_mm": 2.5}},
        "design": {"indenters_mm": [4.0, 8.0], "preloads_n": [0.2, 0.6, 1.2, 2.5], "dynamic_forces_n": [0.05, 0.15],
                   "offsets_mm": [[0.0, 0.0], [1.0, 0.0], [0.0, -1.4]], "dwells_s": [2.0, 30.0, 300.0],
                   "cycles_per_recording": 50.0, "shuffled": True},
        "lines": {"low_hz": 1.0, "high_hz": 1000.0, "count": 24},
        "noise": {"gain": 0.01, "line": 0.005, "floor_pc_per_n": 0.01},
        "effects": {name: dict(HIDDEN["frf", name].effect)},
    }  # fmt: skip
    return campaign(record_lines(parse(description)))


def curves(kind: str, name: str) -> dict[str, Any]:
    """Two spheres pressed in, held and drawn back, or two cylinders, at two speeds."""
    hidden = {name: dict(HIDDEN[kind, name].effect)}
    if name == "compressible_layer":  # it shows on a layer alone
        hidden["layered_contact"] = {}
    factor = hidden.pop("modulus_error")["factor"] if kind == "compression" and "modulus_error" in hidden else 1.0
    shape = {
        "indentation": {"indenters_mm": [2.5, 4.0], "largest_displacement_mm": 0.4, "approach_mm": 0.3,
                        "retreat_mm": 0.3, "stage_stiffness_n_per_mm": 50.0, "force_noise_n": 1e-3},
        "compression": {"heights_mm": [20.0, 10.0], "diameters_mm": [20.0], "largest_displacement_mm": 2.5,
                        "force_noise_n": 0.05},
    }[kind]  # fmt: skip
    experiment = parse({
        "schema": "experiment/1", "name": name, "seed": 43, "kind": kind,
        "skin": {"thickness_mm": 2.0 if "layered_contact" in hidden else 40.0, "youngs_modulus_mpa": 1.0,
                 "sensor_radius_mm": 1.0, "d33_pc_per_n": 14.0},
        "curves": {**shape, "samples": 240, "speeds_mm_per_s": [0.1, 0.5], "hold_s": 6.0, "gain": 0.005,
                   "cell_gain": 0.005, "modulus_declared": name == "modulus_error"},
        "effects": hidden,
    })  # fmt: skip
    document = campaign_of_curves(experiment, record_curves(experiment))
    if factor != 1.0:  # of a block the rig has no such effect: it is declared otherwise
        document["skin"]["youngs_modulus_mpa"] /= factor
    return document


def cycles(name: str) -> dict[str, Any]:
    """A cylinder of 1 MPa pressed by half its height twice, of a foam or of a solid that the first loading softens."""
    height, area, hidden = 20.0, 100 * math.pi, HIDDEN["compression", name].effect
    strain = np.tile(np.append(np.linspace(0.0, 0.5, 120), np.linspace(0.5, 0.0, 120)), 2)
    if name == "cell_collapse":
        stress = hidden["collapse"] * (1 - np.exp(-strain / hidden["collapse"])) / (1 - strain / hidden["packed"])
    else:
        largest = [max(strain[: number + 1]) for number in range(len(strain))]
        lost = hidden["lost"] * (1 - np.exp((strain - largest) / hidden["strain"]))
        stress = ((1 - strain) ** -2 - (1 - strain)) / 3 * (1 - lost)
    noise = np.random.default_rng(47).normal(0.0, 0.05, len(strain))
    recording = {
        "id": "block", "kind": "compression", "sample_height_mm": height, "sample_diameter_mm": 20.0,
        "displacement_mm": (height * strain).tolist(), "force_n": (area * stress + noise).tolist(),
        "time_s": np.linspace(0.0, 400.0, len(strain)).tolist(),
    }  # fmt: skip
    return {"schema": "campaign/1", "name": name, "skin": {"poisson_ratio": 0.5}, "recordings": [recording]}


_DISC = 0.5  # radius of the sensor over the layer's thickness


def sticking() -> list[tuple[float, float, float]]:
    """FR/(Gh³), offset over h and σ of spheres that stick to a layer."""
    solved = sticking_spheres(1.5, np.array([_DISC]))
    pressed = zip(solved.a, solved.load, solved.sigma[:, 0], strict=True)
    return [(float(load), 0.0, float(sigma)) for a, load, sigma in pressed if a > 0.3]


def yielding(tip: float, film: float, lag: float) -> list[tuple[float, float, float]]:
    """The same of frictionless ones with E'/E'_tip = `tip`; a film's charge is `film` times C of `film_strain`."""
    pressure, shear, _ = layer()
    passed = pressure + film * lag**2 * WAVE_NUMBERS * shear / (1 + (lag * WAVE_NUMBERS) ** 2)
    rows = []
    for depth in np.geomspace(3e-4, 0.03, 8):
        force, shape = press(50.0, float(depth), tip)
        rows += [(50.0 * force, offset, transmitted(passed * shape, _DISC, offset)) for offset in (0.0, 0.5, 1.0)]
    return rows


def lenses(name: str) -> dict[str, Any]:
    """Two spheres, so wide that strains are small, on a layer of 2 mm and 4 MPa by the linear theory."""
    thickness, d33, hidden = 2.0, 14.0, HIDDEN["frf", name].effect
    shear = REDUCED / 3
    solved = (
        sticking()
        if name == "sticking_contact"
        else yielding(1 / hidden["ratio"], 0.0, 1.0)
        if name == "elastic_tip"
        else yielding(0.0, hidden["ratio"] * 1.35 * thickness / 0.05, hidden["lag_mm"] / thickness)
    )
    random = np.random.default_rng(53)
    recordings: list[dict[str, Any]] = []
    for radius in (200.0, 400.0):
        for load, offset, sigma in solved:
            frf = 1.5 * _DISC**2 * d33 * sigma * math.exp(random.normal(0.0, 0.005))
            recordings.append({
                "id": f"r{len(recordings)}", "sensor": "s", "indenter_radius_mm": radius, "dynamic_force_n": 0.001,
                "preload_n": load * shear * thickness**3 / radius, "position_mm": [offset * thickness, 0.0],
                "frequency_hz": np.geomspace(1.0, 100.0, 16).tolist(),
                "frf_re_pc_per_n": (frf * (1 + random.normal(0.0, 0.003, 16))).tolist(),
                "frf_im_pc_per_n": (frf * random.normal(0.0, 0.003, 16)).tolist(),
            })  # fmt: skip
    skin = {
        "thickness_mm": thickness, "youngs_modulus_mpa": 3 * shear, "poisson_ratio": 0.5, "sensor_radius_mm": 1.0,
        "d33_pc_per_n": None, "sensors": [{"id": "s", "x_mm": 0.0, "y_mm": 0.0}],
    }  # fmt: skip
    return {"schema": "campaign/1", "name": name, "units_checked": True, "skin": skin, "recordings": recordings}


# Of which the rig has no effect
DRAWN = {
    "cell_collapse": cycles,
    "cyclic_softening": cycles,
    **dict.fromkeys(("sticking_contact", "elastic_tip", "film_shear"), lenses),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for name, mechanism in CATALOGUE.items() for kind in mechanism.kinds]
)
def test_mechanism_is_recovered(kind: str, name: str) -> None:
    """It is named, alone or with what cannot be told from it, and its true parameters lie in their intervals.

    One campaign stands for each: the intervals are taken twice as wide, which a true value leaves once in 10,000 times.
    """
    document = DRAWN[name](name) if name in DRAWN else frfs(name) if kind == "frf" else curves(kind, name)
    made, refused = from_dict(document)
    assert not refused
    report = underskin.diagnose(made, without=() if SOAK else beside(name, *_RIVALS.get(name, _RIVALS[kind])))
    present = sum(group.probability for group in report.presence if name in group.mechanisms)
    sets = [([one.name for one in report.mechanisms], report.probability)]
    sets += [(list(rival.mechanisms), rival.probability) for rival in report.alternatives]
    left_open = report.verdict == "ambiguous" and max((p for names, p in sets if names == [name]), default=0.0)
    assert present >= _PRESENT or left_open >= _LEFT_OPEN, report.statement
    hidden = HIDDEN[kind, name]
    for parameter in [one for mechanism in report.mechanisms for one in mechanism.parameters]:
        effect = hidden.reported.get(parameter.name, "")
        if effect in hidden.effect and parameter.low is not None and parameter.high is not None:
            margin = (parameter.high - parameter.low) / 2
            assert parameter.low - margin <= hidden.effect[effect] <= parameter.high + margin, parameter

"""The headline of reports as they are kept, old ones included: at most 20 words, with the answer and its number."""

from typing import Any

import pytest

from underskin.diagnosis.reporting.headline import first_and_rest

D33 = {"name": "d33", "unit": "pC/N", "value": -30.0, "low": -31.0, "high": -29.0}
DELAY = {"name": "delay", "unit": "µs", "value": 14.2, "low": 13.4, "high": 15.1}
LONG = {**DELAY, "value": -20000.4, "low": -20002.6, "high": -19998.2}
DRAG = {"name": "drag_coefficient", "unit": "N·s/mm", "value": 5.232e-8, "low": 5.043e-8, "high": 5.428e-8}
KNOWN = {"name": "youngs_modulus", "unit": "MPa", "value": 2.0, "low": 1.8, "high": 2.2}
SIGN = [{"code": "sign_flipped", "recording": "r1"}]


def mechanism(name: str, *parameters: dict[str, Any]) -> dict[str, Any]:
    return {"name": name, "probability": 0.97, "parameters": list(parameters)}


@pytest.mark.parametrize(
    ("kept", "headline"),
    [
        ({"d33": D33}, "Nothing is missing; d33 −30 pC/N (−31 to −29)"),  # kept before reports had `quotable`
        ({"d33": {"quotable": False}}, "Nothing is missing"),
        ({"remainder": {"percent": 1.81, "over_noise": 7.0}},
         "No known mechanism is missing, 1.8 % of the force is unexplained"),
        ({"remainder": {"percent": 1.81, "over_noise": 7.0},
          "findings": [{"code": "thickness_differs", "statement": "H may, by " + 8 * "far " + "not be: …"}]},
         "H may, by " + 8 * "far " + "not be; 1.8 % of the force is unexplained"),
        ({"probability": 0.6, "alternatives": [{"mechanisms": ["adhesion"], "probability": 0.3}]},
         "Perhaps nothing is missing (60 %), or adhesion"),
        ({"verdict": "explained", "mechanisms": [mechanism("timing_delay", DELAY)]},
         "Timing delay, delay 14.2 µs (13.4–15.1)"),
        ({"verdict": "explained", "mechanisms": [mechanism("liquid_drag", DRAG)]},
         "Liquid drag, drag coefficient 52.3 nN·s/mm (50.4–54.3)"),
        ({"verdict": "explained", "mechanisms": [mechanism("timing_delay", LONG)]},
         "Timing delay, delay −20000 µs (−20003 to −19998)"),
        ({"verdict": "explained", "mechanisms": [mechanism("timing_delay", {**DELAY, "at_bound": "high"})]},
         "Timing delay, delay at or beyond 14.2 µs"),
        ({"verdict": "explained", "mechanisms": [mechanism("timing_delay", {**DELAY, "value": None})]}, "Timing delay"),
        ({"verdict": "explained", "mechanisms": 12 * [mechanism("timing_delay")]}, "12 mechanisms are missing (97 %)"),
        ({"verdict": "ambiguous", "findings": SIGN},
         "Sign reversed; nothing missing (97 %), not settled"),
        ({"verdict": "ambiguous", "findings": [{"code": "thickness_differs", "statement": "H may not be 2 mm: …"}]},
         "H may not be 2 mm; nothing missing (97 %), not settled"),
        ({"verdict": "explained", "mechanisms": [mechanism("layered_contact")]}, "Thin layer"),
        ({"verdict": "unexplained", "unnamed": {"acts_on": "force", "axis": "displacement_mm"}},
         "No known mechanism describes this (97 %): the force that is read changes with the depth"),
        ({"verdict": "unexplained"}, "Something is missing that no known mechanism describes (97 %)"),
        ({"verdict": "insufficient_data", "statement": "Too little: one FRF. Add more."}, "Too little: one FRF"),
        ({"verdict": "insufficient_data", "statement": 21 * "much "}, "Nothing can be concluded from these recordings"),
        ({"campaigns": ["a", "b"], "statement": "Both agree. No more."}, "Both agree"),
        ({"headline": "Adhesion."}, "Adhesion"),
        ({"fit": {"after": {"youngs_modulus": KNOWN}}}, "Nothing is missing; E 2 MPa (1.8–2.2)"),
        ({"fit": {"after": {"youngs_modulus": {**KNOWN, "low": 0.2, "high": 2.1}}}},
         "Nothing is missing; no E to quote"),
    ],
)  # fmt: skip
def test_a_headline_of_a_kept_report(kept: dict[str, Any], headline: str) -> None:
    report = {"verdict": "no_mismatch", "probability": 0.97, "statement": "S.", "mechanisms": [], **kept}
    assert first_and_rest(report)[0] == headline

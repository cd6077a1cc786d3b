"""Curves that count pressing negative: told, turned on demand, and never given a negative modulus."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tests.support.blocks import block
from underskin import InvalidInput
from underskin.recordings import curve_signs, elastomer, plausibility
from underskin.recordings.campaign import Campaign, IndentationRecording, from_dict

SIGNS = list(product((1, -1), (1, -1)))
NAMES = ("force_n", "displacement_mm")


def pressed_block(force: int, travel: int) -> Campaign:
    campaign, problems = from_dict(block("block", force=force, travel=travel))
    assert problems == []
    return campaign


def pressed_sphere(force: int, travel: int) -> Campaign:
    """A sphere of 4 mm after Hertz, E = 1.5 MPa, that adheres: on the way out the force is a pull for a while."""
    depth_mm = np.concatenate([np.linspace(-0.1, 0.5, 61), np.linspace(0.49, -0.1, 60)])
    load_n = 4 / 3 * 1.5 / 0.75 * 2 * np.maximum(depth_mm, 0) ** 1.5
    load_n[(np.arange(121) > 61) & (np.abs(depth_mm) < 0.05)] -= 0.3
    sphere = IndentationRecording(
        id="sphere", sensor=None, indenter_radius_mm=4.0, displacement_mm=travel * depth_mm, force_n=force * load_n
    )
    return replace(pressed_block(1, 1), recordings=(sphere,))


@pytest.mark.parametrize(("force", "travel"), SIGNS)
@pytest.mark.parametrize(("make", "modulus_mpa"), [(pressed_block, 2.0), (pressed_sphere, 1.5)])
def test_what_is_negative_is_told_and_turned(make: object, modulus_mpa: float, force: int, travel: int) -> None:
    assert callable(make)
    campaign = make(force, travel)
    expected = [name for name, sign in zip(NAMES, (force, travel), strict=True) if sign < 0]
    told = [finding for finding in plausibility.implausible(campaign) if finding.code == "sign_flipped"]
    assert [finding.arguments["fields"] for finding in told] == ([expected] if expected else [])
    turned, changed = curve_signs.turned(campaign)
    assert changed == bool(expected)
    (found,) = elastomer.of_campaign(turned)
    assert not isinstance(found.result, InvalidInput)
    assert found.result.modulus == pytest.approx(1e6 * modulus_mpa, rel=0.02)


@pytest.mark.parametrize(("force", "travel"), SIGNS)
@pytest.mark.parametrize("make", [pressed_block, pressed_sphere])
def test_no_modulus_is_negative(make: object, force: int, travel: int) -> None:
    assert callable(make)
    (found,) = elastomer.of_campaign(make(force, travel))
    assert isinstance(found.result, InvalidInput) or found.result.modulus > 0

"""Curves that count pressing negative: told, turned on demand, and never given a negative modulus."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tests.support.blocks import block
from underskin import InvalidInput
from underskin.inversion import elastomer
from underskin.recordings import curve_preparation, plausibility
from underskin.recordings.block_modulus import CompressionModulus
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, from_dict

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


def adhesive(start_mm: float, end_mm: float, force: int, travel: int) -> IndentationRecording:
    """A sphere of 4 mm after JKR, E' = 0.2 MPa, pressed with 10 mN; it comes off at about −20 mN."""
    radius, modulus, adhesion = 4e-3, 2e5, 1.0
    radii = np.linspace((np.pi * adhesion * radius**2 / (8 * modulus)) ** (1 / 3), 1.2e-3, 4000)
    depths = radii**2 / radius - np.sqrt(2 * np.pi * adhesion * radii / modulus)
    loads = 4 / 3 * modulus * radii**3 / radius - np.sqrt(8 * np.pi * adhesion * modulus * radii**3)
    last = int(np.searchsorted(loads, 0.01))
    way_in = np.linspace(1e-3 * start_mm, depths[last], 80)
    way_out = np.linspace(depths[last], 1e-3 * end_mm, 80)
    load_in = np.where(way_in <= 0, 0.0, np.interp(way_in, depths, loads))  # it snaps in where it touches
    load_out = np.interp(way_out, depths, loads, left=0.0)
    assert load_out.max() == pytest.approx(0.01, rel=0.02)
    assert load_out.min() < -0.015
    depth_mm = 1e3 * np.concatenate([way_in, way_out])
    load_n = np.concatenate([load_in, load_out])
    return IndentationRecording(
        id="adhesive", sensor=None, indenter_radius_mm=4.0, displacement_mm=travel * depth_mm, force_n=force * load_n
    )


@pytest.mark.parametrize(("force", "travel"), SIGNS)
@pytest.mark.parametrize(("start_mm", "end_mm"), [(-0.05, -0.05), (0.0, 0.0), (0.0, -0.6), (-0.05, -0.6)])
def test_pulls_sphere_way_out_tells_no_sign(start_mm: float, end_mm: float, force: int, travel: int) -> None:
    """What pulls a sphere on its way out tells no sign."""
    expected = tuple(name for name, sign in zip(NAMES, (force, travel), strict=True) if sign < 0)
    assert curve_preparation.orientation(adhesive(start_mm, end_mm, force, travel)).negative == expected


@pytest.mark.parametrize(("force", "travel"), SIGNS)
@pytest.mark.parametrize(("make", "modulus_mpa"), [(pressed_block, 2.0), (pressed_sphere, 1.5)])
def test_what_is_negative_is_told_and_turned(make: object, modulus_mpa: float, force: int, travel: int) -> None:
    assert callable(make)
    campaign = make(force, travel)
    expected = [name for name, sign in zip(NAMES, (force, travel), strict=True) if sign < 0]
    told = [finding for finding in plausibility.implausible(campaign) if finding.code == "sign_flipped"]
    assert [finding.arguments["fields"] for finding in told] == ([expected] if expected else [])
    turned, changed = curve_preparation.turned(campaign)
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


@pytest.mark.parametrize(("force", "travel"), SIGNS)
@pytest.mark.parametrize("way", [1, -1])
def test_pulled_and_pressed_in_one_table(force: int, travel: int, way: int) -> None:
    """From 100 % of extension to 40 % of compression, or back: the law tells the signs, and so do the words."""
    strain = np.linspace(1.0, -0.4, 60)[::way]
    load_n = np.pi / 4 * 25 / 3 * ((1 + strain) - (1 + strain) ** -2)
    load_n += 0.005 * np.abs(load_n).max() * np.random.default_rng(0).standard_normal(60)
    strip = CompressionRecording("strip", 30.0, 5.0, -travel * 30 * strain, force_n=-force * load_n)
    campaign = replace(pressed_block(1, 1), recordings=(strip,))
    result = elastomer.of_campaign(campaign)[0].result
    assert isinstance(result, CompressionModulus)
    assert result.modulus == pytest.approx(1e6, rel=0.02)
    ends = ("pulled by", "pressed by")[::way]
    assert result.statement.index(ends[0]) < result.statement.index(ends[1])
    negative = [name for name, sign in zip(NAMES, (force, travel), strict=True) if sign < 0]
    findings = [finding.arguments for finding in curve_preparation.prepared(campaign).findings]
    assert [finding["fields"] for finding in findings] == ([negative] if negative else [])
    assert not any(finding["may_be_pulled"] for finding in findings)

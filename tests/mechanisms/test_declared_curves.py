"""Laws of indentation curves that a lab declares in files: what each acts on, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.declared_documents import refusal
from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.declared.document import parse
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.models.indentation import IndentationModel
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.recordings.campaign import Campaign, IndentationRecording
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats

BENT = """\
schema: mechanism/1
name: bent
description: A cell that reads less the larger the force.
acts_on: gain
axes: [force_n]
law: 1 - bend * force_n
parameters:
  bend: {unit: 1/N, low: -1, high: 1, prior: {mean: 0, sd: 0.1}, limit: 0}
source: Calibrated with weights.
"""
BEND = 0.05


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return reference_campaign("indentation")


def mechanism(acts_on: str, axis: str, law: str) -> DeclaredMechanism:
    text = BENT.replace("acts_on: gain", f"acts_on: {acts_on}").replace("[force_n]", f"[{axis}]")
    return parse(text.replace("1 - bend * force_n", law).encode(), "lab.yaml")


def forces(campaign: Campaign, *mechanisms: Mechanism, nearer_mm: float = 0.0) -> Floats:
    """[N] of all samples, the parameters of the mechanisms at BEND and the others at their priors' centres."""
    model = IndentationModel(mechanisms, campaign)
    fit = np.array([BEND if entry.name == "bend" else entry.quantile(0.5) for entry in model.parameters])
    fit[model.contact_points] -= nearer_mm
    return np.asarray(model.forces(fit[None])[0])


def depths_and_times(campaign: Campaign) -> tuple[Floats, Floats]:
    """[mm] from contact at displacement 0 and [s] from the beginning, of all samples."""
    own = [entry for entry in campaign.recordings if isinstance(entry, IndentationRecording)]
    depth = np.concatenate([np.maximum(entry.displacement_mm, 0.0) for entry in own])
    times = [entry.time_s for entry in own]
    return depth, np.concatenate([time - time[0] for time in times if time is not None])


def test_factors_act_on_the_force_and_additions_add_to_it(campaign: Campaign) -> None:
    timed = [entry for entry in campaign.recordings if isinstance(entry, IndentationRecording)]
    later = tuple(replace(entry, time_s=7.0 + np.arange(float(len(entry.force_n)))) for entry in timed)
    campaign = replace(campaign, recordings=later)
    plain = forces(campaign)
    depth, time = depths_and_times(campaign)
    cell = forces(campaign, mechanism("gain", "force_n", "1 - bend * force_n"))
    assert cell == pytest.approx(plain * (1 - BEND * np.maximum(plain, 0.0)), rel=1e-9)
    body = forces(campaign, mechanism("modulus", "displacement_mm", "1 + bend * displacement_mm"))
    assert body == pytest.approx(plain * (1 + BEND * depth), rel=1e-6)
    drift = forces(campaign, mechanism("force", "time_s", "bend * sqrt(time_s)"))
    assert drift == pytest.approx(plain + BEND * np.sqrt(time), rel=1e-9)


def test_times_are_needed_where_the_law_reads_them(campaign: Campaign) -> None:
    own = [entry for entry in campaign.recordings if isinstance(entry, IndentationRecording)]
    untimed = replace(campaign, recordings=tuple(replace(entry, time_s=None) for entry in own))
    creeping = mechanism("modulus", "time_s", "1 - bend * time_s")
    assert creeping.unsupported(untimed, "indentation") == "not every recording has time_s"
    assert creeping.kinds == ("indentation",)


def test_a_bound_law_counts_time_from_where_the_recording_began(campaign: Campaign) -> None:
    """Also where its first half is held out."""
    own = [entry for entry in campaign.recordings if isinstance(entry, IndentationRecording)]
    timed = [replace(entry, time_s=7.0 + np.arange(float(len(entry.force_n)))) for entry in own]
    whole = replace(campaign, recordings=tuple(timed))
    halves = [len(entry.force_n) // 2 for entry in own]
    later = [
        replace(entry, displacement_mm=entry.displacement_mm[half:], force_n=entry.force_n[half:], time_s=time[half:])
        for entry, half in zip(timed, halves, strict=True)
        for time in [entry.time_s]
        if time is not None
    ]
    drift = mechanism("force", "time_s", "bend * time_s").bind(whole, load_table())
    part = replace(campaign, recordings=tuple(later))
    added = forces(part, drift) - forces(part)
    expected = [BEND * np.arange(float(len(entry.force_n)))[half:] for entry, half in zip(own, halves, strict=True)]
    assert added == pytest.approx(np.concatenate(expected))


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("axes: [force_n]", "axes: [force_n, preload_n]", 5, "force_n is of the samples of curves"),
        ("acts_on: gain", "acts_on: thickness", 4, "must be one of modulus, gain, force, position"),
        ("1 - bend * force_n", "1 - i * bend * force_n", 6, "must be real"),
        ("law: 1 - bend * force_n", "law: [bend * force_n, force_n]", 6, "must be one expression"),
        ("[force_n]", "[force_n, time_s]", 5, "is not in the law"),
        ("1 - bend * force_n", "1 + bend * log(force_n)", 6, "is no number where force_n is 0"),
        ("1 - bend * force_n", "1 + sqrt(force_n - 0.2 - bend)", 6, "is no number where force_n is 0"),
        ("1 - bend * force_n", "bend * force_n", 6, "must be 1, which changes nothing"),
        ("acts_on: gain", "acts_on: position", 5, "of a position is a stage that gives"),
        ("mean: 0, sd", "mean: 3, sd", 8, "must lie within -1 to 1"),
    ],
)
def test_what_cannot_act_on_curves_is_refused_with_its_line(old: str, new: str, line: int, said: str) -> None:
    error = refusal(BENT.replace(old, new))
    assert error.place == f"line {line}"
    assert said in error.reason

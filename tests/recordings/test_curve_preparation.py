"""Curves are read whatever way they were stored: sign, direction and order, saturation, an error that is periodic."""

import numpy as np
import pytest

from tests.support.blocks import sample
from tests.support.sphere_curves import campaign, hertz, pressed, ways
from underskin import diagnose, read_file
from underskin.errors import InvalidInput
from underskin.findings.codes import FindingCode
from underskin.findings.finding import Finding
from underskin.inversion import elastomer
from underskin.recordings import rig_description
from underskin.recordings.campaign import Campaign
from underskin.recordings.curve_course import contact_events
from underskin.recordings.curve_preparation import falling
from underskin.recordings.damaged_readings import marks, spikes
from underskin.recordings.plausibility import at_reading, implausible

pytestmark = pytest.mark.slow


def modulus_mpa(read: Campaign) -> float:
    (found,) = elastomer.of_campaign(read)
    assert not isinstance(found.result, InvalidInput), found.result
    return found.result.modulus / 1e6


def only(read: Campaign) -> Finding:
    (finding,) = implausible(read)
    return finding


@pytest.mark.parametrize("most", [0.5, 1.0])
def test_a_force_that_is_held_or_beyond_its_range_is_no_air(most: float) -> None:
    """Recorded from rest at a force of 0: where the force then stays while the travel goes on, no sign is turned."""
    depth = np.concatenate([np.zeros(20), np.linspace(0.0, 0.25, 200), np.linspace(0.25, 0.3, 300)])
    held = np.minimum(hertz(depth), most * hertz(np.array(0.25)))
    noise = np.random.default_rng(5).normal(0.0, 1e-3 * held.max(), (2, len(depth)))
    assert falling(held + noise[0], depth + 1e-4 * noise[1], sphere=True) == ()


@pytest.mark.parametrize("force", [1, -1])
@pytest.mark.parametrize("travel", [1, -1])
@pytest.mark.parametrize("start_mm", [0.0, 0.02])
def test_a_lift_before_the_press_tells_no_sign(start_mm: float, force: int, travel: int) -> None:
    """The tip is lifted first, from the air or from a preload: each column's sign is told from the whole curve."""
    depth = ways(start_mm, -0.03, 0.25, -0.05)
    expected = [name for name, sign in (("force_n", force), ("displacement_mm", travel)) if sign < 0]
    assert list(falling(force * pressed(depth), travel * depth, sphere=True)) == expected
    read = campaign(travel * depth, force * pressed(depth))
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.02)
    assert [one.arguments["fields"] for one in implausible(read)] == ([expected] if expected else [])


@pytest.mark.parametrize("sign", [1, -1])
def test_a_relaxation_hold_turns_no_sign(sign: int) -> None:
    """While the stage holds, the force relaxes by more than half; the way in tells the deep end all the same."""
    depth = np.concatenate([np.linspace(-0.1, 0.3, 400), np.full(800, 0.3), np.linspace(0.3, -0.1, 400)])
    relaxed = 1 - 0.55 * (1 - np.exp(-np.clip(np.arange(1600) - 400, 0, 800) / 150))
    expected = ("force_n", "displacement_mm") if sign < 0 else ()
    for seed in range(2):
        noise = 1e-3 * hertz(np.array(0.3)) * np.random.default_rng(seed).normal(size=1600)
        force = hertz(np.maximum(depth, 0.0)) * relaxed + noise
        assert falling(sign * force, sign * depth, sphere=True) == expected


def test_rows_from_the_deepest_to_the_air_are_read_backwards() -> None:
    """Without times, rows of one way may have been stored in either order; nothing is called negative."""
    depth = ways(0.3, -0.1, samples=400)
    read = campaign(depth, pressed(depth), timed=False)
    assert only(read).code == "rows_reversed"
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("corners", [(-0.1, 0.3), (-0.1, 0.3, -0.1)])
def test_samples_of_a_saturated_channel_are_left_out_and_named(corners: tuple[float, ...]) -> None:
    """The force reads one number while the sphere goes on: it is no property of the sample."""
    depth = ways(*corners)
    force = np.minimum(pressed(depth), 0.75 * hertz(np.array(0.3)))
    finding = only(campaign(depth, force))
    assert finding.code == "force_saturates"
    assert finding.arguments["samples"] == int((force == force.max()).sum())
    assert modulus_mpa(campaign(depth, force)) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("corners", [(-0.1, 0.3, -0.1), (-0.1, 0.3, 0.3), (-0.1, 0.3, 0.3, 0.3, -0.1)])
def test_a_quiet_zero_and_a_hold_hide_no_saturation(corners: tuple[float, ...]) -> None:
    """The air reads one value for long, and the stage may hold while the channel saturates."""
    depth = ways(*corners)
    force = np.minimum(np.round(pressed(depth) / 2e-3) * 2e-3, (0.75 * hertz(np.array(0.3))).round(3)).round(7)
    finding = only(campaign(depth, force))
    assert finding.code == "force_saturates"
    assert finding.arguments["samples"] == int((force > force.max() - 1e-4).sum())


@pytest.mark.parametrize("corners", [(-0.1, 0.3), (-0.1, 0.3, -0.1)])
@pytest.mark.parametrize("bits", [12, 16])
def test_a_limit_at_which_the_last_bit_flickers_or_noise_lies_is_one(bits: int, corners: tuple[float, ...]) -> None:
    """A channel at its limit reads one value, but for the last bit of a converter and for noise added behind it."""
    depth, random = ways(*corners), np.random.default_rng(bits)
    limit = 0.75 * hertz(np.array(0.3))
    step = 2.0 * limit / 2**bits
    clipped = np.minimum(pressed(depth), limit)
    for force in (
        np.round(clipped / step) * step - step * (random.random(len(depth)) < 0.5) * (clipped == limit),
        clipped + 1e-3 * limit * random.normal(size=len(depth)),
        np.round((clipped + 3e-4 * limit * random.normal(size=len(depth))) / (5e-4 * limit)) * 5e-4 * limit,
    ):
        finding = only(campaign(depth, force))
        assert finding.code == "force_saturates"
        assert finding.arguments["samples"] >= 0.98 * int((clipped == limit).sum())
        assert modulus_mpa(campaign(depth, force)) == pytest.approx(1.0, rel=0.02)


def test_a_step_of_the_reading_is_taken_out() -> None:
    """Between the hold and the way back the displacement reads 0.02 mm more at once, and the force stays."""
    depth = ways(-0.1, 0.3, 0.3, -0.1)
    read = np.where(np.arange(len(depth)) < 480, depth, depth + 0.02)
    (finding,) = implausible(campaign(read, pressed(depth)))
    assert finding.code == "reading_steps"
    assert finding.arguments["step_mm"] == pytest.approx(0.02, rel=0.15)
    assert modulus_mpa(campaign(read, pressed(depth))) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(("factor", "offset"), [(0.85, 0.0), (0.5, 0.0), (1.2, 0.0), (1.0, -0.3)])
@pytest.mark.parametrize("corners", [(-0.1, 0.3), (-0.1, 0.3, -0.1)])
def test_a_leap_of_the_force_ends_the_contact(factor: float, offset: float, corners: tuple[float, ...]) -> None:
    """Where the sample tears, or a range or zero is changed, what follows is not of the same contact."""
    depth = ways(*corners)
    force = pressed(depth)
    torn = np.arange(len(depth)) >= int(np.argmax(depth > 0.2))
    read = np.where(torn, factor * force + offset * float(hertz(np.array(0.3))), force)
    (finding,) = implausible(campaign(depth, read))
    assert finding.code == "force_steps"
    assert finding.arguments["at_mm"] == pytest.approx(0.2, abs=0.01)
    assert modulus_mpa(campaign(depth, read)) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(("sign", "slipped_mm", "gain"), [(-1, 0.3, 1.0), (1, 0.0, 2.0), (1, 0.0, 0.85)])
def test_a_leap_of_the_force_ends_the_curve_of_a_block_or_strip(sign: int, slipped_mm: float, gain: float) -> None:
    """A strip of 10 mm slips in its clamp, or the cell that presses a block changes its range."""
    travel = ways(0.0, 2.0, 0.0)
    after = np.arange(len(travel)) >= int(np.argmax(travel > 0.8))
    stretch = 1 - sign * (travel - slipped_mm * after) / 10
    force = np.where(after, gain, 1.0) * np.pi / 4 * 10**2 * (stretch**-2 - stretch) / 3
    force += 1e-3 * np.random.default_rng(7).normal(size=len(force)) * np.abs(force).max()
    read = sample(sign * travel, force)
    finding = only(read)
    assert finding.code == "force_steps"
    assert finding.arguments["at_mm"] == pytest.approx(sign * 0.8, abs=0.02)
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize("samples_after", [300, 3, 1])
def test_a_strip_that_breaks_ends_its_curve(samples_after: int) -> None:
    """What the cell reads after it, however long the machine goes on, is no force of the strip."""
    travel = np.linspace(0.0, 5.0, 1000)[: 600 + samples_after]
    force = np.pi / 4 * 5**2 * ((1 + travel / 20) ** -2 - (1 + travel / 20)) / 3
    force = np.where(np.arange(len(travel)) < 600, force, 0.0)
    force += 1e-3 * np.random.default_rng(3).normal(size=len(force)) * np.abs(force).max()
    read = sample(-travel, force, height_mm=20.0, diameter_mm=5.0)
    (samples,) = (finding.arguments["samples"] for finding in implausible(read) if finding.code == "force_steps")
    assert samples == samples_after
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.01)


def test_a_leap_in_a_noisy_curve_of_few_samples_is_found() -> None:
    """The cell's range changes by a tenth under a sphere of 4 mm: the modulus is that of the samples before."""
    depth = np.linspace(-0.12, 0.6, 150)
    force = 16 / 9 * 2 * np.maximum(depth, 0.0) ** 1.5
    force = np.where(np.arange(150) < 90, force, 1.1 * force)
    force += 3e-3 * force.max() * np.random.default_rng(7).normal(size=150)
    report = diagnose(campaign(depth, force, timed=False, indenter_radius_mm=4.0)).document
    assert "force_steps" in {finding["code"] for finding in report["findings"]}
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] < 1 < modulus["high"]


def test_one_leap_among_changes_below_the_noise_tells_no_sign() -> None:
    """A strip slips in its clamp by 2 % and is not let go: only that change of the force stands off the noise."""
    extension = np.linspace(0.0, 20.0, 200)
    stretch = 1 + (extension - 1.0 * (np.arange(200) >= 100)) / 50
    force = 20 * (stretch - stretch**-2) / 3
    force += 3e-3 * force.max() * np.random.default_rng(7).normal(size=200)
    read = sample(-extension, -force, height_mm=50.0, diameter_mm=(80 / np.pi) ** 0.5)
    assert only(read).code == "force_steps"
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.02)


def test_a_held_reading_of_the_force_is_no_leap() -> None:
    """A channel that is read at a tenth of the rate leaps everywhere by as much."""
    depth = ways(-0.1, 0.3, -0.1)
    force = np.repeat(pressed(depth)[::10], 10)[: len(depth)]
    assert "force_steps" not in {finding.code for finding in implausible(campaign(depth, force))}


@pytest.mark.parametrize(("samples", "digit_n"), [(1000, 0.01), (3000, 0.001)])
def test_the_last_digit_of_a_force_without_noise_is_no_leap(samples: int, digit_n: float) -> None:
    """Of a smooth force that is rounded, the change differs by one digit now and then."""
    travel = np.linspace(0.0, 2.0, samples)
    stretch = 1 + (travel / 10 if digit_n < 0.01 else -travel / 10)
    force = np.round(np.pi / 4 * 10**2 * (stretch**-2 - stretch) / 3 / digit_n) * digit_n
    assert not implausible(sample(-travel if digit_n < 0.01 else travel, force))


@pytest.mark.parametrize(("of_travel", "of_force"), [(0.0, 1e-3), (1e-5, 0.0), (0.0, 0.0)])
def test_a_step_between_two_holds(of_travel: float, of_force: float) -> None:
    """The reading jumps while the sphere rests: travel, force or both are constant before and behind the step."""
    depth = ways(-0.1, 0.3, 0.3, -0.1)
    noise = of_travel * np.random.default_rng(3).normal(size=len(depth))
    read = depth + noise + np.where(np.arange(len(depth)) < 360, 0.0, 0.02)
    findings = {finding.code: finding for finding in implausible(campaign(read, pressed(depth, noise=of_force)))}
    assert findings[FindingCode.READING_STEPS].arguments["step_mm"] == pytest.approx(0.02, rel=0.05)


def test_lost_rows_on_a_plateau_are_no_step_of_the_reading() -> None:
    """A foam's force stays on its plateau, also where the file lacks samples of it."""
    strain = np.concatenate([np.linspace(0.0, 0.2, 100), np.linspace(0.25, 0.85, 200)])
    force = np.minimum(strain / 0.05, 1.0) + 40.0 * np.maximum(strain - 0.6, 0.0) ** 2
    found = implausible(sample(20 * strain, force, height_mm=20.0, diameter_mm=20.0))
    assert "reading_steps" not in {finding.code for finding in found}


@pytest.mark.parametrize("rises", [0.0, 0.6])
def test_a_pull_off_shows_whatever_the_drift(rises: float) -> None:
    """Under a drift of the cell that is as large as the contact's force, and where strands look like a drift."""
    depth = ways(-3.0, 0.9, -3.0, samples=1500)
    back, load = np.arange(len(depth)) >= 1500, hertz(np.array(0.9))
    strands = np.where(depth > -0.24, (0.9 - depth) / 1.14, np.exp((depth + 0.24) / 0.06))
    force = pressed(depth, noise=2e-3 * float(load)) - np.where(back, 0.25 * load * np.clip(strands, 0.0, 1.0), 0.0)
    force += rises * load * np.arange(len(depth)) / len(depth)
    (event,) = contact_events(campaign(depth, force).curves[0])
    assert event.arguments["events"]["pull_off"]["displacement_mm"] == pytest.approx(-0.24, abs=0.01)


def test_a_snap_in_is_no_step_of_the_reading() -> None:
    """A soft stage lets the sphere jump: displacement and force together."""
    depth = np.concatenate([np.linspace(-0.1, 0.0, 200), np.linspace(0.03, 0.3, 300)])
    assert implausible(campaign(depth, pressed(depth))) == []


@pytest.mark.parametrize("creep", [0.05, 0.1])
def test_a_held_load_is_no_saturation(creep: float) -> None:
    """The load rises to one value and stays there while the sample creeps, by a share of the depth."""
    ramp = np.linspace(0.0, 1.0, 400)
    load = np.concatenate([ramp, np.ones(800), ramp[::-1]])
    crept = 1 + creep * (1 - np.exp(-np.clip(np.arange(1600) - 400, 0, 800) / 100))
    depth, force = 0.3 * crept * load ** (2 / 3), hertz(np.array(0.3)) * load
    assert "force_saturates" not in [one.code for one in implausible(campaign(depth, force))]


def test_steps_of_a_converter_and_a_hold_are_no_saturation() -> None:
    depth = ways(-0.1, 0.3, 0.3, -0.1)
    steps = hertz(np.array(0.3)) / 60
    assert implausible(campaign(depth, np.round(pressed(depth) / steps) * steps)) == []
    assert implausible(campaign(depth, pressed(depth, noise=0.0))) == []


@pytest.mark.parametrize("mark", [-1.0, 0.0, 999.0])
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_marks_for_no_reading_left_out(mark: float, share: float) -> None:
    """A number that an instrument writes where it has no reading is told and left out; coarse steps in the air and
    rests between presses are no marks."""
    depth = ways(-0.1, 0.3, -0.1)
    force = pressed(depth) + 0.05
    marked = np.random.default_rng(4).permutation(len(force))[: int(share * len(force))]
    force[np.arange(0, len(force), int(1 / share)) if share == 0.5 else marked] = mark
    read = campaign(depth, force)
    finding = only(read)
    assert finding.code == "damaged_samples"
    assert finding.arguments["samples"] == int((force == mark).sum())
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.02)
    coarse = np.tile(np.round(pressed(ways(-0.1, 0.3, -0.1, samples=40)), 2), 20)
    assert not marks(coarse).any()
    assert not marks(np.tile([0.0, 0.0, 0.0, 0.3, 0.7, 0.3], 40)).any()


def test_marks_turn_no_sign() -> None:
    """Marks of -999 do not make the force of a file fall as it is pressed."""
    depth = ways(-0.1, 0.3, -0.1)
    force = pressed(depth)
    force[np.random.default_rng(5).permutation(len(force))[:60]] = -999.0
    rows = [f"{one:.5f},{other:.6f}" for one, other in zip(depth, force, strict=True)]
    described = """{"schema": "rig/1", "name": "n", "kind": "indentation", "skin": {"poisson_ratio": 0.5},
    "recording": {"indenter_radius_mm": 2}, "channels": {"displacement_mm": {"channel": "z (mm)"},
    "force_n": {"channel": "F (N)"}}}"""
    rig = rig_description.parse(described.encode(), "rig.json")
    read = read_file("\n".join(["z (mm),F (N)", *rows]).encode(), "curve.csv", rig)
    assert modulus_mpa(read.campaign) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("spike", [50.0, -50.0])
def test_spike_left_out(spike: float) -> None:
    """A reading far beyond the range of all others is told and left out, and the end of a steep curve is none."""
    depth = ways(-0.1, 0.3, -0.1)
    force = pressed(depth)
    force[[150, 300, 301]] = spike
    read = campaign(depth, force)
    finding = only(read)
    assert (finding.code, finding.arguments["samples"]) == ("damaged_samples", 3)
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.02)
    assert [one.code for one in at_reading(read)] == ["damaged_samples"]
    steep = np.append(pressed(ways(-0.1, 0.3)), [2.0, 5.0, 20.0, 100.0])
    assert not spikes(steep).any()
    stuck = np.concatenate([np.zeros(200), np.linspace(0.0, -9.0, 20), np.zeros(200)]) + 0.1 * np.sin(np.arange(420))
    assert not spikes(stuck).any()


@pytest.mark.parametrize("period_mm", [0.02, 0.045])
def test_a_periodic_error_is_told_with_its_period_and_subtracted(period_mm: float) -> None:
    """Interference of 3 % of the largest force, in the air as well as in contact."""
    depth = ways(-0.1, 0.3, -0.1, samples=400)
    force = pressed(depth)
    read = campaign(depth, force + 0.03 * force.max() * np.sin(2 * np.pi * depth / period_mm + 0.4))
    finding = only(read)
    assert finding.code == "periodic_error"
    assert finding.arguments["period_mm"] == pytest.approx(period_mm, rel=0.01)
    assert finding.arguments["percent"] == pytest.approx(3.0, rel=0.1)
    assert modulus_mpa(read) == pytest.approx(1.0, rel=0.01)


def test_a_drift_in_the_air_is_no_periodic_error() -> None:
    depth = ways(-0.1, 0.3, -0.1, samples=400)
    assert implausible(campaign(depth, pressed(depth) + 0.2 * depth**2)) == []

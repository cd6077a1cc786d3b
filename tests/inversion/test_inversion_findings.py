"""Marked sensors and recordings are named with the reason, and others are not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.inversion.inverted_campaigns import covered, moved, scaled, times
from tests.support.cases import first
from tests.support.shaken_series import D33, shaken
from tests.support.simulated_campaign import Rig, simulate
from underskin.diagnosis.slips.inspection import inspect
from underskin.errors import InvalidInput
from underskin.findings.codes import FindingCode, Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import ImplausibleD33
from underskin.inversion.invert import Inversion, invert
from underskin.prediction.pressed_skin import response_shares
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import estimate
from underskin.recordings.frf.line_choice import usable_lines
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Complexes, Floats


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


def codes(found: Inversion) -> dict[str, list[str]]:
    return {flag.sensor: [other.code for other in found.flags if other.sensor == flag.sensor] for flag in found.flags}


@pytest.fixture(scope="module")
def of_nine(table: SigmaTable) -> Campaign:
    """Nine sensors of 14 pC/N, of which nothing is said."""
    rig = Rig(d33=np.full(9, 14.0), preloads_n=tuple(np.linspace(0.5, 3, 8).tolist()))
    campaign = simulate(table, rig, np.random.default_rng(5))
    assert invert(campaign, table).flags == ()
    return campaign


def altered(campaign: Campaign, sensor: str, change: str) -> Campaign:
    random = np.random.default_rng(9)

    def alter(recording: FrfRecording) -> FrfRecording:
        real = np.asarray(recording.frf_re_pc_per_n)
        factor = {
            "weak": 0.3,
            "strong": 2.5,
            "dead": 0.0,
            "inverted": -1.0,
            "noisy": 1.0,
            "bent": 1 + 0.3 * ((recording.preload_n - 1.75) / 1.25) ** 2,
        }[change]
        extra = 0.3 * np.abs(real).mean() * random.normal(size=len(real)) if change in ("noisy", "dead") else 0.0
        changed = times(recording, factor)
        return replace(changed, frf_re_pc_per_n=np.asarray(changed.frf_re_pc_per_n) + extra)

    changed = [
        alter(recording) if isinstance(recording, FrfRecording) and recording.sensor == sensor else recording
        for recording in campaign.recordings
    ]
    return replace(campaign, recordings=tuple(changed))


@pytest.mark.parametrize("change", ["weak", "strong", "dead", "inverted", "noisy", "bent"])
def test_marked_sensor_has_its_reason(table: SigmaTable, of_nine: Campaign, change: str) -> None:
    """A sensor unlike the others is marked with the reason."""
    found = invert(altered(of_nine, "s4", change), table)
    assert codes(found).keys() == {"s4"}
    assert any(flag.code == change and flag.reason.startswith(change) for flag in found.flags)
    assert covered(found.campaign_d33, np.array(14.0))
    named = any("s4" in left.sentence for left in found.left_out)
    assert named == (change in ("weak", "strong", "dead", "inverted"))


@pytest.mark.soak
def test_whole_arrays_are_seldom_accused(table: SigmaTable) -> None:
    random = np.random.default_rng(6)
    accused = 0
    for _ in range(40):
        d33 = 14 * (1 + 0.05 * random.normal(size=16))
        rig = Rig(d33=d33, preloads_n=(0.5, 1.0, 2.0, 3.0), gain=0.03, position_mm=0.1, largest_offset_mm=0.5)
        accused += bool(invert(simulate(table, rig, random), table).left_out)
    assert accused <= 2


@pytest.mark.parametrize(
    ("factor", "asks"),
    [
        (1000.0, "was mV/pC meant, not mV/nC"),
        (1e-3, "was mV/nC meant, not mV/pC"),
        (-1.0, "is the sign of charge or force"),
    ],
)
def test_a_slip_that_the_whole_array_shows_is_a_finding(table: SigmaTable, factor: float, asks: str) -> None:
    campaign = simulate(table, Rig(d33=np.full(3, 14.0)), np.random.default_rng(7))
    assert invert(campaign, table).findings == ()
    slipped = campaign
    for row in range(len(campaign.recordings)):
        slipped = scaled(slipped, row, factor)
    (finding,) = invert(slipped, table).findings
    assert asks in finding.statement
    assert f"{14 * factor:.2g}"[:3] in finding.statement


@pytest.mark.parametrize("x_mm", [19.0, 1e308])
def test_a_recording_far_off_its_sensor_costs_only_itself(table: SigmaTable, x_mm: float) -> None:
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(11))
    found = invert(moved(campaign, 0, position_mm=(x_mm, 0.0)), table)
    rest = invert(replace(campaign, recordings=campaign.recordings[1:]), table)
    assert found.campaign_d33 is not None
    assert rest.campaign_d33 is not None
    assert float(found.campaign_d33.value) == pytest.approx(float(rest.campaign_d33.value), rel=1e-6)
    assert found.recordings.inside.sum() == 9
    assert [left.sentence.split(":")[0] for left in found.left_out] == ["recording r0"]


@pytest.mark.parametrize(("sensors", "factor"), [(1, 10.0), (5, 1000.0), (1, -1.0), (5, 1e-3)])
def test_a_recording_grossly_off_is_set_aside_and_named(table: SigmaTable, sensors: int, factor: float) -> None:
    rig = Rig(d33=np.full(sensors, 14.0), preloads_n=(0.5, 2.0))
    campaign = simulate(table, rig, np.random.default_rng(13))
    found = invert(scaled(campaign, 0, factor), table)
    assert covered(found.campaign_d33, np.array(14.0))
    assert covered(found.sensors, rig.d33).all()
    assert [left.sentence.split(":")[0] for left in found.left_out] == ["recording r0"]
    assert found.flags == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [("dead", "no charge beyond noise, while sensor 's1'"), ("inverted", "opposite sign of other recordings")],
)
def test_sensor_that_failed_on_one_date(table: SigmaTable, change: str, said: str) -> None:
    """A sensor that was dead, or inverted, on one of two dates has the d33 of the other one, and the array keeps it."""
    rig = Rig(d33=np.full(6, 14.0))
    random = np.random.default_rng(14)
    first_date, second = (simulate(table, rig, random) for _ in range(2))
    later = [replace(recording, id=f"later {recording.id}") for recording in altered(second, "s1", change).recordings]
    found = invert(replace(first_date, recordings=(*first_date.recordings, *later)), table)
    assert found.campaign_d33 is not None
    assert float(found.campaign_d33.value) == pytest.approx(14e-12, rel=0.05)
    assert found.sensors.value == pytest.approx(14e-12, rel=0.05)
    assert {left.sentence.split(":")[0] for left in found.left_out} == {
        f"recording {recording.id}"
        for recording in later
        if isinstance(recording, FrfRecording) and recording.sensor == "s1"
    }
    assert all(said in left.sentence for left in found.left_out)


@pytest.mark.parametrize("share", [0.2, 0.3, 0.4])
def test_noise_alone_makes_no_sensor_dead(table: SigmaTable, share: float) -> None:
    """Recordings whose d33 noise changes by a good part of it are all used, so that their mean is unbiased."""
    random = np.random.default_rng(2)
    campaign = simulate(table, Rig(d33=np.full(6, 14.0)), random)
    recordings = []
    for recording in campaign.of(FrfRecording):
        assert recording.frf_re_pc_per_n is not None
        real = recording.frf_re_pc_per_n
        noise = share * np.abs(real).mean() * np.sqrt(len(real)) * random.standard_normal(len(real))
        recordings.append(replace(recording, frf_re_pc_per_n=real + noise))
    found = invert(replace(campaign, recordings=tuple(recordings)), table, (1.0, 130.0))
    assert found.left_out == ()
    assert found.campaign_d33 is not None
    error = 14e-12 * share / np.sqrt(len(recordings))
    assert float(found.campaign_d33.value) == pytest.approx(14e-12, abs=3 * error)


def test_steady_noise_of_the_force_under_a_sweep() -> None:
    """Noise in the force of a slow sweep, whose lines it biases unequally, is no gain that changes: it is taken off."""
    random, rate, samples = np.random.default_rng(5), 1000.0, 16_384
    time = np.arange(samples) / rate
    growth = np.log(75.0) / time[-1]
    shaker = 0.09 * np.sin(2 * np.pi * 2.0 * np.expm1(growth * time) / growth)
    white = np.sqrt(0.05 * shaker.var() / 0.3) * random.standard_normal(samples)
    charge = 7e-12 * shaker + 7e-14 * random.standard_normal(samples)
    (lines,) = usable_lines([estimate(1.0 + shaker + white, charge, rate)])
    assert lines.frf.gain_change is None
    level = np.median(lines.frf.values.real[lines.frf.used_or_all])
    assert level == pytest.approx(7e-12, rel=0.02)


@pytest.mark.parametrize(("percent", "scatter", "marked"), [(-15, 0.02, True), (-3, 0.002, False), (-15, 0.3, False)])
def test_marked_at_three_deviations_and_five_percent(
    table: SigmaTable, percent: float, scatter: float, marked: bool
) -> None:
    """A sensor is marked at 5 % and three deviations of error and spread, and counts in the array's d33 still."""
    d33 = np.array([14.0] * 5 + [14.0 * (1 + percent / 100)])
    rig = Rig(d33=d33, preloads_n=(0.5, 1.0, 2.0, 3.0), gain=scatter)
    found = invert(simulate(table, rig, np.random.default_rng(21)), table)
    assert codes(found) == ({"s5": ["weak"]} if marked else {})
    assert found.left_out == ()


def test_the_spread_of_an_ordinary_array_marks_few(table: SigmaTable) -> None:
    """Of 32 sensors spread by 10 % few are marked, however well each is known; one beyond that spread is."""
    marked = 0
    for seed in range(3):
        random = np.random.default_rng(seed)
        d33 = 14 * np.exp(0.1 * random.standard_normal(32))
        d33[5] = 0.55 * 14
        found = invert(simulate(table, Rig(d33=d33, preloads_n=(0.5, 2.0), gain=0.02), random), table)
        assert codes(found)["s5"] == ["weak"]
        marked += len(found.flags) - 1
    assert marked <= 4


def test_a_sensor_of_exact_zeros_is_dead(table: SigmaTable) -> None:
    campaign = simulate(table, Rig(d33=np.full(3, 14.0), preloads_n=(1.0,)), np.random.default_rng(17))
    found = invert(scaled(scaled(campaign, 0, 0.0), 1, 0.0), table)
    assert codes(found) == {"s0": ["dead"]}
    assert np.isfinite([found.sensors.value, found.sensors.low, found.sensors.high]).all()


@pytest.mark.slow
def test_a_force_whose_mean_contradicts_the_preload_is_a_finding(table: SigmaTable) -> None:
    random = np.random.default_rng(18)
    campaign = simulate(table, Rig(d33=np.array([14.0]), preloads_n=(1.0,)), random)

    def as_series(recording: FrfRecording, mean: float) -> FrfRecording:
        assert recording.frf_re_pc_per_n is not None
        shaken = 0.03 * random.normal(size=4000)
        charge = recording.frf_re_pc_per_n[0] * shaken + 1e-3 * random.normal(size=4000)
        return replace(
            recording, frequency_hz=None, frf_re_pc_per_n=None, frf_im_pc_per_n=None, coherence=None,
            sample_rate_hz=500.0, force_n=mean + shaken, charge_pc=charge,
        )  # fmt: skip

    recorded = [item for item in campaign.recordings if isinstance(item, FrfRecording)]
    for means, accused in (((1.0, 0.0), []), ((0.05, 2.5), []), ((4.0, 0.2), ["r0", "r1"]), ((1.0, -1000.0), ["r1"])):
        series = tuple(as_series(item, mean) for item, mean in zip(recorded, means, strict=True))
        found = invert(replace(campaign, recordings=series), table)
        told = [*found.findings, *(one for one in found.left_out if isinstance(one, Finding))]
        assert [one.recording for one in told if one.code == FindingCode.FORCE_CONTRADICTS_PRELOAD] == accused


@pytest.mark.parametrize(("unit", "newtons"), [("gf", 9.80665e-3), ("mN", 1e-3), ("lbf", 4.4482216), ("kgf", 9.80665)])
def test_force_in_another_unit_is_named_and_left_out(table: SigmaTable, unit: str, newtons: float) -> None:
    """Of a force in another unit, which its mean beside the preload tells, no d33 is stated, here or in a diagnosis."""
    campaign = shaken()
    wrong = tuple(
        replace(recording, force_n=recording.force_n / newtons)
        for recording in campaign.recordings
        if isinstance(recording, FrfRecording) and recording.force_n is not None
    )
    with pytest.raises(InvalidInput, match=rf"force_n.*was it given in {unit}\?|the force is .* N: .* in {unit}\?"):
        invert(replace(campaign, recordings=wrong), table)
    told = inspect(replace(campaign, recordings=wrong), table).findings
    assert {finding.field for finding in told} == {"force_n"}
    assert all(unit in finding.statement for finding in told)


def test_modulus_of_no_elastomer_gives_no_d33(table: SigmaTable) -> None:
    """A modulus in kPa under MPa gives no d33 and names the unit; frequencies in kHz leave d33 and are named."""
    campaign = simulate(table, Rig(d33=np.array([14.0]), preloads_n=(0.5, 1.0)), np.random.default_rng(18))
    modulus = campaign.skin.youngs_modulus_mpa
    assert modulus is not None
    for factor in (1e3, 1e3 / modulus * 0.5):
        stiff = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=factor * modulus))
        with pytest.raises(InvalidInput, match=r"skin.youngs_modulus_mpa: .* was it given in kPa\?"):
            invert(stiff, table)
        assert invert(replace(stiff, units_checked=True), table).campaign_d33 is not None
    slow = tuple(
        replace(recording, frequency_hz=1e-3 * recording.frequency_hz)
        for recording in campaign.recordings
        if isinstance(recording, FrfRecording) and recording.frequency_hz is not None
    )
    found = invert(replace(campaign, recordings=slow), table)
    assert found.campaign_d33 is not None
    assert [one.statement for one in found.findings if one.field == "frequency_hz" and "kHz" in one.statement]


def test_gel_under_light_spheres_is_no_slip(table: SigmaTable) -> None:
    """A gel of kilopascals that bears its spheres has a d33; a modulus in GPa under MPa, where they sink, has none."""
    gel = Rig(d33=np.array([14.0]), preloads_n=(0.01, 0.02), indenters_mm=(8.0, 10.0), modulus_mpa=5e-3)
    found = invert(simulate(table, gel, np.random.default_rng(18)), table)
    assert covered(found.campaign_d33, np.array(14.0))
    slip = Rig(d33=np.array([14.0]), preloads_n=(0.5, 1.0))
    campaign = simulate(table, slip, np.random.default_rng(18))
    softer = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=1e-3 * slip.modulus_mpa))
    with pytest.raises(InvalidInput, match=r"skin.youngs_modulus_mpa: .* was it given in GPa\?"):
        invert(softer, table)


@pytest.mark.parametrize(
    ("unit", "factor", "d33"), [("pC/gf", 9.80665e-3, 12.0), ("pC/kgf", 9.80665, 33.0), ("nC/N", 1e-3, 33.0)]
)
def test_response_in_another_unit_is_named(table: SigmaTable, unit: str, factor: float, d33: float) -> None:
    """Where no PVDF has the array's d33, the unit that explains it is named and d33 is not to be quoted, until the
    units are checked."""
    campaign = simulate(table, Rig(d33=np.array([d33, d33]), preloads_n=(0.5, 1.0)), np.random.default_rng(18))
    for row in range(len(campaign.recordings)):
        campaign = scaled(campaign, row, factor)
    (told,) = [one for one in invert(campaign, table).findings if one.code == FindingCode.IMPLAUSIBLE_D33]
    assert unit.split("/")[0] in told.statement
    if told.arguments["kind"] == ImplausibleD33.NOT_PVDF:
        assert unit in told.statement
        assert "not to be quoted" in told.statement
        checked = invert(replace(campaign, units_checked=True), table).findings
        assert FindingCode.IMPLAUSIBLE_D33 not in {one.code for one in checked}


@pytest.mark.parametrize("lowest_hz", [0.005, 0.1])
def test_frequencies_in_khz_are_named(table: SigmaTable, lowest_hz: float) -> None:
    """Several lines below what a shaker drives look like kHz; a single slow tone is no slip."""
    for lines, is_said in ((np.geomspace(lowest_hz, 1.0, 30), True), (np.array([1.0]), False)):
        campaign = simulate(table, Rig(d33=np.array([14.0]), frequency_hz=lines), np.random.default_rng(18))
        said = [one for one in invert(campaign, table).findings if one.field == "frequency_hz"]
        assert any("kHz" in one.statement for one in said) is is_said


@pytest.mark.parametrize(("factor", "unit"), [(1e-3, "ms"), (1e3, "s")])
def test_a_clock_in_another_unit_is_named(table: SigmaTable, factor: float, unit: str) -> None:
    """Of time series, whose times give the frequencies, it is the unit of their time that is named."""
    series = [
        replace(recording, sample_rate_hz=factor * (recording.sample_rate_hz or 0.0))
        for recording in shaken().of(FrfRecording)
    ]
    found = invert(replace(shaken(), recordings=tuple(series)), table)
    assert any(f"time of the series given in {unit}?" in one.statement for one in found.findings)


@pytest.mark.parametrize("mains_hz", [50.0, 60.03])
def test_force_at_the_mains_alone_is_said(table: SigmaTable, mains_hz: float) -> None:
    """d33 of a tone at the mains is stated with the word that pick-up cannot be told from it; of another tone not."""
    time = np.arange(8192) / 800.0  # as `shaken`
    for tone_hz, is_said in ((np.round(mains_hz), True), (40.0, False)):
        tone = 0.09 * np.sin(2 * np.pi * tone_hz * time)
        pick_up = 0.5 * np.sin(2 * np.pi * mains_hz * time + 0.3)
        campaign = shaken()
        tones = tuple(
            replace(recording, force_n=recording.preload_n + tone, charge_pc=7.4 * tone + pick_up)
            for recording in campaign.recordings
            if isinstance(recording, FrfRecording)
        )
        found = invert(replace(campaign, recordings=tones), table)
        said = [one for one in found.findings if one.code == FindingCode.MAINS_IN_CHARGE]
        assert bool(said) is is_said
        assert found.campaign_d33 is not None
        if not is_said:
            assert found.campaign_d33.d33_rows()[0][0] == pytest.approx(14.0, rel=0.02)


def test_zeros_outside_an_analyzers_band_are_no_response(table: SigmaTable) -> None:
    """They are no lines: no filter is seen in them and no mains pick-up, and d33 is that of the others."""
    campaign = simulate(table, Rig(d33=np.array([14.0])), np.random.default_rng(22))
    lines = np.arange(1, 401.0)
    noise = 1 + 0.01 * np.random.default_rng(23).standard_normal((len(campaign.recordings), 400))
    recordings = []
    for recording, scatter in zip(campaign.recordings, noise, strict=True):
        assert isinstance(recording, FrfRecording)
        assert recording.frf_re_pc_per_n is not None
        real = np.where(lines <= 200, np.median(recording.frf_re_pc_per_n) * scatter, 0.0)
        recordings.append(
            replace(recording, frequency_hz=lines, frf_re_pc_per_n=real, frf_im_pc_per_n=0 * lines, coherence=None)
        )
    found = invert(replace(campaign, recordings=tuple(recordings)), table)
    assert found.campaign_d33 is not None
    assert found.campaign_d33.d33_rows()[0][0] == pytest.approx(14.0, rel=0.02)
    assert found.zone.high_hz == 200
    assert "mains" not in found.zone.reason
    assert found.findings == ()


def test_exchanged_channels_of_force_and_charge_give_no_d33(table: SigmaTable) -> None:
    random = np.random.default_rng(21)
    campaign = simulate(table, Rig(d33=np.array([14.0])), random)
    recording = campaign.recordings[0]
    assert isinstance(recording, FrfRecording)
    force = recording.preload_n + recording.dynamic_force_n * np.sin(np.arange(4096) / 3)
    charge = 7.4 * (force - recording.preload_n) + 0.01 * random.normal(size=4096)
    known = {**vars(recording.without_measurements(frequency_hz=None)), "sample_rate_hz": 1000.0}
    both = [
        FrfRecording(**{**known, "id": name, "force_n": of_force, "charge_pc": of_charge})
        for name, of_force, of_charge in (("right", force, charge), ("exchanged", charge, force))
    ]
    found = invert(replace(campaign, recordings=tuple(both)), table)
    assert found.recordings.ids == ("right",)
    (left,) = found.left_out
    assert left.sentence.startswith("recording exchanged: ")
    assert "force and charge look exchanged. Left out" in left.sentence
    meant = invert(replace(campaign, recordings=tuple(both), units_checked=True), table)
    assert meant.recordings.ids == ("right", "exchanged")
    looked_at, scatter = meant.findings  # the two d33 agree in nothing
    assert scatter.code == FindingCode.UNUSUAL_SCATTER
    assert looked_at.sentence.endswith("force and charge look exchanged.")


def at_temperatures(campaign: Campaign, celsius: Floats, per_kelvin: float) -> Campaign:
    """The campaign at a noted temperature for each FRF recording, which d33 follows about their mean."""
    factors = 1 + per_kelvin * (celsius - celsius.mean())
    changed = [
        replace(times(recording, factor), conditions={"temperature_c": temperature})
        for recording, factor, temperature in zip(
            campaign.of(FrfRecording), factors.tolist(), celsius.tolist(), strict=True
        )
    ]
    return replace(campaign, recordings=tuple(changed))


@pytest.mark.parametrize("corner_of_band", [0.02, 0.1])
def test_a_filter_of_one_sensor_is_named_and_kept_from_the_array(corner_of_band: float, table: SigmaTable) -> None:
    """A sensor behind a high-pass of its own is no noisy one: it is named with its loss, and the array's d33 does
    without it."""
    campaign = simulate(table, Rig(d33=np.full(4, 14.0)), np.random.default_rng(6))
    frequency = np.asarray(campaign.of(FrfRecording)[0].frequency_hz)
    ratio = corner_of_band * frequency.max() / frequency
    changed = [times(item, 1 / (1 - 1j * ratio)) if item.sensor == "s2" else item for item in campaign.of(FrfRecording)]
    found = invert(replace(campaign, recordings=tuple(changed)), table)
    assert codes(found) == {"s2": ["behind_filter"]}
    assert "not to be quoted" in found.flags[0].reason
    assert any("s2" in left.sentence for left in found.left_out)
    assert covered(found.campaign_d33, np.array(14.0))
    assert found.flags[0].arguments["high_pass_hz"] == pytest.approx(corner_of_band * frequency.max(), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("per_kelvin", [0.0, 0.008])
def test_a_temperature_that_rises_from_sensor_to_sensor(per_kelvin: float, table: SigmaTable) -> None:
    """Sensors that are alike are covered, however d33 follows the temperature that rises while they are measured in
    turn; a temperature that is the same for all sensors says nothing."""
    outside = said = 0
    for seed in range(4):
        random = np.random.default_rng([seed, 7])
        campaign = simulate(table, Rig(d33=np.full(4, 14.0), gain=0.005), random)
        count = len(campaign.recordings)
        warm = 20 + 7 * np.arange(count) / count + 0.3 * random.standard_normal(count)
        found = invert(at_temperatures(campaign, warm, per_kelvin), table)
        fields = [finding.field for finding in found.findings if finding.code == FindingCode.CONDITION_DIFFERS]
        assert fields in ([], ["conditions.temperature_c"])
        said += len(fields)
        outside += int((covered(found.sensors, np.array(14.0)) == 0).sum())
        same = invert(at_temperatures(campaign, 23 + 0.1 * random.standard_normal(count), per_kelvin), table)
        assert FindingCode.CONDITION_DIFFERS not in {finding.code for finding in same.findings}
    assert outside <= 2
    assert said >= 2 or not per_kelvin


def turned(campaign: Campaign, factor: Callable[[Floats], Complexes]) -> Campaign:
    """The campaign with each FRF times a factor of its frequencies [Hz]."""
    recordings = [times(each, factor(np.asarray(each.frequency_hz))) for each in campaign.of(FrfRecording)]
    return replace(campaign, recordings=tuple(recordings))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", first(2, [20.0, -60.0, 85.0]))
def test_constant_phase_leaves_d33(table: SigmaTable, degrees: float) -> None:
    """A phase that is the same over frequency is stated, and d33 is that of the magnitude; a delay, a pole and a small
    phase are none."""
    campaign = simulate(table, Rig(d33=np.full(4, 14.0)), np.random.default_rng(5))
    plain = invert(campaign, table)
    found = invert(turned(campaign, lambda f: np.exp(1j * np.deg2rad(degrees)) + 0 * f), table)
    (finding,) = [finding for finding in found.findings if finding.code == FindingCode.CONSTANT_PHASE]
    assert finding.arguments["phase_deg"] == pytest.approx(degrees, abs=1)
    assert "late" not in found.zone.reason
    assert found.campaign_d33 is not None
    assert plain.campaign_d33 is not None
    assert float(found.campaign_d33.value) == pytest.approx(float(plain.campaign_d33.value), rel=0.01)
    for factor in (
        lambda f: np.exp(-2j * np.pi * f * np.deg2rad(abs(degrees)) / 1000),
        lambda f: 1 / (1 - 1j * 0.05 * abs(degrees) / f),
        lambda f: np.exp(0.05j) + 0 * f,
    ):
        others = invert(turned(campaign, factor), table).findings
        assert FindingCode.CONSTANT_PHASE not in [finding.code for finding in others]


@pytest.mark.parametrize(("higher", "factor"), [((2, 3), 4.0), ((1, 2, 3), 5.0), ((2, 3), 3.4), ((1,), 1000.0)])
def test_two_ranges_of_an_amplifier(table: SigmaTable, higher: tuple[int, ...], factor: float) -> None:
    """Two groups of sensors a factor apart are named, none is left out as weak or dead, and the array has no d33."""
    campaign = simulate(table, Rig(d33=np.array([8.0, 8.3, 7.9, 8.1])), np.random.default_rng(5))
    for row, recording in enumerate(campaign.of(FrfRecording)):
        if recording.sensor in [f"s{number}" for number in higher]:
            campaign = scaled(campaign, row, factor)
    found = invert(campaign, table)
    (finding,) = [finding for finding in found.findings if finding.reason == Reason.TWO_GROUPS]
    assert finding.arguments["factor"] == pytest.approx(factor, rel=0.1)
    assert finding.arguments["higher"] == [f"s{number}" for number in higher]
    assert found.flags == found.left_out == ()
    assert found.campaign_d33 is None
    assert float(found.sensors.value[0]) == pytest.approx(8e-12, rel=0.1)
    assert found.gain is not None
    assert float(found.gain.value) < 0.06


def of_changed_series(table: SigmaTable, of_force: float, of_charge: float) -> Inversion:
    """Force about its mean and charge times factors from the middle of each recording on."""
    plain, recordings = shaken(samples=8192), []
    for recording in plain.of(FrfRecording):
        force, charge = np.asarray(recording.force_n), np.asarray(recording.charge_pc)
        later, mean = np.arange(len(force)) >= len(force) // 2, force.mean()
        force = np.where(later, mean + of_force * (force - mean), force)
        recordings.append(replace(recording, force_n=force, charge_pc=np.where(later, of_charge * charge, charge)))
    return invert(replace(plain, recordings=tuple(recordings)), table)


@pytest.mark.parametrize("factor", [1.1, 2.0, 0.0])
def test_gain_changes_within_series(table: SigmaTable, factor: float) -> None:
    """A charge times a factor from the middle on is stated with it and the time, as no noise in the force, and the
    interval holds either d33."""
    found = of_changed_series(table, 1.0, factor)
    (finding,) = [finding for finding in found.findings if finding.reason == Reason.GAIN_STEP]
    assert finding.arguments["ratio"] == pytest.approx(factor, abs=0.04)
    assert finding.arguments["step_s"] == pytest.approx(8192 / 800 / 2, abs=1.0)
    assert FindingCode.NOISE_IN_FRF not in [finding.code for finding in found.findings]
    assert found.campaign_d33 is not None
    assert float(found.campaign_d33.low) < D33 * 1e-12 < float(found.campaign_d33.high)


@pytest.mark.parametrize("of_both", [1.0, 0.3, 0.0])
def test_a_force_that_stops_or_changes_its_size_is_no_change_of_gain(table: SigmaTable, of_both: float) -> None:
    found = of_changed_series(table, of_both, of_both)
    assert FindingCode.GAIN_STEPS not in [finding.code for finding in found.findings]


@pytest.mark.parametrize("alternates", [False, True])
def test_lines_at_two_levels(table: SigmaTable, *, alternates: bool) -> None:
    """A gain that steps between two frequencies, or alternates, leaves out a recording of several, and the array
    without d33 where it is that of all; filters and resonances are no such steps."""
    lines = np.geomspace(5, 120, 40)
    rig = Rig(np.full(2, 14.0), frequency_hz=lines, preloads_n=(0.5, 1.0, 2.0), indenters_mm=(4.0,), line=0.005)
    campaign = simulate(table, rig, np.random.default_rng(3))
    step = np.where(np.arange(40) % 2 == 0 if alternates else lines > 25, 0.5, 1.0)
    low_pass, peak = 1 / np.sqrt(1 + (lines / 40) ** 8), 1 / np.abs(1 - (lines / 60) ** 2 + 0.1j)

    def found(by: Floats, count: int) -> tuple[Inversion, list[Finding]]:
        changed = campaign
        for row in range(count):
            changed = scaled(changed, row, by)
        inversion = invert(changed, table)
        every = [*inversion.left_out, *inversion.findings]
        return inversion, [
            one for one in every if isinstance(one, Finding) and one.reason is Reason.GAIN_OVER_FREQUENCY
        ]

    single, (left_out,) = found(step, 1)
    assert left_out.recording == campaign.recordings[0].id
    assert single.campaign_d33 is not None
    assert covered(single.campaign_d33, np.array(14.0))
    every, (finding,) = found(step, len(campaign.recordings))
    assert every.campaign_d33 is None
    assert finding.arguments["factor"] == pytest.approx(2.0, rel=0.02)
    assert finding.arguments["is_step"] != alternates
    if not alternates:
        assert finding.arguments["low_hz"] < 25 < finding.arguments["high_hz"] < 28
    for smooth in (np.ones(40), low_pass, peak):
        assert found(smooth, len(campaign.recordings))[1] == []


@pytest.mark.parametrize("share", first(2, [0.0, 0.03, 0.003, 0.1]))
def test_an_array_read_whole_under_each_contact(share: float, table: SigmaTable) -> None:
    """Sensors that feel next to nothing of a contact read cross-talk, which is no d33: they are not used."""
    rig = Rig(d33=20 * np.array([0.98, 1.0, 1.0, 1.02]), gain=0.01, indenters_mm=(4.0,), preloads_n=(0.5, 1.0, 1.5))
    pressed = simulate(table, rig, np.random.default_rng(0))
    centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in pressed.skin.sensors}
    read = [
        replace(times(recording, share + 1e-4), id=f"{recording.id}-{sensor}", sensor=sensor, position_mm=place)
        for recording in pressed.of(FrfRecording)
        for place in [centres[recording.sensor]]
        for sensor in centres
        if sensor != recording.sensor
    ]
    campaign = replace(pressed, recordings=(*pressed.recordings, *read))
    found, alone = invert(campaign, table), invert(pressed, table)
    assert found.campaign_d33 is not None
    assert alone.campaign_d33 is not None
    assert found.campaign_d33.value == pytest.approx(alone.campaign_d33.value, rel=1e-3)
    (far,) = (finding for finding in found.left_out if finding.code == FindingCode.FAR_CONTACTS)
    assert isinstance(far, Finding)
    assert far.arguments["recordings"] == len(read)
    assert far.arguments["read_percent"] == pytest.approx(100 * (share + 1e-4), rel=0.05)
    inspected = inspect(campaign, table)
    assert len(inspected.campaign.recordings) == len(pressed.recordings)
    assert FindingCode.FAR_CONTACTS in {finding.code for finding in inspected.findings}


@pytest.mark.parametrize("share", first(1, [0.03, 0.01, 0.0]))
def test_near_a_sensor_cross_talk_counts_for_less(share: float, table: SigmaTable) -> None:
    """A sensor that feels some percent of a contact is less sure by usual cross-talk, and keeps d33 where it is."""
    rig = Rig(d33=np.full(4, 20.0), gain=0.01, indenters_mm=(4.0,), preloads_n=(0.5, 1.0, 1.5))
    pressed = simulate(table, rig, np.random.default_rng(0))
    recordings = pressed.of(FrfRecording)
    beside = [
        replace(recording, position_mm=(8 * number + 3.05, 0.0))
        for number in range(4)
        for recording in recordings
        if recording.sensor == f"s{number}"
    ]
    shares = response_shares(pressed.skin, beside, table)
    read = [replace(times(r, s + share), id=f"{r.id}-beside") for r, s in zip(beside, shares.tolist(), strict=True)]
    found, alone = invert(replace(pressed, recordings=(*recordings, *read)), table), invert(pressed, table)
    assert found.campaign_d33 is not None
    assert alone.campaign_d33 is not None
    assert found.campaign_d33.value == pytest.approx(alone.campaign_d33.value, rel=0.015)


def test_scatter_at_its_limit_gives_no_d33_of_the_array(table: SigmaTable) -> None:
    """Where something else decides what recordings read, it is said, and no d33 of the array is stated."""
    random = np.random.default_rng(0)
    campaign = simulate(table, Rig(d33=np.full(4, 20.0)), random)
    recordings = tuple(times(one, float(np.exp(random.normal(0, 1.2)))) for one in campaign.of(FrfRecording))
    found = invert(replace(campaign, recordings=recordings), table)
    assert found.campaign_d33 is None
    assert FindingCode.UNUSUAL_SCATTER in {finding.code for finding in found.findings}


def noted(campaign: Campaign, condition: Callable[[FrfRecording], dict[str, float]]) -> Campaign:
    """The campaign with conditions noted for each FRF recording."""
    recorded = campaign.of(FrfRecording)
    return replace(campaign, recordings=tuple(replace(item, conditions={**condition(item)}) for item in recorded))


def test_a_condition_that_follows_the_load_leaves_d33_with_preload(table: SigmaTable) -> None:
    """What d33 does with preload is no effect of a column that follows the preload: no d33 changes by noting it."""
    campaign = simulate(table, Rig(d33=np.full(4, 14.0), gain=0.01), np.random.default_rng(5))
    bent = [times(item, 1 + 0.06 * (item.preload_n - 1.6)) for item in campaign.of(FrfRecording)]
    campaign = replace(campaign, recordings=tuple(bent))
    plain = invert(campaign, table)
    found = invert(noted(campaign, lambda item: {"load_cell_v": 2 * item.preload_n}), table)
    assert plain.campaign_d33 is not None
    assert found.campaign_d33 is not None
    for before, after in ((plain.cells.d33, found.cells.d33), (plain.campaign_d33, found.campaign_d33)):
        np.testing.assert_allclose([after.value, after.low, after.high], [before.value, before.low, before.high])


def test_a_label_of_the_sensors_leaves_them_as_certain(table: SigmaTable) -> None:
    """A column that the recordings of a sensor share says nothing of d33: it widens no interval, and a temperature
    is named as inseparable, without a slope."""
    campaign = simulate(table, Rig(d33=np.full(4, 14.0), gain=0.01), np.random.default_rng(5))
    started = {item.id: 1.7e9 + 60 * number for number, item in enumerate(campaign.of(FrfRecording))}

    def labels(item: FrfRecording) -> dict[str, float]:
        return {"channel": float(item.sensor[1:]), "file": started[item.id] - 1.7e9, "unix": started[item.id]}

    plain = invert(campaign, table)
    for condition, said in ((labels, 0), (lambda item: {"temperature_c": 20 + float(item.sensor[1:])}, 1)):
        found = invert(noted(campaign, condition), table)
        np.testing.assert_allclose(found.sensors.uncertainty, plain.sensors.uncertainty)
        assert len(found.findings) == said
        assert all("20 to 23, and hardly within them" in finding.statement for finding in found.findings)

"""Units in a file that contradict those of the rig description, in any format; and synonyms that do not."""

import io
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from tests.support.campaign_documents import FRF, document
from tests.support.instrument_files import COMMON
from underskin.errors import FileError
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.readers.unit_labels import labelled_unit, meanings, unit
from underskin.recordings.reading import Reading
from underskin.recordings.rig_description import RigDescription

pytestmark = pytest.mark.slow

FORCE, CHARGE = np.array([1.0, 1.5, 0.5, 1.0]), np.array([0.0, 3.5, -3.5, 0.5])


def rig(force: dict[str, Any], charge: dict[str, Any] | None = None, **more: Any) -> RigDescription:
    channels = {"force_n": force, "charge_pc": charge or {"channel": "Charge", "unit": "pC"}}
    common = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": {**COMMON, "sample_rate_hz": 1000}}
    return rig_description.from_dict({**common, "channels": channels, **more})


def table(force: str, above: str = "") -> bytes:
    rows = "\n".join(f"{f:g};{q:g}" for f, q in zip(FORCE, CHARGE, strict=True))
    return f"{force};Charge\n{above}{rows}\n".encode()


def lvm(label: str) -> bytes:
    head = "LabVIEW Measurement\nSeparator\tTab\nX_Columns\tNo\n***End_of_Header***\n\nChannels\t2\n"
    head += f"Y_Unit_Label\t{label}\tpC\nX_Dimension\tTime\tTime\nDelta_X\t0.001\t0.001\n***End_of_Header***\nX_Value\t"
    return (head + "Force\tCharge\n" + "".join(f"\t{f}\t{q}\n" for f, q in zip(FORCE, CHARGE, strict=True))).encode()


def tdms(name: str, label: str) -> bytes:
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        force = ChannelObject("run", name, FORCE, {"unit_string": label, "wf_increment": 1e-3})
        writer.write_segment(
            [force, ChannelObject("run", "Charge", CHARGE, {"unit_string": "pC", "wf_increment": 1e-3})]
        )
    return buffer.getvalue()


def force_of(reading: Reading) -> Any:
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    return recording.force_n


@pytest.mark.parametrize(
    ("label", "stated"),
    [
        ("lbs", "N"), ("mN", "N"), ("kgf", "N"), ("Millinewton", "N"), ("MN", "mN"), ("дин. Н", "mN"), ("牛", "mN"),
        ("Pikonewton", "N"),
        ("dB re 1 N", "N"), ("dB", "N"), ("livres", "N"),
        ("Dezibel", "N"), ("décibels", "N"), ("дБ", "N"), ("log", "N"),
        ("Pfund", "N"), ("mV rms", "N"), ("kn", "mN"),
    ],
)  # fmt: skip
def test_a_label_that_contradicts_the_rig_is_refused(label: str, stated: str) -> None:
    """In a heading, in a row of units and as an instrument's own label; both are named."""
    label = label.removeprefix("дин. ")
    said = rf"is labelled '{label}', but the rig description says '{stated}'"
    force = {"channel": "Force", "unit": stated}
    for data, name in (
        (table(f"Force ({label})"), "a.csv"),
        (table("Force", f"{label};pC\n"), "a.csv"),
        (lvm(label), "a.lvm"),
    ):
        with pytest.raises(FileError, match=said):
            read_file(data, name, rig(force))
    in_formula = rig({"channel": "load"}, derived={"load": f"2 * Force [{stated}]"})
    with pytest.raises(FileError, match=rf"is labelled '{label}', but the formula says '{stated}'"):
        read_file(table(f"Force ({label})"), "a.csv", in_formula)
    reading = read_file(table(f"Force ({label})"), "a.csv", rig({**force, "labelled": label}))
    np.testing.assert_allclose(force_of(reading), FORCE * (1 if stated == "N" else 1e-3))


def test_confirmed_magnitude_overrides_label() -> None:
    """`units_checked` confirms a unit that differs from the label by its magnitude, with a warning; no other unit."""
    force = {"channel": "Force", "unit": "N"}
    reading = read_file(table("Force (mN)"), "a.csv", rig(force, units_checked=True))
    np.testing.assert_allclose(force_of(reading), FORCE)
    assert [note for note in reading.warnings if "labelled 'mN'" in note and "'N'" in note]
    with pytest.raises(FileError, match="is labelled 'mV'"):
        read_file(table("Force (mV)"), "a.csv", rig(force, units_checked=True))


@pytest.mark.parametrize(
    "label", ["left", "tared", "raw data", "Kanal 1", "na", "-", "%", "a.u.", "ch. 3", "N/A", "#2"]
)
def test_a_label_that_is_no_unit_refuses_nothing(label: str) -> None:
    reading = read_file(table(f"Force ({label})"), "a.csv", rig({"channel": "Force", "unit": "N"}))
    np.testing.assert_allclose(force_of(reading), FORCE)


@pytest.mark.parametrize(
    ("label", "newtons"),
    [
        ("Newtons", 1.0), ("newton", 1.0), ("lbs", 4.4482216), ("lbf", 4.4482216), ("millinewtons", 1e-3),
        ("kgf", 9.80665), ("N peak", 1.0), ("in N", 1.0), ("Н", 1.0), ("KN", 1e3), ("oz", 0.27801385),
    ],
)  # fmt: skip
def test_words_and_abbreviations_are_units(label: str, newtons: float) -> None:
    reading = read_file(table(f"Force ({label})"), "a.csv", rig({"channel": "Force"}))
    np.testing.assert_allclose(force_of(reading), FORCE * newtons, rtol=1e-7)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Volts", "V"), ("sec", "s"), ("Sekunden", "s"), ("(pC)/N", "pC/N"), ("pC per N", "pC/N"), ("pC·N^-1", "pC/N"),
        ("picocoulombs per newton", "pC/N"), ("N/mm²", "MPa"), ("µm", "um"), ("msec", "ms"), ("degrees", "deg"),
        ("Volt", "V"), ("kHZ", "kHz"), ("psi", "lbf/in2"), ("inches", "in"), ("мм", "mm"), ("usec", "µs"),
    ],
)  # fmt: skip
def test_synonyms_are_one_unit(one: str, other: str) -> None:
    assert unit(other) is not None
    assert meanings(one) == (unit(other),)


@pytest.mark.parametrize(
    ("label", "dimension", "size"),
    [
        ("fC", "charge", 1e-15), ("femtocoulomb", "charge", 1e-15), ("fC/N", "charge/force", 1e-15),
        ("pC.N-1", "charge/force", 1e-12), ("cN", "force", 1e-2), ("daN", "force", 10.0), ("hPa", "pressure", 100.0),
        ("kgf/cm2", "pressure", 98066.5), ("mN/mm²", "pressure", 1e3), ("lbf/in2", "pressure", 6894.757293),
        ("rad/s", "frequency", 0.5 / np.pi),
        ("rad·s^-1", "frequency", 0.5 / np.pi), ("krad/s", "frequency", 500 / np.pi), ("deg/s", "frequency", 1 / 360),
        ("rev/min", "frequency", 1 / 60), ("cycles/s", "frequency", 1.0), ("cps", "frequency", 1.0),
    ],
)  # fmt: skip
def test_conversions_to_si(label: str, dimension: str, size: float) -> None:
    (meaning,) = meanings(label)
    assert meaning.dimension == dimension
    assert meaning.to_si == pytest.approx(size, rel=1e-9)


@pytest.mark.parametrize("word", ["fs", "as", "am", "hs", "1/s", "aC", "dyn", "hN", "fA"])
def test_words_of_headings_are_no_rare_units(word: str) -> None:
    assert meanings(word) == ()


@pytest.mark.parametrize("heading", ["F_m", "Q_A", "F_s", "Force CH1, A", "Load cycles", "Force (g)"])
def test_the_end_of_a_name_is_no_label_against_the_rig(heading: str) -> None:
    """An axis, a channel or a statistic is named so; g is a gram-force as well."""
    stated = "gf" if heading == "Force (g)" else "N"
    newtons = 9.80665e-3 if stated == "gf" else 1.0
    for data, name in ((table(heading), "a.csv"), (tdms(heading, ""), "a.tdms")):
        reading = read_file(data, name, rig({"channel": heading, "unit": stated}))
        np.testing.assert_allclose(force_of(reading), FORCE * newtons, rtol=1e-9)


@pytest.mark.parametrize("heading", ["F_mN", "Force lbs", "Force mV", "Force / V", "Force (V)", "Force dB"])
def test_the_end_of_a_name_that_is_a_unit_contradicts_the_rig(heading: str) -> None:
    with pytest.raises(FileError, match=r"is labelled '.*', but the rig description says 'N'"):
        read_file(tdms(heading, ""), "a.tdms", rig({"channel": heading, "unit": "N"}))


SPECTRUM = "Frequency (Hz);{};Phase ({})\n" + "\n".join(f"{5 * n};{17.4 + 0.01 * n};-0.1" for n in range(1, 9))


def spectrum(heading: str, angle: str = "deg", **unit_of: str) -> Reading:
    channels = {
        "frequency_hz": {"channel": "Frequency"},
        "frf_magnitude_pc_per_n": {"channel": heading.partition(" (")[0], "unit": unit_of.get("magnitude", "pC/N")},
        "frf_phase_deg": {"channel": "Phase", **({"unit": unit_of["phase"]} if "phase" in unit_of else {})},
    }
    common = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": COMMON, "channels": channels}
    return read_file(
        (unit_of.get("above", "") + SPECTRUM)
        .format(heading, angle)
        .replace(";17.", f";{unit_of.get('sign', '')}17.")
        .encode(),
        "frf.csv",
        rig_description.from_dict(common),
    )


def test_decibels_are_refused() -> None:
    """As a label beside a stated unit, as a unit, and where a magnitude is below 0."""
    for heading in ("Magnitude (dB)", "Magnitude (dB re 1 pC/N)", "Gain dB", "Magnitude (decibels)"):
        with pytest.raises(FileError, match=r"is labelled '.*', but the rig description says 'pC/N'"):
            spectrum(heading)
    with pytest.raises(FileError, match="decibels are a logarithm"):
        spectrum("Magnitude (dB)", magnitude="dB")
    with pytest.raises(FileError, match="property 'Y-axis unit': is 'dB': decibels are a logarithm"):
        spectrum("Magnitude", above="Y-axis unit: dB\n")
    with pytest.raises(FileError, match="below 0, as no magnitude is: decibels"):
        spectrum("Magnitude", sign="-")


@pytest.mark.parametrize("formula", [True, False])
def test_an_frf_in_volts_per_newton_becomes_charge_by_the_amplifier(formula: bool) -> None:
    """V/N over mV/pC is pC/N, by a sensitivity and by a formula."""
    rows = "\n".join(f"{5 * n};{0.074 + 1e-4 * n};0.001" for n in range(1, 9))
    amplifier = {} if formula else {"sensitivity": 10, "sensitivity_unit": "mV/pC"}
    parts = {name: {"channel": part.lower() if formula else part, **amplifier} for name, part in PARTS.items()}
    derived = {part.lower(): f"{part} / 10 [mV/pC]" for part in PARTS.values()} if formula else {}
    common = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": COMMON, "derived": derived}
    described = rig_description.from_dict({**common, "channels": {"frequency_hz": {"channel": "f"}, **parts}})
    (recording,) = read_file(f"f (Hz);Re (V/N);Im (V/N)\n{rows}".encode(), "frf.csv", described).campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.frf_re_pc_per_n is not None
    np.testing.assert_allclose(recording.frf_re_pc_per_n, [7.4 + 0.01 * n for n in range(1, 9)])


PARTS = {"frf_re_pc_per_n": "Re", "frf_im_pc_per_n": "Im"}


@pytest.mark.parametrize(
    ("heading", "is_refused"),
    [
        ("|H| [pC rms/N]", True), ("Charge rms / Force peak [pC/N]", True), ("|H| [pC p-p/N]", True),
        ("|H| [pC rms/N rms]", False), ("|H| [pC/N]", False), ("|H| [pC pk/N pk]", False),
    ],
)  # fmt: skip
def test_frf_of_two_amplitudes_refused(heading: str, is_refused: bool) -> None:
    """An FRF whose heading says rms or peak-to-peak of charge or force alone is refused, unless `labelled` says so."""
    channels = {"frequency_hz": {"channel": "Frequency [Hz]"}, "frf_magnitude_pc_per_n": {"channel": heading}}
    channels["frf_phase_deg"] = {"channel": "Phase [deg]"}
    stated = {"schema": "rig/1", "skin": document(FRF)["skin"], "recording": COMMON, "channels": channels}
    data = f"Frequency [Hz];{heading};Phase [deg]\n5;7.2;0\n10;7.1;0\n20;7.2;0\n".encode()
    if is_refused:
        with pytest.raises(FileError, match="says rms or peak-to-peak of charge or force alone"):
            read_file(data, "a.csv", rig_description.from_dict(stated))
        channels["frf_magnitude_pc_per_n"] |= {"labelled": labelled_unit(heading), "unit": "pC/N"}
    (recording,) = read_file(data, "a.csv", rig_description.from_dict(stated)).campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_re_pc_per_n.tolist() == pytest.approx([7.2, 7.1, 7.2])

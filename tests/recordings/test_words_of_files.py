"""What a file says of its recordings in the words of its instrument and country is taken for what it is, or left out
with a note."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.support.campaign_documents import SKIN
from tests.support.instrument_files import matlab_5, numpy_file, plain_hdf5
from underskin.errors import FileError
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import FrfRecording

RATE = 2000.0
TIME = np.arange(400) / RATE
FORCE = 1.0 + 0.05 * np.sin(2 * np.pi * 50 * TIME)
CHARGE = 7.4 * (FORCE - 1)
RIG: dict[str, Any] = {
    "schema": "rig/1",
    "skin": SKIN,
    "recording": {"sensor": "s01", "indenter_radius_mm": 4, "preload_n": 1, "dynamic_force_n": 0.05},
}
HEADERS = {
    language: "\n".join(lines)
    for language, lines in {
        "English": ("Layer thickness: 2.5 mm", "Elastic modulus: 16 MPa", "Sensor radius: 1.5 mm", "Tip radius: 4 mm",
            "Static force: 1 N"),
        "German": ("Schichtdicke;2,5 mm", "E-Modul;16 MPa", "Sensorradius;1,5 mm", "Kugeldurchmesser;8 mm",
            "Vorspannkraft;1000 mN"),
        "French": ("Épaisseur;2,5 mm", "Module d'élasticité;16 MPa", "Rayon du capteur;1,5 mm", "Rayon de bille;4 mm",
            "Précharge;1 N"),
        "Italian": ("Spessore;2,5 mm", "Modulo elastico;16 MPa", "Raggio del sensore;1,5 mm", "Raggio della sfera;4 mm",
            "Precarico;1 N"),
        "Spanish": ("Espesor;2,5 mm", "Módulo de Young;16 MPa", "Radio del sensor;1,5 mm", "Diámetro de la esfera;8 mm",
            "Precarga;1 N"),
    }.items()
}  # fmt: skip


def read(text: str, **changes: Any) -> Reading:
    return read_file(text.encode(), "a.csv", rig_description.from_dict({**RIG, **changes}) if changes else None)


def rows(*columns: Any, separator: str = ";", decimal: str = ",") -> str:
    return "\n".join(
        separator.join(f"{cell:.6f}".replace(".", decimal) for cell in row) for row in np.stack(columns, 1).tolist()
    )


@pytest.mark.parametrize("language", HEADERS)
def test_header_in_five_languages(language: str) -> None:
    """A header says the skin, the sphere and the preload in its own words; a diameter is halved."""
    mark = "." if language == "English" else ","
    table = rows(TIME, FORCE, CHARGE, decimal=mark)
    reading = read(f"{HEADERS[language]}\nTime (s);F (N);Q (pC)\n{table}\n")
    (recording,), skin = reading.campaign.of(FrfRecording), reading.campaign.skin
    assert (skin.thickness_mm, skin.youngs_modulus_mpa, skin.sensor_radius_mm) == (2.5, 16, 1.5)
    assert (recording.indenter_radius_mm, recording.preload_n) == (4, 1)
    assert recording.force_n == pytest.approx(FORCE, abs=1e-6)


def test_header_fills_every_field() -> None:
    """Position, load cycles, dwell, date, d33 and the rate of the samples come from a header, too."""
    further = "Fs: 2000\nLoad cycles: 1200\nDwell time: 2 min\nposition x [mm]: 1\nposition y [mm]: -2\nd33: 14 pC/N"
    header = f"{HEADERS['English']}\n{further}\nDate: 12 March 2026\nskin.id: palm-3"
    reading = read(f"{header}\nF (N);Q (pC)\n{rows(FORCE, CHARGE, decimal='.')}\n")
    (recording,), skin = reading.campaign.of(FrfRecording), reading.campaign.skin
    assert (recording.sample_rate_hz, recording.load_cycles, recording.dwell_s) == (2000, 1200, 120)
    assert recording.position_mm == pytest.approx((1, -2))
    stated = (recording.recorded_at, skin.id, skin.d33_pc_per_n)
    assert stated == ("2026-03-12T00:00:00+00:00", "palm-3", 14)


def test_preload_in_a_column_of_a_time_series() -> None:
    """A column of preloads beside the force tells recordings apart, and is no force."""
    runs = [[np.full(len(TIME), number), np.full(len(TIME), load), TIME, FORCE * load, CHARGE * load]
            for number, load in enumerate((0.5, 1.0, 2.0), start=1)]  # fmt: skip
    table = "\n".join(rows(*run) for run in runs)
    header = HEADERS["German"].rpartition("\n")[0]  # without the preload
    reading = read(f"{header}\nRun;Vorspannkraft (N);Zeit (s);Kraft (N);Ladung (pC)\n{table}\n")
    assert [recording.preload_n for recording in reading.campaign.of(FrfRecording)] == [0.5, 1, 2]
    for recording, load in zip(reading.campaign.of(FrfRecording), (0.5, 1, 2), strict=True):
        assert recording.force_n == pytest.approx(load * FORCE, abs=1e-6)


def test_sample_is_no_sphere() -> None:
    """The diameter and the height of a sample are not taken for those of a sphere and a layer."""
    header = "Diameter [mm];12\nSpecimen thickness [mm];10\nE-Modul (MPa);1,6"
    with pytest.raises(FileError, match=r"does not say recording.indenter_radius_mm"):
        read(f"{header}\nStroke [mm];Force [N]\n{rows(TIME, FORCE)}\n")


@pytest.mark.parametrize("other", ["PVDF thickness: 0.028 mm", "Substrate thickness: 5 mm", "Trägerdicke: 5 mm"])
def test_another_thickness_is_not_the_skin_s(other: str) -> None:
    """The thickness of a film or a base is not that of the skin, and two of the skin are one too many."""
    header = HEADERS["English"].replace("Layer thickness: 2.5 mm", other)
    table = f"Time (s);F (N);Q (pC)\n{rows(TIME, FORCE, CHARGE, decimal='.')}\n"
    with pytest.raises(FileError, match=r"does not say skin.thickness_mm"):
        read(f"{header}\n{table}")
    with pytest.raises(FileError, match=r"more than one column or property may be thickness_mm"):
        read(f"{HEADERS['English']}\nSkin thickness: 3 mm\n{table}")


ABOUT = ("Preload uncertainty: 0.01 N", "Vorspannkraft-Toleranz: 0,1 N", "Preload limit: 50 N", "Bend radius: 40 mm")


@pytest.mark.parametrize("other", ABOUT)
def test_a_spread_is_not_the_quantity(other: str) -> None:
    """An uncertainty, a tolerance or a limit, and the radius of a bend, are no preload and no sphere."""
    table = f"Time (s);F (N);Force std (N);Q (pC)\n{rows(TIME, FORCE, 0 * FORCE, CHARGE, decimal='.')}\n"
    (recording,) = read(f"{other}\n{HEADERS['English']}\n{table}").campaign.of(FrfRecording)
    assert (recording.indenter_radius_mm, recording.preload_n) == (4, 1)
    assert recording.force_n == pytest.approx(FORCE, abs=1e-6)
    without = HEADERS["English"].replace("Tip radius: 4 mm\n", "").replace("Static force: 1 N", other)
    with pytest.raises(FileError, match=r"does not say recording.indenter_radius_mm"):
        read(f"{without}\n{table}")


@pytest.mark.usefixtures("understood_here")
@pytest.mark.parametrize("write", [numpy_file, matlab_5, plain_hdf5])
@pytest.mark.parametrize(("name", "value"), [("fs", RATE), ("Fs", RATE), ("sampling_rate", RATE), ("dt", 1 / RATE)])
def test_rate_that_an_array_has_beside_it(write: Callable[[Any], bytes], name: str, value: float) -> None:
    """A scalar called as the rate of the samples, or their step, is it, unless the rig description says another."""
    data = write({"force": FORCE, "charge": CHARGE, name: value})
    channels = {"force_n": {"channel": "force", "unit": "N"}, "charge_pc": {"channel": "charge", "unit": "pC"}}
    for stated, rate in ({}, RATE), ({"sample_rate_hz": 500}, 500):
        described = {**RIG, "channels": channels, "recording": {**RIG["recording"], **stated}}
        reading = read_file(data, "run.dat", rig_description.from_dict(described))
        assert [recording.sample_rate_hz for recording in reading.campaign.of(FrfRecording)] == [rate]


LINES = {
    "frequency_hz": {"channel": "f (Hz)"},
    "frf_magnitude_pc_per_n": {"channel": "H (pC/N)"},
    "frf_phase_deg": {"channel": "Phase (°)"},
}


@pytest.mark.parametrize(
    ("written", "mark", "time"),
    [
        ("12 mars 2026", ".", "2026-03-12T00:00:00+00:00"),
        ("12. März 2026 09:15", ".", "2026-03-12T09:15:00+00:00"),
        ("mardi 12 mars 2026 à 9h15", ".", "2026-03-12T09:15:00+00:00"),
        ("12 de marzo de 2026", ".", "2026-03-12T00:00:00+00:00"),
        ("Mar 12, 2026 9:15 PM", ".", "2026-03-12T21:15:00+00:00"),
        ("04/05/2026 09:15", ",", "2026-05-04T09:15:00+00:00"),
        ("04/05/2026 09:15", ".", None),
        ("05/13/2026 09:15", ",", "2026-05-13T09:15:00+00:00"),
        ("au printemps", ",", None),
        ("12 févr. 2026", ".", "2026-02-12T00:00:00+00:00"),
        ("3 Sept 2017", ".", "2017-09-03T00:00:00+00:00"),
        ("decay 3 2017", ".", None),
        ("3 marks 2017", ".", None),
    ],
)
def test_date_of_a_column(written: str, mark: str, time: str | None) -> None:
    """Dates are read as their country writes them; one that cannot be read is left out with a note, no recording is."""
    cells = "\n".join(f"{written};{f};7{mark}4;0{mark}5" for f in (5, 10, 20))
    recording = {**RIG["recording"], "recorded_at": {"channel": "Date"}}
    reading = read(f"Date;f (Hz);H (pC/N);Phase (°)\n{cells}\n", recording=recording, channels=LINES)
    assert [one.recorded_at for one in reading.campaign.recordings] == [time]
    assert reading.problems == []
    notes = [warning for warning in reading.warnings if written in warning and "left out" in warning]
    assert len(notes) == (time is None)

"""Tables as spreadsheets and their users write them: read as meant, told where something is left out, or refused."""

import cmath
import math

import pytest

from tests.recordings.test_recordings_cells import ABOVE, HEADINGS, PLAIN, ROWS, changed, read, refusal
from underskin.errors import InvalidInput
from underskin.recordings import Reading
from underskin.recordings.campaign import FrfRecording


def only(reading: Reading) -> FrfRecording:
    assert reading.problems == []
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    return recording


def same_as_plain(text: str) -> Reading:
    reading, plain = read(text), only(read(PLAIN))
    found = only(reading)
    assert (found.id, found.sensor) == (plain.id, plain.sensor)
    assert found.indenter_radius_mm == pytest.approx(plain.indenter_radius_mm)
    assert found.frf_re_pc_per_n == pytest.approx(plain.frf_re_pc_per_n)
    assert found.frf_im_pc_per_n == pytest.approx(plain.frf_im_pc_per_n)
    return reading


@pytest.mark.parametrize(
    "text",
    [
        "sep=,\n" + PLAIN,
        '"sep=,"\r\n' + PLAIN.replace("\n", "\r\n"),
        "# exported on Monday\n" + changed("r1,", "# by hand, mb\nr1,"),
        changed("-0.5", "\N{MINUS SIGN}0.5"),
        changed("id,sensor", "ID,Sensor"),
        changed(HEADINGS, HEADINGS.replace("preload_n", "Preload N").replace("frf_re_pc_per_n", "FRF re pC per N")),
        changed("schema,", "Schema,").replace("name,", "NAME,").replace("sensor,s01,0", "Sensor,s01,0"),
        changed("skin.thickness_mm,2.5", "Skin.Thickness [µm],2500").replace("skin.young", "SKIN.Young"),
        changed(HEADINGS, HEADINGS.replace("\n", ",\n")),
        ABOVE + "," + HEADINGS + "0," + ROWS.replace("\n,", "\n1,,"),
        ABOVE + "Unnamed: 0," + HEADINGS + "1," + ROWS.replace("\n,", "\n2,,"),
        changed("indenter_radius_mm", "Indenter radius [inch]").replace("r1,s01,4,", f"r1,s01,{4 / 25.4},"),
    ],
    ids=[
        "sep",
        "sep-crlf",
        "comments",
        "minus",
        "capitals",
        "blanks",
        "capitals above",
        "capitals and units",
        "blank heading",
        "index",
        "pandas",
        "inch",
    ],
)
def test_what_spreadsheets_add_changes_nothing(text: str) -> None:
    assert same_as_plain(text).warnings == []


def test_columns_of_words_are_left_out_and_told() -> None:
    text = ABOVE + HEADINGS.replace("\n", ",Bemerkung\n") + ROWS.replace("-0.5\n", "-0.5,erste Messung\n")
    (warning,) = same_as_plain(text).warnings
    assert "'Bemerkung' holds words and is no field" in warning
    assert "conditions.NAME" in warning


def test_numbers_without_a_field_are_refused_and_a_misspelt_heading_is_guessed() -> None:
    unknown = refusal(ABOVE + HEADINGS.replace("\n", ",humidity\n") + ROWS.replace("-0.5\n", "-0.5,40\n"))
    assert (unknown.place, "conditions.NAME" in unknown.reason) == ("line 9, column 9", True)
    assert "did you mean preload_n?" in refusal(changed("preload_n", "prelaod_n")).reason
    assert "did you mean skin.thickness_mm?" in refusal(changed("skin.thickness_mm", "skin.thicknes_mm")).reason
    unnamed = refusal(ABOVE + HEADINGS.replace("id,", "id,,") + ROWS.replace("r1,", "r1,40,").replace("\n,", "\n,,"))
    assert unnamed.reason == "has no heading, but cells such as '40'"


@pytest.mark.parametrize(
    "heading",
    [
        "Dynamic force p-p [N]",
        "Dynamic force peak-to-peak [N]",
        "Dynamic force pp [N]",
        "Dynamic force RMS [N]",
        "dynamic_force_pp [N]",
        "dynamic_force_pp_n",
        "dynamic_force_rms_n",
        "force_rms [N]",
        "peak_to_peak force [N]",
    ],
)
def test_a_force_that_is_no_amplitude_is_not_taken_for_one(heading: str) -> None:
    reason = refusal(changed("dynamic_force_n", heading)).reason
    assert "dynamic_force_n is the amplitude: half of peak-to-peak, √2 times rms" in reason
    assert "did you mean" not in reason


def test_a_diameter_is_halved_and_that_is_told() -> None:
    for heading in ("indenter_diameter_mm", "Indenter diameter [mm]"):
        reading = same_as_plain(changed("indenter_radius_mm", heading).replace("r1,s01,4,", "r1,s01,8,"))
        assert reading.warnings == [f"{heading!r} is halved"]
    both = refusal(
        changed("indenter_radius_mm", "indenter_radius_mm,indenter_diameter_mm").replace("s01,4,", "s01,4,8,")
    )
    assert "second column of indenter_radius_mm" in both.reason


@pytest.mark.parametrize(
    ("heading", "turn"),
    [
        ("frf_phase_deg", 180 / math.pi),
        ("Frf phase [rad]", 1.0),
        ("Phase [deg]", 180 / math.pi),
        ("phase [°]", 180 / math.pi),
        ("Phase (rad)", 1.0),
    ],
)
def test_magnitude_and_phase_stand_for_real_and_imaginary_part(heading: str, turn: float) -> None:
    head = HEADINGS.replace("frf_re_pc_per_n,frf_im_pc_per_n", f"frf_magnitude_pc_per_n,{heading}")
    polar = [cmath.polar(value) for value in (7.1 - 0.5j, 7.2 - 0.6j)]
    rows = [f"{magnitude!r},{phase * turn!r}" for magnitude, phase in polar]
    same_as_plain(ABOVE + head + f"r1,s01,4,1.0,0.09,10,{rows[0]}\n,,,,,20,{rows[1]}\n")
    alone = refusal(
        ABOVE + HEADINGS.replace("frf_re_pc_per_n,frf_im_pc_per_n", "frf_magnitude_pc_per_n,coherence") + ROWS
    )
    assert "needs frf_phase_deg or frf_phase_rad with it" in alone.reason
    beside = refusal(ABOVE + head.replace("\n", ",frf_re_pc_per_n\n") + f"r1,s01,4,1.0,0.09,10,{rows[0]},7\n")
    assert "is given with real and imaginary parts" in beside.reason


def test_a_phase_without_a_unit_is_in_degrees_where_its_values_say_so_and_else_asked_for() -> None:
    head = HEADINGS.replace("frf_re_pc_per_n,frf_im_pc_per_n", "frf_magnitude_pc_per_n,FRF_Phase")

    def written(turn: float, first: complex, second: complex) -> str:
        rows = [f"{abs(value)!r},{cmath.phase(value) * turn!r}" for value in (first, second)]
        return ABOVE + head + f"r1,s01,4,1.0,0.09,10,{rows[0]}\n,,,,,20,{rows[1]}\n"

    recording = only(read(written(180 / math.pi, 7.1 - 0.5j, 7.2 - 3j)))  # -4° and -23°
    assert recording.frf_im_pc_per_n == pytest.approx([-0.5, -3.0])
    (warning,) = read(written(180 / math.pi, 7.1 - 0.5j, 7.2 - 3j)).warnings
    assert "'FRF_Phase' is read as degrees" in warning
    for turn in (1.0, 180 / math.pi):  # at most 5° or 5 rad
        refused = refusal(written(turn, 7.1 - 0.5j, 7.2 - 0.6j))
        assert refused.place == "line 9, column 8"
        assert "frf_phase_deg or frf_phase_rad" in refused.reason


@pytest.mark.parametrize(
    ("old", "new", "field", "place"),
    [
        (",7.2,", ",abc,", "frf_re_pc_per_n[1]", "line 11, column 7"),
        (",1.0,0.09", ",heavy,0.09", "preload_n", "line 10, column 4"),
    ],
)
def test_a_cell_that_is_no_number_is_told_with_its_line(old: str, new: str, field: str, place: str) -> None:
    (problem,) = read(changed(old, new)).problems
    assert (problem.recording, problem.field) == ("r1", field)
    assert problem.allowed == f"must be a number ({place})"


def test_a_number_above_the_table_that_is_none_is_told_with_its_line() -> None:
    with pytest.raises(InvalidInput, match=r"skin.thickness_mm = 'thin': must be a number \(line 3, column 2\)"):
        read(changed("skin.thickness_mm,2.5", "skin.thickness_mm,thin"))


@pytest.mark.parametrize(
    ("written", "time"),
    [
        ("24.12.2025 09:30", "2025-12-24T09:30:00"),
        ("3.2.2025 9:05:07", "2025-02-03T09:05:07"),
        ("24/12/2025 09:30", "2025-12-24T09:30:00"),
        ("12/24/2025", "2025-12-24T00:00:00"),
    ],
)
def test_local_times_are_read_and_their_zone_told(written: str, time: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = ABOVE + HEADINGS.replace("\n", ",recorded_at\n") + ROWS.replace("-0.5\n", f"-0.5,{written}\n")
    for zone, offset in (("UTC", "+00:00"), ("Europe/Berlin", "+01:00")):
        monkeypatch.setenv("UNDERSKIN_TIME_ZONE", zone)
        reading = same_as_plain(text)
        assert only(reading).recorded_at == time + offset
        (warning,) = reading.warnings
        assert warning == f"times such as {written} are taken to be in the zone {zone} (UNDERSKIN_TIME_ZONE)"
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", "Europe/Berlln")
    with pytest.raises(InvalidInput, match="must be a time zone such as Europe/Rome"):
        read(text)


@pytest.mark.parametrize("day", ["24.12.2025", "2025-12-24", "2025-12-24T00:00:00+01:00"])
def test_a_date_and_a_time_of_day_in_columns_of_their_own_are_one_time(day: str) -> None:
    def table(headings: str, cells: str) -> str:
        return ABOVE + HEADINGS.replace("\n", headings + "\n") + ROWS.replace("-0.5\n", f"-0.5,{cells}\n", 1)

    assert only(same_as_plain(table(",Date,Time", f"{day},09:30"))).recorded_at == "2025-12-24T09:30:00+00:00"
    assert only(same_as_plain(table(",Uhrzeit,Datum", f"9:30:07,{day}"))).recorded_at == "2025-12-24T09:30:07+00:00"
    if "T" not in day:
        assert only(read(table(",Date", day))).recorded_at == "2025-12-24T00:00:00+00:00"
    for time in ("2025-12-24T09:30:00+01:00", "2025-12-24T09:30:00"):  # a time in the column of a date stays
        assert only(read(table(",Date", time))).recorded_at == time
    refused = refusal(table(",Date,Time", ",09:30"))
    assert (refused.place, refused.reason) == ("line 10, column 9", "has a time of day, '09:30', and no Date")
    unread = read(table(",Date,Time", "31.2.2025,09:30"))
    assert only(unread).recorded_at is None
    assert "is no date and time" in " ".join(unread.warnings)


@pytest.mark.parametrize(
    ("written", "reason"),
    [
        ("03/02/2025 09:30", "can be two days, 3 February 2025 or 2 March 2025"),
        ("31.2.2025 09:30", "is no date and time"),
        ("in the morning", "is no date and time that can be read here"),
    ],
)
def test_time_two_none_left_out(written: str, reason: str) -> None:
    """A time that can be two or none is left out with a note, and the recording is used."""
    reading = read(ABOVE + HEADINGS.replace("\n", ",recorded_at\n") + ROWS.replace("-0.5\n", f"-0.5,{written}\n"))
    assert only(reading).recorded_at is None
    (note,) = reading.warnings
    assert note.startswith(f"line 10, column 9: recorded_at = {written!r} {reason}")


def test_forces_in_grams_and_pounds_are_converted() -> None:
    for unit, newtons in (("gf", 9.80665e-3), ("kgf", 9.80665), ("lbf", 4.4482216152605)):
        text = changed("preload_n", f"Preload [{unit}]").replace(",1.0,0.09", f",{1.0 / newtons},0.09")
        assert only(same_as_plain(text)).preload_n == pytest.approx(1.0)


def test_what_a_cut_file_ends_with_is_not_taken_for_a_note() -> None:
    cut = read(PLAIN + ",,,,,30\n")
    assert [(problem.recording, problem.value) for problem in cut.problems] == [("r1", None)] * 2
    begun = read(PLAIN + "r2\n")
    assert {problem.recording for problem in begun.problems} == {"r2"}

"""Uploads: understood, corrected, kept once or not at all; and what nobody else may do."""

import csv
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import FilePayload

from service.pages.upload_shelf import Shelf
from service.store.errors import Missing
from service.uploads import Upload
from tests.pages.conftest import Visit
from tests.pages.lab_files import SHAKER_RIG, shaker_tdms
from tests.pages.test_pages_security import BROWSING, HOSTILE, token_of
from tests.store.server import Place, Server, campaign, running
from underskin.recordings import rig_description

GAIN = 7.4
TEMPLATE = Path(__file__).parents[2] / "examples" / "formats" / "template.csv"


def file(name: str, content: bytes | str) -> FilePayload:
    return {"name": name, "mimeType": "", "buffer": content.encode() if isinstance(content, str) else content}


def look_at(visitor: Visit, files: list[FilePayload], *, rig: str = "", skin: str = "") -> None:
    page = visitor.page
    visitor.go("/upload")
    page.get_by_label("Files").set_input_files(files)
    page.get_by_label("Skin").fill(skin)
    if rig:
        page.get_by_label("Rig description").set_input_files(file("rig.yaml", rig))
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")


def as_json(document: dict[str, object]) -> str:
    return httpx.Request("POST", "http://x", json=document).content.decode()


def campaigns_of(server: Server, skin: str) -> list[str]:
    answer = server.http.get("/v1/campaigns", params={"skin": skin}).json()
    return [entry["id"] for entry in answer["campaigns"]]


def test_a_bad_recording_is_explained_field_by_field(visitor: Visit, server: Server) -> None:
    document = campaign("one bad", id="one-bad")
    document["recordings"][1] |= {"preload_n": -2.0, "sensor": "nowhere"}
    look_at(visitor, [file("one bad.json", as_json(document))])
    page = visitor.page
    assert "5 recordings understood, 1 refused" in page.get_by_role("status").inner_text()
    row = page.get_by_role("row", name="preload_n")
    assert "-2.0" in row.inner_text()
    assert "greater than 0" in row.inner_text()
    assert campaigns_of(server, "one-bad") == []
    page.get_by_role("button", name="Keep 5 recordings").click()
    page.wait_for_url("**/campaigns/*")
    assert len(campaigns_of(server, "one-bad")) == 1


def test_a_rig_description_reads_a_recording_and_its_form_keeps_what_it_says(visitor: Visit, server: Server) -> None:
    page = visitor.page
    look_at(visitor, [file("press.tdms", shaker_tdms(GAIN))], rig=SHAKER_RIG, skin="shaker")
    page.get_by_text("1 recording understood").wait_for()
    visitor.drawn(2)
    shown = page.get_by_role("row", name="press").last.inner_text()
    assert float(shown.split()[-1]) == pytest.approx(GAIN, rel=0.02)
    page.get_by_text("What the channels are").click()
    assert page.get_by_label("Sign of Amplifier").input_value() == "-1"
    page.get_by_label("Sensitivity of Amplifier", exact=True).fill("5")  # as if the range had been another
    page.get_by_role("button", name="Read it so").click()
    page.get_by_text("1 recording understood").wait_for()
    shown = page.get_by_role("row", name="press").last.inner_text()
    assert float(shown.split()[-1]) == pytest.approx(2 * GAIN, rel=0.02)
    page.get_by_text("What the channels are").click()
    with page.expect_download() as saving:
        page.get_by_role("link", name="Save this as a rig description").click()
    saved = rig_description.parse(saving.value.path().read_bytes(), "rig.json")
    assert saved.channels["charge_pc"].sensitivity == 5
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    kept = server.http.get("/v1/skins/shaker").json()["rig"]
    assert kept["channels"]["charge_pc"]["sensitivity"] == 5
    assert kept["recording"]["dwell_s"] == 30  # which the form does not show
    look_at(visitor, [file("next.tdms", shaker_tdms(GAIN))], skin="shaker")  # read as the last one was
    page.get_by_text("1 recording understood").wait_for()


def test_a_mapping_that_cannot_be_used_says_why(visitor: Visit) -> None:
    page = visitor.page
    look_at(visitor, [file("press.tdms", shaker_tdms(GAIN))], rig=SHAKER_RIG)
    page.get_by_text("What the channels are").click()
    page.get_by_label("Unit of the sensitivity of Amplifier").fill("")
    page.get_by_role("button", name="Read it so").click()
    alert = page.get_by_role("alert")
    assert "channels.charge_pc.sensitivity" in alert.inner_text()
    visitor.require_accessible()
    page.get_by_label("Unit of the sensitivity of Amplifier").fill("mV/N")
    page.get_by_label("sphere radius R [mm]", exact=True).fill("5")
    page.get_by_label("Layout").fill("s01 0")
    page.get_by_role("button", name="Read it so").click()
    assert "name, x [mm], y [mm]" in alert.inner_text()
    assert page.get_by_label("sphere radius R [mm]", exact=True).input_value() == "5"  # what was typed is still there
    assert page.get_by_label("Layout").input_value() == "s01 0"
    page.get_by_label("Layout").fill("s01 0 0")
    page.get_by_label("sphere radius R [mm]", exact=True).fill("")
    page.get_by_role("button", name="Read it so").click()
    page.get_by_role("heading", name="It cannot be read so").wait_for()
    assert "Amplifier" in page.get_by_role("row", name="file").inner_text()
    page.get_by_label("Unit of the sensitivity of Amplifier").fill("mV/pC")
    page.get_by_role("button", name="Read it so").click()
    assert "fill it in below" in page.get_by_role("row", name="sphere radius R [mm]").inner_text()


def test_the_table_that_is_offered_can_be_sent(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/upload")
    with page.expect_download() as saving:
        page.get_by_role("link", name="this table").click()
    offered = saving.value.path().read_bytes()
    assert offered == TEMPLATE.read_bytes()
    look_at(visitor, [file("template.csv", offered)])
    assert "understood" in page.get_by_role("status").inner_text()
    assert page.get_by_role("button", name="Keep").count() == 1


def test_files_that_are_dropped_are_looked_at(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/upload")
    page.evaluate(
        """text => {
            const carried = new DataTransfer();
            carried.items.add(new File([text], "dropped.json"));
            const how = { dataTransfer: carried, bubbles: true, cancelable: true };
            document.body.dispatchEvent(new DragEvent("drop", how));
        }""",
        as_json(campaign("dropped")),
    )
    page.wait_for_url("**/upload/*")
    assert "6 recordings understood" in page.get_by_role("status").inner_text()


def test_files_of_one_day_become_one_campaign_or_one_each(visitor: Visit, server: Server) -> None:
    page = visitor.page
    both = [file(f"{name}.json", as_json(campaign(name, id="day"))) for name in ("morning", "evening")]
    look_at(visitor, both)
    assert "12 recordings understood" in page.get_by_role("status").inner_text()
    page.get_by_role("link", name="evening.json").click()
    visitor.drawn(1)
    page.get_by_label("Name of the campaign").fill("the whole day")
    page.get_by_role("button", name="Keep 12 recordings").click()
    page.wait_for_url("**/campaigns/*")
    assert page.get_by_role("heading", level=1).inner_text() == "the whole day"
    look_at(visitor, both)
    page.get_by_label("a campaign each").check()
    page.get_by_role("button", name="Keep 12 recordings").click()
    page.wait_for_url("**/skins/day")
    assert len(campaigns_of(server, "day")) == 3


def test_files_of_two_skins_are_not_joined_and_nothing_is_kept(visitor: Visit, server: Server) -> None:
    page = visitor.page
    thin, thick = campaign("thin"), campaign("thick")
    thick["skin"]["thickness_mm"] = 5.0
    look_at(visitor, [file("thin.json", as_json(thin)), file("thick.json", as_json(thick))], skin="two-skins")
    page.get_by_role("button", name="Keep 12 recordings").click()
    assert "skin.thickness_mm" in page.get_by_role("alert").inner_text()
    assert campaigns_of(server, "two-skins") == []


def test_a_campaign_is_corrected_by_a_newer_file(visitor: Visit, server: Server) -> None:
    page = visitor.page
    wrong = server.http.post("/v1/campaigns", json=campaign("slip", id="corrected")).json()["id"]
    visitor.go(f"/campaigns/{wrong}")
    page.get_by_text("or correct or withdraw").click()
    page.get_by_role("link", name="Upload a corrected version").click()
    page.get_by_label("Files").set_input_files([file("right.json", as_json(campaign("right", id="corrected")))])
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")
    assert wrong in page.locator("form.keep").inner_text()
    visitor.require_accessible()
    page.get_by_label("Why").fill("the modulus of another batch")
    page.get_by_role("button", name="Keep 6 recordings").click()
    page.wait_for_url("**/campaigns/*")
    right = page.url.rpartition("/")[2]
    found = server.http.get(f"/v1/campaigns/{wrong}").json()
    assert (found["corrected_by"], found["state"]) == (right, "corrected")
    visitor.go(f"/upload?skin=corrected&corrects={wrong}")  # once more, though it is corrected already
    page.get_by_label("Files").set_input_files([file("again.json", as_json(campaign("again", id="corrected")))])
    page.get_by_role("button", name="Look at them").click()
    page.wait_for_url("**/upload/*")
    page.get_by_label("Why").fill("another slip")
    page.get_by_role("button", name="Keep 6 recordings").click()
    assert "corrected" in page.get_by_role("alert").inner_text()
    assert page.get_by_label("Why").input_value() == "another slip"
    assert campaigns_of(server, "corrected") == [right]


def test_hostile_names_in_files_stay_text(visitor: Visit) -> None:
    page = visitor.page
    page.on("dialog", lambda dialog: visitor.wrong.append(dialog.message))
    name = HOSTILE.replace("/", "|")
    look_at(visitor, [file(f"{name}.tdms", shaker_tdms(GAIN, load_cell=name))], skin=HOSTILE)
    visitor.drawn(1)
    assert page.locator("img[src=x]").count() == 0
    assert "<script>" in page.get_by_role("heading", level=1).inner_text()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth + 1")


@pytest.fixture
def sender(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=60) as client:
        yield client


def posted(client: httpx.Client, name: str = "by hand") -> str:
    """The address of an upload."""
    form = {"form_token": token_of(client.get("/upload").text), "skin": name}
    answer = client.post("/upload", data=form, files={"file": ("a.json", as_json(campaign(name)))})
    assert answer.status_code == 303, answer.text
    return answer.headers["location"]


def test_kept_twice_is_kept_once_and_what_is_discarded_is_gone(sender: httpx.Client, server: Server) -> None:
    place = posted(sender, "twice")
    form = {"form_token": token_of(sender.get(place).text), "skin": "twice"}
    first, second = (sender.post(f"{place}/keep", data=form) for _ in range(2))
    assert first.headers["location"] == second.headers["location"]
    assert len(campaigns_of(server, "twice")) == 1
    assert sender.get(place).headers["location"] == first.headers["location"]
    place = posted(sender, "discarded")
    assert sender.post(f"{place}/discard", data=form).status_code == 303
    assert sender.get(place).status_code == 404
    assert campaigns_of(server, "discarded") == []
    assert list((server.place.folder / "uploads").rglob(f"shelf-{Path(place).name}/*")) == []


def test_an_upload_is_its_session_s_own(sender: httpx.Client, server: Server) -> None:
    place = posted(sender)
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING) as other:
        form = {"form_token": token_of(other.get("/upload").text), "skin": "stolen"}
        assert other.get(place).status_code == 404
        for path in ("keep", "discard", "mapping"):
            assert other.post(f"{place}/{path}", data=form).status_code == 404
        assert other.get(f"{place}/0/frf.csv").status_code == 404
    rows = list(csv.DictReader(sender.get(f"{place}/0/frf.csv").text.splitlines()))
    assert len(rows) == 6 * 20
    assert sender.get(f"{place}/1/frf.csv").status_code == 404


def test_an_upload_needs_the_session_s_own_form(sender: httpx.Client) -> None:
    files = {"file": ("a.json", as_json(campaign("forged")))}
    token = token_of(sender.get("/upload").text)
    assert sender.post("/upload", data={"form_token": "x"}, files=files).status_code == 403
    assert sender.post("/upload", files=files).status_code == 403
    other_site = {"Origin": "https://example.org"}
    assert sender.post("/upload", data={"form_token": token}, files=files, headers=other_site).status_code == 403
    assert sender.post("/upload", data={"form_token": token}).status_code in (415, 422)  # no file
    place = posted(sender)
    for path in ("keep", "discard", "mapping"):
        assert sender.post(f"{place}/{path}", data={"form_token": "x"}).status_code == 403


def test_who_may_read_only_uploads_nothing(locked: tuple[Server, dict[str, str]]) -> None:
    server, keys = locked
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING) as somebody:
        somebody.post("/login", data={"form_token": token_of(somebody.get("/login").text), "key": keys["read"]})
        shown = somebody.get("/upload").text
        assert "may read only" in shown
        assert 'type="file"' not in shown
        form = {"form_token": token_of(shown)}
        own = {"Origin": str(server.http.base_url).rstrip("/")}
        files = {"file": ("a.json", as_json(campaign("locked")))}
        answer = somebody.post("/upload", data=form, files=files, headers=own)
        assert answer.status_code == 403
        assert "scope read" in answer.text


def test_an_upload_beyond_the_limit_is_refused_on_a_page(tmp_path: Path) -> None:
    with (
        running(Place(tmp_path / "small"), UNDERSKIN_MAX_UPLOAD_MB="0.1") as server,
        httpx.Client(base_url=server.http.base_url, headers=BROWSING) as somebody,
    ):
        form = {"form_token": token_of(somebody.get("/upload").text)}
        answer = somebody.post("/upload", data=form, files={"file": ("a.csv", b"1,2\n" * 50_000)})
        assert answer.status_code == 413
        assert "UNDERSKIN_MAX_UPLOAD_MB" in answer.text
        assert "<h1>" in answer.text


def upload(folder: Path, size: int) -> Upload:
    path = folder / f"{len(list(folder.iterdir()))}"
    path.write_bytes(b"x" * size)
    return Upload(path, "a", "file", "", in_form=True)


def test_the_shelf_holds_no_more_than_one_upload_may(tmp_path: Path) -> None:
    arriving, shelf_folder = tmp_path / "arriving", tmp_path / "shelf"
    arriving.mkdir()
    shelf_folder.mkdir()
    shelf = Shelf(shelf_folder, 1000)
    first, second = (shelf.put(cookie, [upload(arriving, 400)]) for cookie in ("one", "two"))
    assert shelf.find("one", first.id) is first
    third = shelf.put("three", [upload(arriving, 400)])
    with pytest.raises(Missing):
        shelf.find("two", second.id)  # looked at longest ago
    assert shelf.find("one", first.id) is first
    again = shelf.put("one", [upload(arriving, 100)])  # a session has one
    with pytest.raises(Missing):
        shelf.find("one", first.id)
    assert sum(path.stat().st_size for path in shelf_folder.rglob("*") if path.is_file()) == 500
    assert [shelf.find("one", again.id), shelf.find("three", third.id)] == [again, third]

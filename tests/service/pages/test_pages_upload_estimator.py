"""The estimator that the upload's form asks for: how the files are looked at, kept, and sent by the same request."""

import pytest

from tests.service.ingest.test_store_estimator import shaken
from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import as_json, campaigns_of, file, look_at
from tests.support.store_server import Server


def frf_shown(visitor: Visit) -> float:
    """The median magnitude of the first recording."""
    return float(
        visitor.page.get_by_role("region", name="Recordings").locator("tbody tr").first.inner_text().split()[-1]
    )


def test_estimator_form_looked_kept(visitor: Visit, server: Server) -> None:
    """The estimator of the form is looked with and kept.

    Noise of 30 % in both channels: H2 is 1.09² times H1.
    """
    page, upload = visitor.page, file("shaken.json", as_json(shaken("shaken")))
    look_at(visitor, [upload])
    as_before = frf_shown(visitor)
    look_at(visitor, [upload], skin="estimated", estimator="H2")
    assert frf_shown(visitor) / as_before == pytest.approx(1.09**2, abs=0.03)
    assert "estimator\nH2" in page.locator("dl.facts").inner_text()
    assert "estimator=H2" in page.content()
    visitor.require_accessible()
    page.get_by_role("button", name="Keep").click()
    page.wait_for_url("**/campaigns/*")
    (kept,) = campaigns_of(server, "estimated")
    recordings = server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"]
    assert {recording["estimator"] for recording in recordings} == {"H2"}


def test_form_skin_explains_estimators(visitor: Visit) -> None:
    """The form of a skin explains the estimators."""
    visitor.go("/upload?skin=palm")
    options = visitor.page.get_by_label("Estimator").locator("option").all_inner_texts()
    assert [option.split(":")[0] for option in options[1:]] == ["H1", "H2", "Hv"]
    assert "relatively as much in both (Hv)" in visitor.page.locator("#upload").inner_text()

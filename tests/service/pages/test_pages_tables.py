"""The tables in words: their ranges, their errors and their hashes."""

import h5py
import numpy as np

from tests.service.pages.conftest import Visit
from tests.support.store_server import Server
from underskin.surrogate.hdf5_format import tables_folder
from underskin.surrogate.sigma_table import SIGMA_TABLE


def test_table_tells_range_errors_how_made(visitor: Visit, server: Server) -> None:
    """Each table tells its range its errors and how it was made."""
    page = visitor.page
    visitor.go("/design")
    page.get_by_role("link", name="Tables").click()
    page.wait_for_url("**/tables")
    answered = server.http.get("/v1/tables").json()["tables"]
    assert page.locator("main section").count() == len(answered) == 3
    for summary in page.get_by_text("How it was made").all():
        summary.click()
    shown = page.locator("main").inner_text()
    for entry in answered:
        assert entry["table_sha256"] in shown
        assert entry["about"]["solver"] in shown
    across = page.get_by_role("region", name="Range of Transmission").get_by_role("row", name="contact radius a")
    assert "a 0 to 7.5 mm" in across.inner_text()  # 3 times the prototype's 2.5 mm
    with h5py.File(tables_folder() / SIGMA_TABLE) as file:
        largest = float(np.max(file["sigma/interpolation_error"][()]))
    told = page.get_by_role("region", name="Errors of Transmission").get_by_role("row", name="interpolation")
    assert float(told.locator("td").nth(1).locator(".number").get_attribute("title") or "") == largest
    visitor.require_accessible()

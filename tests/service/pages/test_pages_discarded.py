"""The page of a campaign that was discarded."""

from tests.service.pages.forms import BROWSING
from tests.support.store_server import Server, campaign


def test_discarded_campaign_says_once_why(server: Server) -> None:
    """A discarded campaign says once what it is and why."""
    one = server.http.post("/v1/campaigns?skin=discarded", json=campaign("tried", sensors=1)).json()["id"]
    assert server.http.post(f"/v1/campaigns/{one}/discard", json={"reason": "a mere trial"}).status_code == 200
    page = server.http.get(f"/campaigns/{one}", headers=BROWSING).text
    assert "It is in no list, and no figure uses it. That can be undone below." in page
    assert page.count("a mere trial") == 2  # above, and among what was changed
    assert "Withdrawn" not in page

"""The mark of a skin, by which its page knows that something has changed."""

from tests.support.diagnosed import asked, finished, sent
from tests.support.store_server import Server, campaign

BACKEND = "sqlite"


def test_a_mark_changes_with_what_the_page_shows_and_with_nothing_else(server: Server) -> None:
    def mark(skin: str) -> str:
        return str(server.http.get(f"/skins/{skin}/mark").json()["mark"])

    campaign_id = sent(server, campaign("first", sensors=1), "marked")
    marks = [mark("marked")]
    sent(server, campaign("other", sensors=1), "unmarked")
    assert mark("marked") == marks[0]
    sent(server, campaign("second", sensors=1), "marked")
    marks.append(mark("marked"))
    server.http.post(f"/v1/campaigns/{campaign_id}/exclusions", json={"recording": "s0-1N", "reason": "cable"})
    marks.append(mark("marked"))
    asked(server, campaign_id)
    marks.append(mark("marked"))
    finished(server)
    marks.append(mark("marked"))
    server.http.post("/v1/skins/marked/join", json={"skin_id": "unmarked", "reason": "one skin"})
    marks.append(mark("marked"))
    server.http.post(f"/v1/campaigns/{campaign_id}/withdraw", json={"reason": "wrong sphere"})
    marks.append(mark("marked"))
    assert len(set(marks)) == len(marks)
    assert mark("unmarked") == mark("marked")
    assert server.http.get("/skins/nobody/mark").status_code == 404

"""Forms of pages, sent without a browser, and what pages say."""

import html
import re

from tests.support.store_server import Server

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)>{{7*7}}=1+1"
BROWSING = {"Accept": "text/html"}


def token_of(page: str) -> str:
    found = re.search(r'name="form_token" value="([^"]+)"', page)
    assert found is not None
    return found[1]


def said(server: Server, path: str, row: str = "") -> str:
    """The text of a page, or of the first row of its tables that holds some text."""
    answer = server.http.get(path, headers=BROWSING)
    assert answer.status_code == 200, answer.text
    page = answer.text.partition("<main")[2]
    if row:
        page = next(part for part in page.split("<tr")[1:] if row in html.unescape(part)).partition("</tr>")[0]
    page = re.sub(r"<(script|style|svg)\b.*?</\1>", " ", page, flags=re.DOTALL)
    page = re.sub(r"</?(?:a|abbr|b|code|em|i|small|span|strong|sub|sup|time)\b[^>]*>", "", page)
    return " ".join(html.unescape(re.sub("<[^>]*>", " ", page)).split())

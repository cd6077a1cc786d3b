"""Other sites, other people and hostile names get nowhere."""

import importlib
import pkgutil
import re
from collections.abc import Iterator

import httpx
import pytest
from fastapi.routing import APIRoute
from playwright.sync_api import Browser

from service import pages
from service.auth import session
from service.auth.keys import KeyStore
from tests.service.pages.conftest import Visit, visit
from tests.service.pages.forms import BROWSING, HOSTILE, token_of
from tests.service.waiting import until
from tests.support.store_server import Server, campaign


def _posts() -> list[str]:
    """The addresses of all forms of pages."""
    names = [found.name for found in pkgutil.walk_packages(pages.__path__, f"{pages.__name__}.")]
    routers = [router for name in names if (router := getattr(importlib.import_module(name), "router", None))]
    routes = [route for router in routers for route in router.routes if isinstance(route, APIRoute)]
    return sorted({re.sub(r"{.*?}", "x", route.path) for route in routes if "POST" in (route.methods or ())})


POSTS = _posts()
assert len(POSTS) > 25
CHANGE_NOTHING = {"/login", "/logout", "/sessions/x/end", "/loads/map"}  # nothing that is kept of measurements
MAP = "mm,-1,0,1\n-1,0,0.1,0\n0,0.1,0.3,0.1\n1,0,0.1,0\n"


def posted(client: httpx.Client, path: str, token: str, headers: dict[str, str] | None = None) -> httpx.Response:
    """A form of any page, with a file where it takes some."""
    form = {"form_token": token, "map": MAP, "reason": "?"}
    with_file = {"/upload": {"file": ("a.json", b"{}")}, "/loads/map": {"other": ("", b"")}}.get(path)
    return client.post(path, data=form, files=with_file, headers=headers)


@pytest.fixture
def anyone(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        yield client


def test_every_page_has_a_policy_that_lets_nothing_in(anyone: httpx.Client) -> None:
    for path in ("/", "/design", "/nothing"):
        policy = anyone.get(path).headers["content-security-policy"]
        assert policy.startswith("default-src 'none'; script-src 'self';")
        assert "frame-ancestors 'none'" in policy
        assert "http:" not in policy
        assert "unsafe-inline" not in policy.replace("style-src-attr 'unsafe-inline'", "")


def test_behind_tls_the_cookie_goes_through_tls_only(anyone: httpx.Client) -> None:
    plain, secure = anyone.get("/"), anyone.get("/", headers={"X-Forwarded-Proto": "https", "Cookie": "other=1"})
    assert "; secure" not in plain.headers["set-cookie"].lower()
    assert "; secure" in secure.headers["set-cookie"].lower()
    assert "curl -s https://" in secure.text


def test_a_page_says_what_it_takes(anyone: httpx.Client) -> None:
    assert anyone.delete("/design").headers["allow"] == "GET"
    assert anyone.get("/example").headers["allow"] == "POST"


def test_every_form_is_its_session_s_own(anyone: httpx.Client, server: Server) -> None:
    """No page takes a form of another session, without a token, or of another site; nothing is changed by it."""
    token = token_of(anyone.get("/").text)
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as other:
        assert other.post("/example", data={"form_token": token}).status_code == 403
        other.get("/")
        for path in POSTS:
            assert posted(other, path, token).status_code == 403, path
            assert posted(other, path, "").status_code == 403, path
    for path in POSTS:
        assert posted(anyone, path, token, {"Origin": "https://example.org"}).status_code == 403, path
    assert server.http.get("/v1/skins").json()["skins"] == []


def test_hostile_and_endless_names_stay_text(visitor: Visit, server: Server) -> None:
    name = HOSTILE + "x" * 10_000
    document = campaign("hostile", id=f"palm {HOSTILE}"[:180].replace("/", "|"))
    document["name"] = name[:10_000]
    for entry in document["skin"]["sensors"]:
        entry["id"] += HOSTILE
    for recording in document["recordings"]:
        recording["sensor"] += HOSTILE
        recording["id"] += HOSTILE
    kept = server.http.post("/v1/campaigns", json=document)
    assert kept.status_code in (201, 422), kept.text
    if kept.status_code == 422:  # a name of that length is refused: a long one that is taken
        document["name"] = name[:200]
        kept = server.http.post("/v1/campaigns", json=document)
    visitor.page.on("dialog", lambda dialog: visitor.wrong.append(dialog.message))
    for path, figures in (("/", 0), (f"/campaigns/{kept.json()['id']}", 4)):
        visitor.go(path)
        visitor.drawn(figures)
        assert visitor.page.locator("img[src=x]").count() == 0
        assert visitor.page.evaluate("document.documentElement.scrollWidth <= innerWidth + 1")
    whole = visitor.page.get_by_role("heading", level=1).locator("span").get_attribute("title")
    assert HOSTILE in str(whole)
    visitor.go("/")
    visitor.page.get_by_role("link", name="palm <script>").click()
    visitor.drawn(2)


def test_with_keys_pages_need_a_login(browser: Browser, locked: tuple[Server, dict[str, str]]) -> None:
    server, keys = locked
    for somebody in visit(browser, server):
        page = somebody.page
        somebody.go("/skins/example?sensor=s%2B1&show=a+b%20c")
        page.wait_for_url("**/login?next=/skins/example%3Fsensor%3Ds%252B1%26show%3Da%2Bb%2520c")
        somebody.require_accessible()
        page.get_by_label("Key").fill("us_wrong")
        page.get_by_role("button", name="Log in").click()
        assert "not known" in page.get_by_role("alert").inner_text()
        assert somebody.wrong.pop().startswith("Failed to load resource")
        page.get_by_label("Key").fill(keys["write"])
        page.get_by_role("button", name="Log in").click()
        page.wait_for_url("**/skins/example?sensor=s%2B1&show=a+b%20c")
        somebody.wrong.clear()  # there is no such skin yet
        somebody.go("/")
        page.get_by_role("button", name="Load the example skin").click()
        page.wait_for_url("**/skins/example")
        page.get_by_text("Name, notes and tags").click()
        page.get_by_label("Notes").fill("a scratch")
        page.context.clear_cookies()
        page.get_by_role("button", name="Save").click()
        page.wait_for_url("**/login?next=/skins/example&unsent=1")
        assert "what you sent was not taken" in page.get_by_role("alert").inner_text()
        page.get_by_label("Key").fill(keys["write"])
        page.get_by_role("button", name="Log in").click()
        page.wait_for_url("**/skins/example")  # the page of the form
        somebody.wrong.clear()  # what the page asked for without a cookie was refused
        page.wait_for_function("() => document.querySelector('[name=remark]')?.value === 'a scratch'")
        page.get_by_role("button", name="Save").click()
        page.get_by_text("a scratch").first.wait_for()
        page.get_by_text("Name, notes and tags").click()
        page.get_by_label("Notes").fill("")
        page.reload()
        assert page.get_by_label("Notes").input_value() == "a scratch"  # as kept: what was typed comes back once
        (cookie,) = page.context.cookies()
        assert (cookie["httpOnly"], cookie["sameSite"]) == (True, "Strict")
        page.get_by_role("button", name="Log out").click()
        page.wait_for_url("**/login")
        somebody.wrong.clear()  # so was what it still asked for
        somebody.go("/")
        page.wait_for_url("**/login?next=/")


def test_who_may_read_only_changes_nothing(locked: tuple[Server, dict[str, str]]) -> None:
    """By no page; what only computes is answered."""
    server, keys = locked
    own = {"Origin": str(server.http.base_url).rstrip("/")}
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as reader:
        reader.post("/login", data={"form_token": token_of(reader.get("/login").text), "key": keys["read"]})
        start = reader.get("/").text
        assert "Load the example skin" not in start
        assert 'type="file"' not in reader.get("/upload").text
        for path in set(POSTS) - CHANGE_NOTHING:
            answer = posted(reader, path, token_of(start), own)
            assert (answer.status_code, "scope read" in answer.text) == (403, True), path
        assert posted(reader, "/loads/map", token_of(start), own).status_code == 200
        # A page's script may read with the session; what changes something must say whose page it is of.
        assert reader.get("/v1/skins").status_code == 200
        assert reader.post("/v1/sigma", json={"a_over_h": 0.3, "rt_over_h": 0.6}).status_code == 401


def test_a_session_ends_with_its_key(locked: tuple[Server, dict[str, str]]) -> None:
    server, _ = locked
    key = server.place.command("key", "create", "guest").stdout.strip()
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as guest:
        guest.post("/login", data={"form_token": token_of(guest.get("/login").text), "key": key})
        assert guest.get("/").status_code == 200
        server.place.command("key", "revoke", "guest")
        until(lambda: guest.get("/").status_code != 200)
        assert guest.get("/").status_code == 303


def test_session_ends_time_nobody_move(locked: tuple[Server, dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    """A session ends with its time which nobody can move."""
    server, _ = locked
    (key,) = [one for one in KeyStore(server.place.folder).entries() if one.name == "the reader"]
    good = session.logged_in(key)
    monkeypatch.setattr(session, "LASTS_S", -1)
    over = session.logged_in(key)
    nonce, of_key, end, signature = over.split(".")
    later = f"{nonce}.{of_key}.{int(end) + 3600}.{signature}"
    for cookie, status in ((good, 200), (over, 303), (later, 303)):
        headers = {**BROWSING, "Cookie": f"{session.COOKIE}={cookie}"}
        assert httpx.get(f"{server.http.base_url}", headers=headers).status_code == status


def test_login_leads_nowhere_else(locked: tuple[Server, dict[str, str]]) -> None:
    server, keys = locked
    for place in ("//example.org", "https://example.org", "/\\example.org", "javascript:alert(1)"):
        with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as somebody:
            form = {"form_token": token_of(somebody.get("/login").text), "key": keys["read"], "next": place}
            assert somebody.post("/login", data=form).headers["location"] == "/"

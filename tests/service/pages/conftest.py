"""A real server with the example skin, and a real browser that looks at its pages."""

import shutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Error,
    Page,
    Request,
    ViewportSize,
    WebError,
    expect,
    sync_playwright,
)

from bench.soak import SOAK
from tests.service.conftest import emptied
from tests.support.store_server import Place, Server, running

CHROMIUM = shutil.which("chromium")
EXAMPLE = "/skins/example"
SERIOUS = ("serious", "critical")
VIOLATIONS = {"resultTypes": ["violations"]}  # all of these; listing what passed would take twice as long
# Drawing without a process of its own for a graphics card that is not there, and one for all pages of a context.
OPTIONS = ["--no-sandbox", "--disable-gpu", "--in-process-gpu", "--process-per-site"]
LIMIT_MS = 240_000  # of what is waited for: it ends a hang alone
WINDOW = ViewportSize(width=1280, height=720)
# What kinds of elements are to be seen outside a page's drawings: where, which, in which state and in which colours.
KINDS = """() => [...document.querySelectorAll("body :not(svg *)")]
  .filter((one) => one.checkVisibility())
  .map((one) => [location.pathname.split("/")[1], matchMedia("(prefers-color-scheme: dark)").matches, one.tagName,
  ...["class", "role", "name", "aria-invalid"].map((name) => one.getAttribute(name))].join("|"))"""


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """The system's Chromium, closed after these tests: its driver's event loop keeps others from having theirs."""
    if CHROMIUM is None:
        pytest.skip("Chromium (Debian's package chromium) is not installed")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        expect.set_options(timeout=LIMIT_MS)
        context = started.new_context(timezone_id="Europe/Rome", locale="en-GB", accept_downloads=True, viewport=WINDOW)
        context.set_default_timeout(LIMIT_MS)
        _keep_a_process(context)
        context.new_page()
        yield started
        started.close()


def _keep_a_process(context: BrowserContext) -> None:
    """An empty page of the site of all servers, as long as the browser runs: a page of a new process would take 2 s of
    the processor to read the scripts of figures anew."""
    page = context.new_page()
    page.route("**/*", lambda route: route.fulfill(body=""))
    page.goto("http://127.0.0.1/")


@pytest.fixture(scope="session")
def running_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests here; it runs no diagnosis."""
    with running(Place(tmp_path_factory.mktemp("pages")), UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
        yield started


@pytest.fixture(scope="session")
def diagnosing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that runs diagnoses, for the few that go the whole way; they add to it."""
    settings = {"UNDERSKIN_DIAGNOSIS_WORKERS": "1", "UNDERSKIN_DIAGNOSIS_READY": "true"}  # the program is loaded once
    with running(Place(tmp_path_factory.mktemp("diagnosing")), **settings) as started:
        yield started


@pytest.fixture(scope="module")
def server(running_server: Server) -> Server:
    """That one, its store emptied for each module."""
    return emptied(running_server)


_looked_at: set[str] = set()


@dataclass
class Visit:
    """A page of a browser, and what should never happen in it."""

    page: Page
    address: str
    wrong: list[str] = field(default_factory=list)

    def go(self, path: str) -> None:
        """Open a path of the server."""
        self.page.goto(self.address + path)

    def drawn(self, count: int) -> None:
        """Wait until so many figures are drawn, unfolding a report and scrolling as a visitor would."""
        self.page.wait_for_function(  # a link just clicked may not have led there yet
            "n => document.readyState === 'complete' && document.querySelectorAll('.plot').length >= n", arg=count
        )
        self.page.evaluate("document.querySelectorAll('.report .part').forEach((part) => (part.open = true))")
        for plot in self.page.locator(".plot").all():
            plot.scroll_into_view_if_needed()
        self.page.wait_for_function(
            "n => document.querySelectorAll('.plot .main-svg:first-child').length >= n", arg=count
        )

    def require_accessible(self) -> None:
        """axe-core finds no serious problem. A page of such elements alone as it has looked at is not looked at again,
        but in `make soak`."""
        kinds = set(self.page.evaluate(KINDS))
        if kinds <= _looked_at and not SOAK:
            return
        _looked_at.update(kinds)
        found = Axe().run(self.page, options=VIOLATIONS).response["violations"]
        assert [(entry["id"], entry["nodes"][0]["html"]) for entry in found if entry["impact"] in SERIOUS] == []


def visit(browser: Browser, server: Server) -> Iterator[Visit]:
    """A session of its own, in the page that all tests share, which is made as new; at its end nothing may have gone
    wrong."""
    context = browser.contexts[0]
    seen = Visit(context.pages[1], str(server.http.base_url).rstrip("/"))

    def warned(message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            seen.wrong.append(message.text)

    def failed(error: WebError) -> None:
        seen.wrong.append(str(error.error))

    def asked(request: Request) -> None:
        if not request.url.startswith((seen.address, "data:", "blob:")):
            seen.wrong.append(f"request to {request.url}")

    context.on("console", warned)
    context.on("weberror", failed)
    context.on("request", asked)
    try:
        yield seen
    finally:
        context.remove_listener("console", warned)
        context.remove_listener("weberror", failed)
        context.remove_listener("request", asked)
        _make_as_new(context, seen.address)
    assert seen.wrong == []


def _make_as_new(context: BrowserContext, address: str) -> None:
    """A new page, or one of another site, would take the processor longer than a test has to do in it."""
    page, *others = context.pages[1:]
    for other in others:
        other.close()
    page.unroute_all()
    with suppress(Error):  # where another address came first
        page.goto(f"{address}/ready")
        page.evaluate("sessionStorage.clear()")
    page.emulate_media(media="null", color_scheme="null", reduced_motion="null")
    page.set_viewport_size(WINDOW)
    context.clear_cookies()


@pytest.fixture
def visitor(browser: Browser, server: Server) -> Iterator[Visit]:
    """Somebody at the server."""
    yield from visit(browser, server)


@pytest.fixture
def patient(browser: Browser, diagnosing: Server) -> Iterator[Visit]:
    """Somebody who waits for a diagnosis."""
    yield from visit(browser, diagnosing)


@pytest.fixture
def newcomer(visitor: Visit, server: Server) -> Visit:
    """Somebody on the page of the example skin, which the first one of a module loads."""
    if server.http.get("/v1/skins/example").status_code == 404:
        visitor.go("/")
        visitor.page.get_by_role("button", name="Load the example skin").click()
        visitor.page.wait_for_url(f"**{EXAMPLE}")
    else:
        visitor.go(EXAMPLE)
    return visitor


@pytest.fixture(scope="session")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, dict[str, str]]]:
    """A server that asks for a key, and the keys by scope."""
    folder = tmp_path_factory.mktemp("locked")
    place = Place(folder)
    keys = {
        scope: place.command("key", "create", f"the {scope}er", "--scope", scope).stdout.strip()
        for scope in ("read", "write")
    }
    with running(place, key=keys["write"], UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
        yield started, keys


@pytest.fixture
def downloads(tmp_path: Path) -> Path:
    """Where files are saved."""
    return tmp_path

"""A real server with the example skin, and a real browser that looks at its pages."""

import shutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Error, Page, Request, WebError, sync_playwright

from tests.support.store_server import Place, Server, running

CHROMIUM = shutil.which("chromium")
EXAMPLE = "/skins/example"
SERIOUS = ("serious", "critical")
VIOLATIONS = {"resultTypes": ["violations"]}  # all of these; listing what passed would take twice as long
# Drawing without a process of its own for a graphics card that is not there, and one for all pages of a context.
OPTIONS = ["--no-sandbox", "--disable-gpu", "--in-process-gpu", "--process-per-site"]


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """The system's Chromium, closed after these tests: its driver's event loop keeps others from having theirs."""
    if CHROMIUM is None:
        pytest.skip("Chromium (Debian's package chromium) is not installed")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        _keep_a_process(started.new_context(timezone_id="Europe/Rome", locale="en-GB", accept_downloads=True))
        yield started
        started.close()


def _keep_a_process(context: BrowserContext) -> None:
    """An empty page of the site of all servers, as long as the browser runs: a page of a new process would take 2 s of
    the processor to read the scripts of figures anew."""
    page = context.new_page()
    page.route("**/*", lambda route: route.fulfill(body=""))
    page.goto("http://127.0.0.1/")


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests here; they add to it."""
    folder = tmp_path_factory.mktemp("pages")
    with running(Place(folder)) as started:
        yield started


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
        """Wait until so many figures are drawn, unfolding a report and scrolling as a reader would."""
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
        """axe-core finds no serious problem."""
        found = Axe().run(self.page, options=VIOLATIONS).response["violations"]
        assert [(entry["id"], entry["nodes"][0]["html"]) for entry in found if entry["impact"] in SERIOUS] == []


def visit(browser: Browser, server: Server) -> Iterator[Visit]:
    """A fresh session; at its end nothing may have gone wrong."""
    context = browser.contexts[0]
    seen = Visit(context.new_page(), str(server.http.base_url).rstrip("/"))

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
        for page in context.pages[1:]:
            _close(page)
        context.clear_cookies()
    assert seen.wrong == []


def _close(page: Page) -> None:
    """Close a page, after what it is still loading was ended: Chromium may never answer that it closed one before."""
    with suppress(Error):  # where that came first
        page.goto("about:blank")
    page.close()


@pytest.fixture
def visitor(browser: Browser, server: Server) -> Iterator[Visit]:
    """Somebody at the server."""
    yield from visit(browser, server)


@pytest.fixture(scope="module")
def idle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of a module's own, since what is withdrawn or adopted stays; it runs no diagnosis."""
    with running(Place(tmp_path_factory.mktemp("idle")), UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
        yield started


@pytest.fixture
def reader(browser: Browser, idle: Server) -> Iterator[Visit]:
    yield from visit(browser, idle)


@pytest.fixture
def newcomer(reader: Visit, idle: Server) -> Visit:
    """Somebody on the page of the example skin, which the first one of a module loads."""
    if idle.http.get("/v1/skins/example").status_code == 404:
        reader.go("/")
        reader.page.get_by_role("button", name="Load the example skin").click()
        reader.page.wait_for_url(f"**{EXAMPLE}")
    else:
        reader.go(EXAMPLE)
    return reader


@pytest.fixture(scope="session")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, dict[str, str]]]:
    """A server that asks for a key, and the keys by scope."""
    folder = tmp_path_factory.mktemp("locked")
    place = Place(folder)
    keys = {
        scope: place.command("key", "create", f"the {scope}er", "--scope", scope).stdout.strip()
        for scope in ("read", "write")
    }
    with running(place, key=keys["write"]) as started:
        yield started, keys


@pytest.fixture
def downloads(tmp_path: Path) -> Path:
    """Where files are saved."""
    return tmp_path

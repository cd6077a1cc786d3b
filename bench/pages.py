"""The pages with a thousand stored campaigns: server time, weight, and the time that the main thread is busy."""

import re
import tempfile
import time
from pathlib import Path
from statistics import median

import httpx
from playwright.sync_api import sync_playwright

from bench import servers
from bench.figures import Figure
from bench.store import RECORDINGS, SKINS, campaign

CAMPAIGNS = 1000
ROUNDS = 9
_AT_ONCE = 40
_LIBRARY = "plotly"
_WATCH = """new PerformanceObserver(list => list.getEntries().forEach(entry =>
    (window.stood = window.stood || []).push(entry.duration))).observe({type: "longtask", buffered: true})"""


def measure() -> list[Figure]:
    """Server's time of each page, first view, weight, and the longest time that a browser's main thread is busy."""
    with tempfile.TemporaryDirectory() as folder, servers.underskin(Path(folder)) as server:
        for first in range(0, CAMPAIGNS, _AT_ONCE):
            small = [campaign(lines=20, sensors=4, preloads=2, seed=first + number) for number in range(_AT_ONCE)]
            server.post(f"/v1/campaigns?skin=palm-{first // _AT_ONCE % SKINS}", small)
        campaign_id = server.post("/v1/campaigns?skin=palm-3", campaign(lines=400))["id"]
        paths = {
            "Start": "/",
            "Skin of 41 campaigns": "/skins/palm-3",
            "The same, one sensor's lines and history": "/skins/palm-3?sensor=s07",
            f"Campaign of {RECORDINGS} recordings": f"/campaigns/{campaign_id}",
            "The campaign, one sensor's lines": f"/campaigns/{campaign_id}?show=s07",
            "Compare two campaigns": f"/compare?skin=palm-3&second={campaign_id}",
            "d33 of measured responses": "/d33?skin=palm-3",
            "Fleets": "/fleets",
            "Loads": "/loads?skin=palm-3",
            "Pressure map": "/loads/map?skin=palm-3",
            "Stress under a sphere": "/field?skin=palm-3",
            "Tables": "/tables",
            "Glossary": "/glossary",
            "Design": "/design?skin=palm-3",
            "Design, a slider's answer": "/design/answer?thickness_mm=3",
            "Designs that resolve 3 mm": "/design/search?resolution_mm=3",
            "Mechanisms": "/mechanisms",
            "Mechanisms, a picture": "/mechanisms/adhesion/picture.svg",
        }
        address = f"http://127.0.0.1:{server.port}"
        with httpx.Client(base_url=address, headers={"Accept": "text/html"}, timeout=60) as client:
            view = _first_view(client)
            paths["A diagnosis"] = _diagnosed(client)
            paths["Upload"] = "/upload"
            figures = [Figure("First view: start, style and scripts", view, "s", 1.0, "lower")]
            for name, path in paths.items():
                times = [_milliseconds(client, path) for _ in range(ROUNDS + 1)]
                figures.append(Figure(f"{name}, first time", times[0], "ms", 300.0, "lower"))
                figures.append(Figure(name, median(times[1:]), "ms", 300.0, "lower"))
            heaviest = max(_weight(client, path) for path in paths.values())
        figures.append(Figure("Weight of the heaviest page", heaviest / 1e3, "kB", 150.0, "lower"))
        figures.append(
            Figure(
                f"Longest busy spell of the main thread, {RECORDINGS} recordings drawn",
                median(_stands_still(address, campaign_id) for _ in range(ROUNDS)),
                "ms",
                200.0,
                "lower",
            )
        )
    return figures


def _diagnosed(client: httpx.Client) -> str:
    """The page of a diagnosis that is done, of the campaign that came first."""
    first = client.get("/v1/campaigns", params={"skin": "palm-0", "limit": 1}).json()["campaigns"][0]["id"]
    diagnosis_id = client.post(f"/v1/campaigns/{first}/diagnosis").json()["id"]
    while client.get(f"/v1/diagnoses/{diagnosis_id}").json()["state"] in ("queued", "running"):
        time.sleep(0.2)
    return f"/diagnoses/{diagnosis_id}"


def _milliseconds(client: httpx.Client, path: str) -> float:
    start = time.perf_counter()
    client.get(path).raise_for_status()
    return 1e3 * (time.perf_counter() - start)


def _first_view(client: httpx.Client) -> float:
    start = time.perf_counter()
    for path in ("/", *_loaded(client, "/")):
        client.get(path).raise_for_status()
    return time.perf_counter() - start


def _loaded(client: httpx.Client, path: str) -> list[str]:
    """What a page loads."""
    return re.findall(r'(?:src|href)="(/static/[^"]+)"', client.get(path).text)


def _weight(client: httpx.Client, path: str) -> int:
    """Bytes of a page and of what it loads, as sent."""
    total = 0
    for part in (path, *{loaded for loaded in _loaded(client, path) if _LIBRARY not in loaded}):
        with client.stream("GET", part) as answer:
            total += sum(len(chunk) for chunk in answer.iter_raw())
    return total


def _stands_still(address: str, campaign_id: str) -> float:
    """The longest task [ms] while the figures are drawn, after the library has loaded."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(f"{address}/skins/palm-3")
        page.wait_for_selector(".plot .main-svg")
        page.add_init_script(_WATCH)
        page.goto(f"{address}/campaigns/{campaign_id}")
        for plot in page.locator(".plot").all():
            plot.scroll_into_view_if_needed()
        page.wait_for_function(
            "() => [...document.querySelectorAll('.plot')].every(plot => plot.querySelector('.main-svg'))"
        )
        page.wait_for_timeout(1000)
        longest = page.evaluate("Math.max(0, ...(window.stood || []))")
        browser.close()
    return float(longest)

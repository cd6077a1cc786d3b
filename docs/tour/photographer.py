"""A server with an empty store, and a browser that looks at it."""

import io
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
from PIL import Image
from playwright.sync_api import Page, ViewportSize, sync_playwright

_START_S = 60.0
_SIZE = ViewportSize(width=1180, height=760)
_COLOURS = 256
_CHANGING = re.compile(r"\d{1,2} [A-Z][a-z]{2} \d{4}(, \d\d:\d\d)?|\b[cd]-[0-9a-f]{16}\b")
_EXPERIMENT = Path(__file__).parents[2] / "examples" / "rig" / "time_series.yaml"


@contextmanager
def serving(data: Path) -> Iterator[str]:
    """The address of a service that keeps what it is sent in `data`."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "underskin", "serve", "--port", str(port)]
    environment = os.environ | {"UNDERSKIN_DATA": str(data), "UNDERSKIN_DATABASE_URL": ""}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        _await(address, process)
        yield address
    finally:
        process.terminate()
        process.wait(20)


@contextmanager
def browsing(address: str) -> Iterator[Page]:
    """A page of the system's Chromium, at the server's start."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise RuntimeError("Chromium is not installed (Debian's package chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        context = browser.new_context(viewport=_SIZE, base_url=address, locale="en-GB", timezone_id="UTC")
        yield context.new_page()
        browser.close()


def drawn(page: Page, name: str) -> None:
    """Bring a figure into view and wait until it is drawn."""
    page.wait_for_load_state()  # by then all figures have their height
    figure = page.locator(f"#figure-{name}")
    figure.scroll_into_view_if_needed()
    figure.locator(".main-svg").first.wait_for()


def photograph(page: Page, path: Path) -> None:
    """What the window shows, in as few colours as a drawing needs: under 100 kB."""
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    shot.quantize(_COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(path, optimize=True)


def words(page: Page) -> str:
    """What the page says outside its drawings, without dates and ids, which are others each time."""
    drawings = "document.querySelectorAll('.plot').forEach((plot) => (plot.style.display = '{}'))"
    page.evaluate(drawings.format("none"))
    text = page.locator("main").inner_text()
    page.evaluate(drawings.format(""))
    return _CHANGING.sub("…", text)


def raw_recordings(folder: Path) -> tuple[Path, Path]:
    """A TDMS file as the virtual rig's data acquisition writes it, and its rig description."""
    command = [sys.executable, "-m", "underskin", "rig", "run", str(_EXPERIMENT), "--output-dir", str(folder), "--tdms"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / "recordings.tdms", folder / "rig.yaml"


def _await(address: str, process: "subprocess.Popen[bytes]") -> None:
    end = time.monotonic() + _START_S
    while time.monotonic() < end and process.poll() is None:
        try:
            if httpx.get(f"{address}/ready").status_code == 200:
                return
        except httpx.TransportError:
            time.sleep(0.05)
    raise RuntimeError("the service did not start")

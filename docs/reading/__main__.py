"""`python -m docs.reading`: diagnose the example's last campaign and photograph the report's page, with arrows."""

import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import ViewportSize

from docs.tour.photographer import browsing, photograph

PICTURE = "read-report.png"
_ROOT = Path(__file__).parents[2]
_EXAMPLE = _ROOT / "service" / "pages" / "start" / "example" / "2024-11.json"
_SIZE = ViewportSize(width=1470, height=1165)

# Part of the page (CSS), height in it (0: top, 1: bottom), and what to read there.
_NOTES = (
    (".first", 0.5, "1  What is missing", "or that nothing is"),
    (".verdict", 0.5, "2  Verdict and its probability", "from 80 % on an answer is stated as such"),
    ("dd:nth-of-type(1)", 0.5, "3  What to quote", "or why no d33 is to be quoted"),
    ("dd:nth-of-type(2)", 0.5, "4  Error on held-out recordings", "with the answer it should come near the noise"),
    ("dd:nth-of-type(3)", 0.25, "5  What to mind", "findings, and what may hide here"),
    (
        ".three > :first-child",
        0.20,
        "6  The recording explained worst",
        "circles: measured; dashes: paper; line: answer",
    ),
    (".three > :first-child", 0.56, "7  What either model leaves", "grey: 95 % of the noise"),
)
_DRAW = """notes => {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  document.body.style.margin = "1rem 0 0 1.5rem";
  document.body.append(svg);
  svg.setAttribute("width", innerWidth);
  svg.setAttribute("height", innerHeight);
  Object.assign(svg.style, { position: "absolute", left: 0, top: 0, fill: "#b3261e", stroke: "none" });
  const add = (name, attributes, text = "") => {
    const element = document.createElementNS(svg.namespaceURI, name);
    Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
    element.textContent = text;
    svg.append(element);
  };
  const x = 1080, font = "DejaVu Sans, sans-serif";
  let free = 40;
  notes.forEach(([selector, share, title, text]) => {
    const range = document.createRange();
    range.selectNodeContents(document.querySelector(selector));
    const box = range.getBoundingClientRect();
    const [tip, y] = [Math.min(box.right + 18, 1034), box.top + share * box.height];
    const at = Math.max(y, free);
    add("path", { d: `M${x - 8},${at} L${tip + 6},${y}`, stroke: "#b3261e", "stroke-width": 2 });
    add("path", { d: `M${tip},${y} l12,-5 l0,10 z` });
    add("text", { x, y: at + 5, "font-family": font, "font-size": 17, "font-weight": "bold" }, title);
    add("text", { x: x + 24, y: at + 25, "font-family": font, "font-size": 14 }, text);
    free = at + 52;
  });
}"""


def main(figures: Path = _ROOT / "docs" / "figures") -> None:
    """Diagnose, draw the arrows on the report's page and photograph it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "underskin", "diagnose", str(_EXAMPLE), "--output-dir", folder, "--html"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with browsing("") as page:
            page.set_viewport_size(_SIZE)
            page.goto((Path(folder) / f"{_EXAMPLE.stem}.html").as_uri())
            page.locator(".three .main-svg").first.wait_for()
            page.evaluate(_DRAW, [list(note) for note in _NOTES])
            photograph(page, figures / PICTURE)


if __name__ == "__main__":
    main()

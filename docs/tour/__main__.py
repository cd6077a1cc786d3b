"""`python -m docs.tour`: write docs/tour.md and its screenshots."""

import json
import tempfile
from pathlib import Path

from docs.tour.photographer import browsing, photograph, serving, words
from docs.tour.steps import STEPS, TourStep

SHOWN = "shown.json"  # the words of each page of the tour, which a test compares with the present ones
_HEAD = """# Five minutes with the pages

Written, with its pictures, by `python -m docs.tour`, which starts a server with an empty store and walks through it
with Chromium. Do the same: `make serve`, then open <http://127.0.0.1:8000>; no network beyond that server is needed.
"""


def main(docs: Path = Path(__file__).parents[1]) -> None:
    """Walk, photograph each step, and write `docs`/tour.md."""
    folder, shown = docs / "figures", {}
    with tempfile.TemporaryDirectory() as data, serving(Path(data)) as address, browsing(address) as page:
        for number, step in enumerate(STEPS, start=1):
            step.walk(page)
            photograph(page, folder / picture(number, step))
            shown[step.name] = words(page)
    (docs / "tour" / SHOWN).write_text(json.dumps(shown, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    (docs / "tour.md").write_text(document(), encoding="utf-8")


def document() -> str:
    """docs/tour.md."""
    return _HEAD + "".join(_section(number, step) for number, step in enumerate(STEPS, start=1))


def picture(number: int, step: TourStep) -> str:
    return f"tour-{number}-{step.name}.png"


def _section(number: int, step: TourStep) -> str:
    return f"\n## {number}. {step.title}\n\n{step.text}\n\n![{step.title}](figures/{picture(number, step)})\n"


if __name__ == "__main__":
    main()

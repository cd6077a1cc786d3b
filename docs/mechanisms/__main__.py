"""`python -m docs.mechanisms`: write docs/mechanisms.md and its figures."""

from pathlib import Path

from docs.mechanisms import figures
from docs.mechanisms.text import document
from underskin.mechanisms.registry import built_in
from underskin.surrogate.sigma_table import load_table


def main(docs: Path = Path(__file__).parents[1]) -> None:
    """Write `docs`/mechanisms.md and `docs`/figures/mechanism-*.svg."""
    folder = docs / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    figures.draw(load_table(), folder, [mechanism.name for mechanism in built_in()])
    (docs / "mechanisms.md").write_text(document(), encoding="utf-8")


if __name__ == "__main__":
    main()

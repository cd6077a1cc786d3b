"""`python -m docs.paper`: write docs/paper.md and its figures."""

from pathlib import Path

from docs.paper import block_question, figures
from docs.paper.service_run import run_array
from docs.paper.text import document
from underskin.surrogate.sigma_table import load_table


def main(docs: Path = Path(__file__).parents[1]) -> None:
    """Compute everything and write `docs`/paper.md and `docs`/figures/paper-fig*.svg."""
    table = load_table()
    folder = docs / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    figures.draw(table, folder)
    depths = [block_question.at_depth(depth) for depth in block_question.DEPTHS_MM]
    page = document(table, depths, block_question.wide_block_error(), run_array())
    (docs / "paper.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()

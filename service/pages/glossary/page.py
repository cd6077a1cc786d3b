"""The glossary: docs/glossary.md as a page, because a lab's server may have no network."""

import re
from functools import cache
from pathlib import Path

from fastapi import APIRouter, Request, Response
from markdown_it import MarkdownIt

from service.pages.shared.html import page

router = APIRouter(prefix="/glossary")

_FILE = Path(__file__).parents[3] / "docs" / "glossary.md"
_LINK = re.compile(r"\[([^]]+)\]\([^)]+\)")  # to pages that this server does not have


@router.get("")
def view(request: Request) -> Response:
    """The terms by their subject, each table below its heading."""
    introduction, subjects = _parts()
    return page(request, "glossary.html", introduction=introduction, subjects=subjects)


@cache
def _parts() -> tuple[str, list[tuple[str, str]]]:
    """In HTML what stands below the title, and each subject with the table of its terms."""
    markdown = MarkdownIt("js-default", {"html": False})
    first, *parts = _LINK.sub(r"\1", _FILE.read_text(encoding="utf-8")).split("\n## ")
    subjects = [part.partition("\n")[::2] for part in parts]
    tables = [(subject, markdown.render(text).replace("<table>", '<table class="list">')) for subject, text in subjects]
    return markdown.render(first.partition("\n")[2]), tables

"""The documentation: the pages of docs/ and the routes of the HTTP interface; a lab may have no network."""

import re
from functools import cache
from pathlib import Path
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response
from markdown_it import MarkdownIt

from service.pages.shared.html import page
from service.problems import Refusal

router = APIRouter()

_FOLDER = Path(__file__).parents[2] / "docs"
_LINK = re.compile(r"(!?)\[([^]]+)\]\(([^)#]*)(#[^)]*)?\)")
_NOT_WORD = re.compile(r"[^\w -]")
_FIRST = ("quickstart", "recordings", "diagnosis", "http-api")  # the others follow by name


@router.get("/glossary")
def glossary(request: Request) -> Response:
    """The terms by their subject, each table below its heading."""
    return view(request, "glossary")


@router.get("/docs")
def interface(request: Request) -> Response:
    """Each route of the HTTP interface with its parameters, an example, and a form that sends a request to read."""
    operations = [
        {"path": path, "method": method.upper(), **operation}
        for path, of_path in request.app.state.document(request.app)["paths"].items()
        for method, operation in of_path.items()
    ]
    return page(request, "docs_routes.html", operations=operations, names=_names(), example=_example)


@router.get("/docs/{name}")
def view(request: Request, name: str) -> Response:
    """A page of docs/."""
    if name not in _names():
        raise Refusal(404, f"There is no page {name!r} of the documentation; /docs lists them.")
    return page(request, "docs.html", names=_names(), name=name, title=_title(name), text=_html(name))


@cache
def _names() -> tuple[str, ...]:
    found = {file.stem for file in _FOLDER.glob("*.md")}
    return (*(name for name in _FIRST if name in found), *sorted(found.difference(_FIRST)))


def _title(name: str) -> str:
    return (_FOLDER / f"{name}.md").read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")


@cache
def _html(name: str) -> str:
    """A page as HTML, with the addresses of headings, and of links those to pages that the server has."""

    def linked(match: re.Match[str]) -> str:
        image, words, place, part = match.groups(default="")
        target = f"/docs/{Path(place).stem}" if place.endswith(".md") and "/" not in place else ""
        known = Path(place).stem in _names() if target else not place and bool(part)
        return f"[{words}]({target}{part})" if known and not image else words

    markdown = MarkdownIt("js-default", {"html": False, "linkify": False})
    html = markdown.render(_LINK.sub(linked, (_FOLDER / f"{name}.md").read_text(encoding="utf-8")))
    heading = _title(name)

    def labelled(match: re.Match[str]) -> str:
        nonlocal heading
        if match[0] == "<table>":
            return f'<div class="wide" tabindex="0" role="region" aria-label="{heading}"><table class="list">'
        level, words = match.groups()
        heading = re.sub(r"<[^>]+>", "", words)
        return f'<h{level} id="{_slug(heading)}">{words}</h{level}>'

    html = re.sub(r"<table>|<h([23])>(.*?)</h[23]>", labelled, html)
    return (
        html.replace("</table>", "</table></div>")
        .replace("<th></th>", "<td></td>")
        .replace("<pre>", '<pre tabindex="0">')
    )


def _slug(heading: str) -> str:
    """As GitHub makes the address of a heading."""
    return _NOT_WORD.sub("", heading.lower()).replace(" ", "-")


def _example(content: Any) -> str:
    """What was asked or answered, as text."""
    example = next((kind["example"] for kind in (content or {}).values() if "example" in kind), "")
    return example if isinstance(example, str) else orjson.dumps(example, option=orjson.OPT_INDENT_2).decode()

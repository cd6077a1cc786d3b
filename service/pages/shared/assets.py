"""Static files of pages: style, scripts (those of colours and paper also go into files saved from pages), and
plotly's own from its package. A version in the address lets browsers cache them permanently."""

import base64
import hashlib
import re
import zlib
from functools import cache
from pathlib import Path
from typing import Annotated

import plotly
from fastapi import APIRouter, Header, Response

from service.problems import Refusal
from underskin.diagnosis.reporting.page_styles import SCHEME

router = APIRouter()

LIBRARY = "plotly.min.js"
_FOLDER = Path(__file__).parents[1] / "static"
_OF_FIGURES = dict.fromkeys((SCHEME.name, "narrow.js", "paper.js"), SCHEME.parent)
_ELSEWHERE = {LIBRARY: Path(plotly.__file__).parent / "package_data", **_OF_FIGURES}
_TYPES = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml", ".csv": "text/csv"}
_FOR_GOOD = "public, max-age=31536000, immutable"


@router.get("/static/{name}")
def asset(
    name: str, if_none_match: Annotated[str, Header()] = "", accept_encoding: Annotated[str, Header()] = ""
) -> Response:
    """One of the files; gzipped where the client reads that, as every browser does."""
    if name not in names():
        raise Refusal(404, f"There is no file {name!r}.")
    tag = f'"{version(name)}"'
    headers = {"Vary": "Accept-Encoding", "ETag": tag, "Cache-Control": _FOR_GOOD, "X-Content-Type-Options": "nosniff"}
    if tag in if_none_match:
        return Response(status_code=304, headers=headers)
    media_type = _TYPES[Path(name).suffix]
    if "gzip" not in accept_encoding:
        return Response(_content(name), headers=headers, media_type=media_type)
    return Response(gzipped(name), headers={**headers, "Content-Encoding": "gzip"}, media_type=media_type)


@cache
def names() -> frozenset[str]:
    """All files there are."""
    return frozenset(file.name for file in _FOLDER.iterdir()) | _ELSEWHERE.keys()


def address(name: str) -> str:
    """Where a page finds a file."""
    return f"/static/{name}?v={version(name)}"


@cache
def version(name: str) -> str:
    """Changes with the file's content."""
    return hashlib.sha256(_content(name)).hexdigest()[:16]


@cache
def library_style_hash() -> str:
    """The hash by which the content security policy allows the style sheet that plotly's script adds for its maps."""
    script = _content(LIBRARY).decode()
    style = re.search(r"textContent='([^'\\]*)',document\.head\.appendChild", script)
    if style is None:
        return ""
    return f"'sha256-{base64.b64encode(hashlib.sha256(style[1].encode()).digest()).decode()}'"


@cache
def gzipped(name: str) -> bytes:
    """A file as it is sent."""
    packer = zlib.compressobj(6, wbits=31)
    return packer.compress(_content(name)) + packer.flush()


def _content(name: str) -> bytes:
    return (_ELSEWHERE.get(name, _FOLDER) / name).read_bytes()

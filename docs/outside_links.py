"""For the site: copies files of the repository to which pages link into it, and redirects the links to the copies.

A hook of MkDocs (mkdocs.yml), which takes pages only from `docs/`.
"""

import os
import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
_COPIES = "repository"  # folder of the site
_LINK = re.compile(r"\]\((?![a-z]+:)([^)#\s]+)")


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add what pages link to, and what is linked to from there."""
    waiting = [ROOT / "docs" / file.src_uri for file in files.documentation_pages()]
    while waiting:
        page = waiting.pop()
        for link in _LINK.findall(page.read_text(encoding="utf-8")):
            target = (page.parent / link).resolve()
            uri = _site_uri(target)
            if target.is_file() and uri not in files.src_uris:
                files.append(File.generated(config, uri, abs_src_path=str(target)))
                waiting += [target] if target.suffix == ".md" else []
    return files


def on_page_markdown(markdown: str, *, page: Page, **_: object) -> str:
    """Lead the links from a page to the places of their targets on the site."""
    folder = _source(page.file.src_uri).parent
    here = PurePosixPath(page.file.src_uri).parent

    def moved(match: re.Match[str]) -> str:
        return f"]({os.path.relpath(_site_uri((folder / match[1]).resolve()), here)}"

    return _LINK.sub(moved, markdown)


def _site_uri(path: Path) -> str:
    inside = path.relative_to(ROOT)
    return str(inside.relative_to("docs")) if inside.parts[0] == "docs" else f"{_COPIES}/{inside}"


def _source(uri: str) -> Path:
    return ROOT / uri.removeprefix(f"{_COPIES}/") if uri.startswith(f"{_COPIES}/") else ROOT / "docs" / uri

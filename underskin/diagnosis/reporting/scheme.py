"""The script that shows figures in the reader's colours, wherever a browser draws them: in a page or a file."""

from pathlib import Path

SCHEME = Path(__file__).parent / "templates" / "scheme.js"

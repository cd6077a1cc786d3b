"""A client of the service: columns of numbers in, columns of numbers out."""

from importlib.util import find_spec

if find_spec(f"{__name__}.documents") is None:
    raise ImportError("underskin/client/documents.py is missing: `python -m scripts.client_documents` writes it")

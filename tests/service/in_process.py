"""The service in the test's own process, for what no request to a server of its own can bring about."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
from fastapi import FastAPI

from service.app import create_api
from service.auth.access_control import AccessControl
from service.auth.key_requirement import KeyRequirement
from service.auth.keys import KeyStore
from service.auth.sessions import Sessions
from service.ingest.uploads import UploadFolder
from service.middleware.asgi_middleware import AsgiMiddleware
from service.pages.shared.html import problem_page
from service.settings import Settings
from service.store import Database, open_store
from underskin import load_table


@dataclass(frozen=True)
class InProcess:
    """An application that nobody serves, and its store."""

    api: FastAPI
    store: Database
    gate: AccessControl

    def client(self) -> httpx.AsyncClient:
        """A client of it."""
        transport = httpx.ASGITransport(AsgiMiddleware(self.api, self.gate, {}, problem_page))
        return httpx.AsyncClient(transport=transport, base_url="http://localhost", timeout=300)


@contextmanager
def in_process(folder: Path) -> Iterator[InProcess]:
    """One with an empty SQLite store in a folder, without keys and without diagnoses."""
    store, keys = open_store("", folder), KeyStore(folder)
    gate = AccessControl(
        host_names=frozenset(),
        keys=keys,
        requirement=KeyRequirement(keys, store),
        sessions=Sessions(store),
        keys_always=False,
        max_body_bytes=10**6,
        max_upload_bytes=10**6,
    )
    api = create_api(Settings(data=folder), load_table(), gate, store)
    api.state.uploads = UploadFolder(folder)
    try:
        yield InProcess(api, store, gate)
    finally:
        api.state.uploads.close()
        store.close()

"""Commands that need the server: serve and key."""

from typing import Annotated

import typer
import uvicorn

from service.app import create_api
from service.settings import Settings
from underskin.surrogate import SIGMA_TABLE, load_table


def serve(
    host: Annotated[str, typer.Option(help="Address to bind to.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on.")] = 8000,
) -> None:
    """Serve sigma, FRF and d33 over HTTP."""
    settings = Settings()
    table = load_table(settings.tables / SIGMA_TABLE)
    uvicorn.run(create_api(settings, table), host=host, port=port)

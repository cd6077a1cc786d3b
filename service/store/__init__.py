"""The service's store: skins, rigs, campaigns, recordings, and the d33 derived from them (docs/store.md)."""

from pathlib import Path

from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from service.store import migrate
from service.store.engine import Database, StorageFailed, StorageFull, database
from service.store.errors import Conflict, Missing, StoreError, StoreMoved
from service.store.tables import AnyRow

STORE_FAILED = (SQLAlchemyError, StorageFailed, StoreMoved, OSError)  # as a thread sees it that goes on

__all__ = [
    "STORE_FAILED",
    "AnyRow",
    "Conflict",
    "Database",
    "Missing",
    "StorageFailed",
    "StorageFull",
    "StoreError",
    "StoreMoved",
    "database",
    "open_store",
]


def open_store(database_url: str, folder: Path) -> Database:
    """The store, its schema up to date; raises StoreError that says what is wrong."""
    store = database(database_url, folder)
    try:
        migrate.migrate(store, folder)
    except DBAPIError as error:
        raise StoreError(f"the store at {store.url} cannot be used: {str(error.orig).strip()}") from error
    return store

"""Restore: a backup in place of the store, after a backup of what was there."""

from pathlib import Path

from service.store import backup, key_requirement
from service.store.engine import Database
from service.store.migrate import migrate, require_known, version


def restore(store: Database, file: Path, before: Path) -> None:
    """Replace the store by the backup `file`, brought up to date; what was there is in `before`.

    Where keys were needed they still are, whatever the backup says.

    Raises StoreError, with the store as it was.
    """
    require_known(backup.verify(store, file))
    store.make()
    with store.without_writers():  # what is acknowledged after the backup would be lost
        needed = store.read(key_requirement.is_needed)
        if version(store) is not None:
            backup.make(store, before)
        backup.replace_with(store, file)
    migrate(store, before.parent.parent)
    if needed:
        store.write(key_requirement.require)

"""Whether there is a scheduled backup of a store, young enough, whole, and of this store."""

from collections.abc import Iterator
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from service.settings import Settings
from service.store import Database, StoreError, StoreMoved, backup
from service.usecases.observation import Level, Observation, open_to_others
from service.usecases.scheduled_backups import OWNER, SKEW_S, foreign, newest, stored_backups


def of_backups(settings: Settings, store: Database) -> Iterator[Observation]:
    """One finding or more."""
    if settings.backup_to is None:
        yield Observation("backups", Level.WARNING, "the server makes none by itself",
                      "set UNDERSKIN_BACKUP_TO, or see that `underskin backup FILE` runs every day")  # fmt: skip
        return
    try:
        words = foreign(store, settings.backup_to)
    except (DBAPIError, StoreError, StoreMoved, OSError):
        words = ""
        yield Observation("backups", Level.WARNING, f"of which store those in {settings.backup_to} are is unknown",
                          "see to the store first")  # fmt: skip
    if words:
        yield Observation("backups", Level.CRITICAL, f"{words}, and the server makes none there",
                          "set UNDERSKIN_BACKUP_TO to a folder of its own; if it is this store after all, "
                          f"delete {settings.backup_to / OWNER}")  # fmt: skip
        return
    yield from open_to_others("backups", [settings.backup_to])
    ahead = [copy for copy in stored_backups(settings.backup_to) if copy.age_s < -SKEW_S]
    if ahead:
        yield Observation("backups", Level.WARNING, f"{ahead[0].path.name} is dated ahead of this machine's clock",
                      "set the clock, and rename or delete what a wrong one dated")  # fmt: skip
    last = newest(settings.backup_to)
    if last is None:
        yield Observation("backups", Level.CRITICAL, f"there is none in {settings.backup_to}",
                      "see that its disk is mounted and a server runs; its log says why it makes none")  # fmt: skip
        return
    hours = last.age_s / 3600
    if hours > 2 * settings.backup_every:
        yield Observation("backups", Level.CRITICAL, f"the newest, {last.path.name}, is {hours:.0f} hours old",
                      "see that the server runs; its log says why none can be made")  # fmt: skip
        return
    try:
        backup.verify(store, last.path)
    except (StoreError, OSError) as error:
        yield Observation("backups", Level.CRITICAL, str(error),
                      "see that it is of this store and its disk is sound; then `underskin backup FILE`")  # fmt: skip
        return
    if (count := len(stored_backups(settings.backup_to))) > settings.backup_keep + 1:
        yield Observation("backups", Level.WARNING, f"{count} are kept, more than UNDERSKIN_BACKUP_KEEP = "
                          f"{settings.backup_keep}: none is deleted while the newest is far smaller than the largest",
                          "see whether the store lacks anything; if not, delete the larger ones")  # fmt: skip
    addition = ", on the disk of the store itself" if _on_one_disk(settings.data, settings.backup_to) else ""
    yield Observation("backups", Level.OK, f"{last.path.name}, {hours:.1f} hours old, read whole{addition}")


def _on_one_disk(*folders: Path) -> bool:
    return len({folder.stat().st_dev for folder in folders if folder.is_dir()}) == 1

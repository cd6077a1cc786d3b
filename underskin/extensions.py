"""Extensions of other installed packages through an entry-point group: mechanisms, file formats."""

from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from underskin.errors import ExtensionError


@dataclass(frozen=True)
class Extension:
    """The object that one entry point names, and its package with version."""

    package: str
    name: str
    value: Any

    def refused(self, field: str, reason: str, name: str | None = None) -> ExtensionError:
        """The error that says why it cannot be used; `name` where it differs from the entry point's."""
        return ExtensionError(self.package, name or self.name, field, reason)


def load(group: str) -> list[Extension]:
    """The extensions of a group, by package and name.

    Raises
    ------
    ExtensionError
        Where an entry point cannot be imported.
    """
    return sorted(map(_loaded, entry_points(group=group)), key=lambda extension: (extension.package, extension.name))


def _loaded(entry_point: EntryPoint) -> Extension:
    package = (
        "a package without a name"
        if entry_point.dist is None
        else f"{entry_point.dist.name} {entry_point.dist.version}"
    )
    try:
        return Extension(package, entry_point.name, entry_point.load())
    except Exception as error:  # it may do anything when it is imported
        raise ExtensionError(
            package, entry_point.name, f"the entry point {entry_point.value}", described(error)
        ) from error


def described(error: Exception) -> str:
    """An error of another package's code in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"

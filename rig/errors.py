"""The exception of the rig."""

from typing import Any


class RigError(ValueError):
    """A value of an experiment that the rig cannot use: its `field`, the `value` and what is `allowed`."""

    def __init__(self, field: str, value: Any, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} = {value!r}: {allowed}")

"""Exceptions of the store."""


class StoreError(Exception):
    """The store cannot be used; the message says why and what to do."""


class Missing(LookupError):
    """There is no such campaign, recording or skin."""


class Conflict(ValueError):
    """The request does not fit the state of the stored data."""


class StoreMoved(Exception):
    """The disk has other files under the store's names than the open ones; nothing is stored there."""

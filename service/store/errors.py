"""What the store raises."""


class StoreError(Exception):
    """The store cannot be used; the message says why and what to do."""


class Missing(LookupError):
    """There is no such campaign, recording or skin."""


class Conflict(ValueError):
    """What was asked does not fit the state of what is kept."""


class StoreMoved(Exception):
    """The disk has other files under the store's names than those that are open; nothing is kept there."""

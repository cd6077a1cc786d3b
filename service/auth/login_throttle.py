"""How often an address may try a key on the login page: a few at once, then one every few seconds."""

import threading
import time
from collections import OrderedDict

AT_ONCE, SECONDS = 10, 6.0  # tries that fail at once, and the seconds until one more is free
_MOST_ADDRESSES = 10_000  # remembered; the one that was not heard of for the longest is forgotten first


class LoginThrottle:
    """Failed tries by address, each of which is forgotten after a while. For any number of threads."""

    def __init__(self) -> None:
        """Nobody has failed yet."""
        self._lock = threading.Lock()
        self._used: OrderedDict[str, tuple[float, float]] = OrderedDict()  # tries that count still, and when they did

    def wait_s(self, address: str) -> float:
        """Seconds until this address may try again; 0 where it may."""
        with self._lock:
            return max(0.0, (self._counting(address) - AT_ONCE + 1) * SECONDS)

    def failed(self, address: str) -> None:
        """Count a key that was wrong."""
        with self._lock:
            self._used[address] = self._counting(address) + 1, time.monotonic()
            self._used.move_to_end(address)
            while len(self._used) > _MOST_ADDRESSES:
                self._used.popitem(last=False)

    def _counting(self, address: str) -> float:
        tries, at = self._used.get(address, (0.0, 0.0))
        return max(0.0, tries - (time.monotonic() - at) / SECONDS)

"""Rate limit of login attempts by the client's address, also behind a proxy: a few at once, then one every few
seconds."""

import ipaddress
import threading
import time
from collections import OrderedDict
from collections.abc import Sequence
from typing import TypeAlias

from starlette.requests import Request

_Address: TypeAlias = ipaddress.IPv4Address | ipaddress.IPv6Address
_Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network
_IPV6_PREFIX = 64  # one subscriber has all the addresses of such a network
AT_ONCE, SECONDS = 10, 6.0  # tries at once, and the seconds until one more is free
_MOST_ADDRESSES = 10_000  # remembered; the one that was not heard of for the longest is forgotten first


def client_address(request: Request, proxies: Sequence[_Network] = ()) -> str:
    """The peer's address; for a peer on this machine or in one of `proxies`, the last address in `X-Forwarded-For`,
    which that proxy has set."""
    peer = request.client.host if request.client else ""
    address = _parsed(peer)
    if address is not None and (address.is_loopback or any(address in network for network in proxies)):
        forwarded = _parsed(request.headers.get("x-forwarded-for", "").rpartition(",")[2].strip())
        address = address if forwarded is None else forwarded
    return peer if address is None else str(address)


def network_of(address: str) -> str:
    """The key by which login attempts are counted: the address, for IPv6 its /64 network."""
    parsed = _parsed(address)
    if parsed is None or parsed.version == 4:
        return str(parsed or address)
    return str(ipaddress.ip_network((int(parsed), _IPV6_PREFIX), strict=False))


def _parsed(text: str) -> _Address | None:
    """An IP address, None if invalid; an IPv4-mapped IPv6 address (`::ffff:192.0.2.7`) gives the IPv4 address."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return None
    return (address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None) or address


class LoginThrottle:
    """Failed and pending attempts by address, each forgotten after a while. Thread-safe."""

    def __init__(self) -> None:
        """Without failed attempts."""
        self._lock = threading.Lock()
        self._used: OrderedDict[str, tuple[float, float]] = OrderedDict()  # tries that count still, and when they did

    def begin(self, address: str) -> float:
        """Count an attempt and return 0, or return the seconds until this address may try again."""
        with self._lock:
            counting = self._counting(address)
            if counting + 1 > AT_ONCE:
                return (counting + 1 - AT_ONCE) * SECONDS
            self._count(address, counting + 1)
            return 0.0

    def succeeded(self, address: str) -> None:
        """Forget an attempt: the key was right."""
        with self._lock:
            self._count(address, max(0.0, self._counting(address) - 1))

    def _count(self, address: str, tries: float) -> None:
        self._used[address] = tries, time.monotonic()
        self._used.move_to_end(address)
        while len(self._used) > _MOST_ADDRESSES:
            self._used.popitem(last=False)

    def _counting(self, address: str) -> float:
        tries, at = self._used.get(address, (0.0, 0.0))
        return max(0.0, tries - (time.monotonic() - at) / SECONDS)

"""The client's address, also behind a proxy."""

import ipaddress
from collections.abc import Sequence
from typing import TypeAlias

from starlette.requests import Request

_Address: TypeAlias = ipaddress.IPv4Address | ipaddress.IPv6Address
_Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network
_IPV6_PREFIX = 64  # one subscriber has all the addresses of such a network


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

"""Whose request it is: the address of the client, also where it comes through a proxy."""

import ipaddress
from collections.abc import Sequence
from typing import TypeAlias

from starlette.requests import Request

_Address: TypeAlias = ipaddress.IPv4Address | ipaddress.IPv6Address
_Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network
_IPV6_PREFIX = 64  # one subscriber has all the addresses of such a network


def client_address(request: Request, proxies: Sequence[_Network] = ()) -> str:
    """The peer's address; of a peer on this machine, or in one of `proxies`, the last in `X-Forwarded-For`, which the
    proxy there has set."""
    peer = request.client.host if request.client else ""
    address = _parsed(peer)
    if address is not None and (address.is_loopback or any(address in network for network in proxies)):
        forwarded = _parsed(request.headers.get("x-forwarded-for", "").rpartition(",")[2].strip())
        address = address if forwarded is None else forwarded
    return peer if address is None else str(address)


def network_of(address: str) -> str:
    """What tries are counted by: an address, of IPv6 its network of 64 bits."""
    parsed = _parsed(address)
    if parsed is None or parsed.version == 4:
        return str(parsed or address)
    return str(ipaddress.ip_network((int(parsed), _IPV6_PREFIX), strict=False))


def _parsed(text: str) -> _Address | None:
    """An address; one of IPv4 also where a socket of IPv6 writes it as `::ffff:192.0.2.7`. None where it is none."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return None
    return (address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None) or address

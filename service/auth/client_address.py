"""Whose request it is: the address of the client, also where it comes through a proxy on this machine."""

import ipaddress

from starlette.requests import Request

_IPV6_PREFIX = 64  # one subscriber has all the addresses of such a network


def client_address(request: Request) -> str:
    """The peer's address; of a peer on this machine the last in `X-Forwarded-For`, which the proxy there has set."""
    peer = request.client.host if request.client else ""
    forwarded = request.headers.get("x-forwarded-for", "").rpartition(",")[2].strip()
    try:
        if ipaddress.ip_address(peer).is_loopback:
            return str(ipaddress.ip_address(forwarded))
    except ValueError:
        pass
    return peer


def network_of(address: str) -> str:
    """What tries are counted by: an address, of IPv6 its network of 64 bits."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return address
    if known.version == 4:
        return address
    return str(ipaddress.ip_network((int(known), _IPV6_PREFIX), strict=False))

"""The query string: parameters that a route does not have are refused, and so are those that are given twice."""

from collections.abc import Collection, Iterable, Iterator

from fastapi import Request
from fastapi.dependencies.utils import get_flat_params
from fastapi.params import Cookie, Header, Path
from fastapi.routing import APIRoute

from service.problems import invalid_input, unknown_name
from underskin.errors import InvalidInput, not_unique


async def known_query(request: Request) -> None:
    """For every route under /v1: raises Refusal (422) that names each parameter that is unknown or repeated."""
    if not request.scope["query_string"]:
        return
    errors = list(_errors(request.query_params.multi_items(), _names(request.scope["route"])))
    if errors:
        raise invalid_input(errors)


def _names(route: APIRoute) -> list[str]:
    """The query parameters of a route, as the OpenAPI document has them, which takes half a second to write."""
    others = Path, Header, Cookie  # fields of a model of query parameters say nothing of where they come from
    return [one.alias for one in get_flat_params(route.dependant) if not isinstance(one.field_info, others)]


def _errors(given: Iterable[tuple[str, str]], names: Collection[str]) -> Iterator[InvalidInput]:
    seen: set[str] = set()
    for name, value in given:
        if name not in names:
            yield unknown_name(name, value, names, "query parameter")
        elif name in seen:
            yield not_unique(name, value)
        seen.add(name)

"""The query string: parameters that a route does not have are refused, and so are those that are given twice."""

from collections.abc import Collection, Iterable, Iterator

from fastapi import Request

from service.problems import invalid_input, unknown_name
from service.routes.openapi import query_parameters
from underskin.errors import InvalidInput, not_unique


async def known_query(request: Request) -> None:
    """For every route under /v1: raises Refusal (422) that names each parameter that is unknown or repeated."""
    if not request.scope["query_string"]:
        return
    names = query_parameters(request.app, request.scope["route"].path, request.method)
    errors = list(_errors(request.query_params.multi_items(), names))
    if errors:
        raise invalid_input(errors)


def _errors(given: Iterable[tuple[str, str]], names: Collection[str]) -> Iterator[InvalidInput]:
    seen: set[str] = set()
    for name, value in given:
        if name not in names:
            yield unknown_name(name, value, names, "query parameter")
        elif name in seen:
            yield not_unique(name, value)
        seen.add(name)

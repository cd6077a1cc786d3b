"""Documents that are handed on as they were kept: OpenAPI describes them by a model that does not validate them."""

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, GetJsonSchemaHandler
from pydantic_core.core_schema import CoreSchema, definitions_schema


@dataclass(frozen=True)
class DescribedBy:
    """Annotates a field that holds plain JSON values with the model that describes it."""

    model: type[BaseModel]

    def __get_pydantic_json_schema__(self, _: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The model's schema in place of that of any object."""
        return handler(definitions_schema(self.model.__pydantic_core_schema__, []))  # by reference

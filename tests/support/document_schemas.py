"""JSON Schema of the documents, as the OpenAPI document has it."""

from typing import Any

import jsonschema_rs

from service.schemas.campaign_document import campaign_schemas
from service.schemas.report import Report


def campaign_validator() -> jsonschema_rs.Draft202012Validator:
    """Of `campaign/1`."""
    return jsonschema_rs.Draft202012Validator(
        {"$ref": "#/components/schemas/Campaign", "components": {"schemas": campaign_schemas()}}
    )


def report_validator() -> jsonschema_rs.Draft202012Validator:
    """Of `report/1`, without any field that is not described."""
    return jsonschema_rs.Draft202012Validator(closed(Report.model_json_schema()))


def closed(schema: Any) -> Any:
    """The same schema, with no other properties than those that it names, unless it says that there may be."""
    if isinstance(schema, list):
        return [closed(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    own = {name: closed(entry) for name, entry in schema.items()}
    return {"additionalProperties": False, **own} if "properties" in own else own

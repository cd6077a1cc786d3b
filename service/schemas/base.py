"""What several requests and answers have in common."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic_core.core_schema import CoreSchema, definitions_schema

_Representable = Annotated[float, Field(ge=1e-12, le=1e12)]  # nothing computed of such numbers overflows


class StrictRequest(BaseModel):
    """A request of which every field is known and of its type."""

    model_config = ConfigDict(extra="forbid", strict=True)


class PressedSkin(BaseModel):
    """A skin and a sphere above the centre of a sensor, in lab units."""

    thickness_mm: _Representable = Field(description="Thickness h of the layer over the sensors [mm].", examples=[2.5])
    youngs_modulus_mpa: _Representable = Field(description="Young's modulus E of the layer [MPa].", examples=[16.0])
    sensor_radius_mm: _Representable = Field(description="Radius rT of a sensor [mm].", examples=[1.5])
    indenter_radius_mm: _Representable = Field(description="Radius R of the sphere [mm].", examples=[4.0])
    preload_n: _Representable = Field(description="Force F of the sphere [N].", examples=[1.0])


@dataclass(frozen=True)
class DescribedBy:
    """Annotates a field that holds plain JSON values, which are handed on as they were kept, with the model that
    describes it to OpenAPI without validating it."""

    model: type[BaseModel]

    def __get_pydantic_json_schema__(self, _: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The model's schema in place of that of any object."""
        return handler(definitions_schema(self.model.__pydantic_core_schema__, []))  # by reference

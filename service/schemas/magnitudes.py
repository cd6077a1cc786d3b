"""Magnitudes of single quantities that are computed with."""

from typing import Annotated

from pydantic import Field

Representable = Annotated[float, Field(ge=1e-12, le=1e12)]  # nothing computed of such numbers overflows

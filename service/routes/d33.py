"""d33 of each sensor from its measured FRF."""

from fastapi import APIRouter

from service.routes.columns_endpoint import add_columns_route
from service.routes.frf import EXAMPLE as FRF_EXAMPLE
from service.schemas.d33 import D33Answer, D33Columns
from service.usecases.d33 import d33

router = APIRouter(prefix="/v1", tags=["d33"])

EXAMPLE = {**FRF_EXAMPLE, "frf_pc_per_n": [6.8, 6.9], "frf_uncertainty_pc_per_n": 0.1}
del EXAMPLE["d33_pc_per_n"]

add_columns_route(router, "/d33", "d33 from measured FRF", D33Columns, EXAMPLE, d33, D33Answer)

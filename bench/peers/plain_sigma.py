"""A plain FastAPI route that answers σ in columns by SciPy's spline: plain_sigma.py TABLE PORT."""

import sys

import numpy as np
import orjson
import uvicorn
from fastapi import FastAPI, Request, Response

from bench.peers.spline import read_spline

spline = read_spline(sys.argv[1])
app = FastAPI()


@app.get("/ready")
async def ready() -> str:
    """Answers once the spline is read."""
    return "ready"


@app.post("/sigma")
async def sigma(request: Request) -> Response:
    """σ for each row of equally long columns, inside the table."""
    columns = orjson.loads(await request.body())
    a, rho, load = (np.array(columns[name]) for name in ("a_over_h", "rt_over_h", "load_parameter"))
    answer = {"sigma": spline(np.stack([a, rho, np.cbrt(load)], axis=-1))}
    return Response(orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")


uvicorn.run(app, port=int(sys.argv[2]), loop="uvloop", http="httptools", access_log=False, log_config=None)

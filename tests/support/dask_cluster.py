"""A Dask cluster on this machine, of one worker, for as long as it is used."""

from typing import Any

import pytest


def local_cluster() -> Any:
    """A context manager; its worker has minutes to end, since a machine may be busy."""
    distributed = pytest.importorskip("distributed", reason="the cluster extra is not installed")

    class Nanny(distributed.Nanny):  # type: ignore[misc, name-defined]
        async def close(self, timeout: float = 240, reason: str = "nanny-close") -> Any:  # noqa: ASYNC109 (Dask's own)
            return await super().close(timeout=timeout, reason=reason)

    return distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        worker_class=Nanny,
    )

"""A client that an ordinary generator makes of the OpenAPI document, against a real server."""

import importlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from tests.support.diagnosed import small
from tests.support.lean_reports import BESIDE_SKINS

# In an environment of its own, which `make test` sets up, or wherever it is.
GENERATOR = shutil.which(
    "openapi-python-client", path=os.pathsep.join((f"{sys.prefix}-openapi-client/bin", os.environ["PATH"]))
)
# What it leaves out, as it says itself: bodies and answers that are neither JSON nor forms.
LEFT_OUT = {
    "text/csv", "application/x-npz", "application/x-hdf5", "application/yaml",
    "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "application/vnd.ms-excel.sheet.macroEnabled.12",
}  # fmt: skip
pytestmark = [
    pytest.mark.slow,
    pytest.mark.server,
    pytest.mark.skipif(GENERATOR is None, reason="openapi-python-client is not installed (make test installs it)"),
]


class Generated:
    """The package that was made, and a client of the server."""

    def __init__(self, name: str, url: str) -> None:
        self.name = name
        self.client = importlib.import_module(f"{name}.client").Client(base_url=url)
        self.models = importlib.import_module(f"{name}.models")

    def call(self, operation: str, *arguments: Any, **options: Any) -> Any:
        """What `tag.operation_id` answers."""
        module = importlib.import_module(f"{self.name}.api.{operation}")
        return module.sync(*arguments, client=self.client, **options)


@pytest.fixture(scope="module")
def generated(server_url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Generated]:
    folder = tmp_path_factory.mktemp("generated")
    (folder / "openapi.json").write_bytes(httpx.get(f"{server_url}/openapi.json").content)
    (folder / "config.json").write_text(json.dumps({"post_hooks": []}))
    assert GENERATOR is not None
    options = ["--path", "openapi.json", "--config", "config.json", "--meta", "none", "--output-path", "skin_client"]
    made = subprocess.run([GENERATOR, "generate", *options], cwd=folder, capture_output=True, text=True, check=False)
    said = made.stdout + made.stderr
    assert made.returncode == 0, said
    warnings = [line for line in said.splitlines() if "nsupported" in line or "Cannot" in line]
    assert all(any(name in line for name in LEFT_OUT) for line in warnings), said
    sys.path.insert(0, str(folder))
    try:
        made_client = Generated("skin_client", server_url)
        yield made_client
        made_client.client.get_httpx_client().close()
    finally:
        sys.path.remove(str(folder))


def test_sigma_in_columns_and_at_one_point(generated: Generated) -> None:
    columns = generated.models.SigmaColumns(a_over_h=[0.3, 4.0], rt_over_h=0.6)
    answer = generated.call("sigma.sigma_columns", body=columns)
    assert answer.sigma == [pytest.approx(0.9365, abs=1e-4), None]
    assert [str(entry) for entry in answer.status] == ["ok", "out_of_domain"]
    assert generated.call("sigma.sigma_one", a_over_h=0.3, rt_over_h=0.6).sigma == answer.sigma[0]


def test_frf_and_d33_are_inverse(generated: Generated) -> None:
    pressed = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4.0}
    asked = generated.models.FrfColumns(**pressed, preload_n=[1.0, 2.0], d33_pc_per_n=14.0)
    frf = generated.call("frf.frf_columns", body=asked).frf_pc_per_n
    back = generated.models.D33Columns(**pressed, preload_n=[1.0, 2.0], frf_pc_per_n=frf)
    assert generated.call("d33.d33_columns", body=back).d33_pc_per_n == pytest.approx([14.0, 14.0])


def test_a_refusal_is_a_problem_with_its_fields(generated: Generated) -> None:
    module = importlib.import_module(f"{generated.name}.api.sigma.sigma_columns")
    asked = generated.models.SigmaColumns(a_over_h=[0.3, -1.0], rt_over_h=0.6)
    answer = module.sync_detailed(client=generated.client, body=asked)
    assert answer.status_code == 422
    problem = generated.models.Problem.from_dict(json.loads(answer.content))
    assert [(str(error.code), error.field, error.index) for error in problem.errors] == [
        ("out_of_range", "a_over_h", 1)
    ]


def test_a_campaign_is_sent_read_and_diagnosed(generated: Generated) -> None:
    document = small()
    campaign = generated.models.Campaign.from_dict(document)
    sent = generated.call("campaigns.post_campaigns", body=campaign)
    assert [str(entry.status) for entry in sent.recordings] == ["ok"] * len(document["recordings"])
    assert generated.call("campaigns.campaign", sent.id).skin.thickness_mm == document["skin"]["thickness_mm"]
    assert generated.call("campaigns.campaign_document", sent.id).to_dict() == document
    array = generated.call("campaigns.campaign_d33", sent.id).array
    assert array.d33_low_pc_per_n < array.d33_pc_per_n < array.d33_high_pc_per_n

    fewer = generated.models.AskFor(without=list(BESIDE_SKINS))
    asked = generated.call("diagnoses.diagnose_campaign", sent.id, body=fewer)
    end = time.monotonic() + 240  # a machine may be busy
    while (found := generated.call("diagnoses.diagnosis", asked.id)).state not in ("done", "failed"):
        assert time.monotonic() < end, found
        time.sleep(0.5)
    report = found.report
    assert (str(report.verdict), report.probability) == (str(found.verdict), found.probability)
    assert report.d33.low < array.d33_pc_per_n < report.d33.high
    assert report.fit.after.rmse_percent <= report.fit.before.rmse_percent
    listed = generated.call("diagnoses.diagnoses", campaign=sent.id)
    assert [entry.id for entry in listed.diagnoses] == [asked.id]

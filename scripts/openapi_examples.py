"""Write `service/routes/examples.json`: what a server was asked and answered, for the OpenAPI document.

`python -m scripts.openapi_examples` starts a server over an empty folder, and asks it for every operation in turn; make
and the Dockerfile do.
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import orjson

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of
from rig.recorded import record_lines
from service.routes import campaigns, computed, mechanisms

FILE = Path(__file__).parents[1] / "service" / "routes" / "examples.json"
_EXPERIMENT: dict[str, Any] = {
    "schema": "experiment/1",
    "name": "second day",
    "seed": 4,
    "kind": "frf",
    "skin": {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16,
        "sensor_radius_mm": 1.5,
        "d33_pc_per_n": 14,
        "array": {"columns": 2, "rows": 1, "pitch_mm": 8},
    },
    "design": {"indenters_mm": [4, 10], "preloads_n": [0.5, 1, 2, 4], "dynamic_forces_n": [0.09]},
    "lines": {"low_hz": 5, "high_hz": 800, "count": 12},
    "noise": {"gain": 0.01, "line": 0.005},
    "effects": {"contact_resonance": {"tip_mass_g": 6, "damping": 0.04}},
}
_UNDER_WAY = ("queued", "running")


@dataclass
class Walk:
    """A client of a server, and what it was asked and answered so far, by operation."""

    http: httpx.Client
    examples: dict[str, dict[str, Any]] = field(default_factory=dict)

    def ask(
        self,
        operation: str | None,
        method: str,
        path: str,
        body: Any = None,
        params: dict[str, Any] | None = None,
        **names: str,
    ) -> Any:
        """The answer to a request, which both become the example of `operation`; `names`: those in the path."""
        answer = self.http.request(method, path.format(**names), json=body, params=params)
        if not answer.is_success:
            raise RuntimeError(f"{method} {path}: {answer.status_code} {answer.text}")
        document = answer.json() if answer.headers["content-type"] == "application/json" else None
        if operation is not None:
            request = {} if body is None else {"request": body}
            self.examples[operation] = {"given": {**names, **(params or {})}, **request, "answer": document}
        return document

    def columns(self, operation: str, path: str, body: dict[str, Any]) -> None:
        """As `ask`, with the same answer as CSV."""
        self.ask(operation, "POST", path, body)
        self.examples[operation]["csv"] = self.http.post(path, json=body, headers={"Accept": "text/csv"}).text

    def problem(self, operation: str, path: str, body: Any) -> None:
        """A refusal, as the example of every operation of its kind."""
        answer = self.http.post(path, json=body)
        assert answer.is_client_error, answer.text
        self.examples[operation] = {"answer": answer.json()}


def walk(http: httpx.Client) -> dict[str, dict[str, Any]]:
    """What a server over an empty store is asked and answers, by operation."""
    walked = Walk(http)
    _calculations(walked)
    _mechanisms(walked)
    _umbridge(walked)
    _campaigns(walked)
    _diagnoses(walked)
    return walked.examples


def _calculations(walked: Walk) -> None:
    point = {"a_over_h": 0.3, "rt_over_h": 0.6, "load_parameter": 0.01}
    walked.ask("sigma_one", "GET", "/v1/sigma", params=point)
    csv = walked.http.get("/v1/sigma", params=point, headers={"Accept": "text/csv"})
    walked.examples["sigma_one"]["csv"] = csv.text
    walked.columns("sigma_columns", "/v1/sigma", computed.SIGMA_EXAMPLE)
    walked.columns("frf_columns", "/v1/frf", computed.FRF_EXAMPLE)
    walked.columns("d33_columns", "/v1/d33", computed.D33_EXAMPLE)
    walked.columns("stress", "/v1/stress", computed.STRESS_EXAMPLE)
    walked.ask("field", "GET", "/v1/field", params=computed.FIELD_EXAMPLE)
    walked.ask("design", "POST", "/v1/design", computed.DESIGN_EXAMPLE)
    walked.ask("tables", "GET", "/v1/tables")
    walked.ask("health", "GET", "/health")
    walked.ask("ready", "GET", "/ready")
    counted = [line for line in walked.http.get("/metrics").text.splitlines() if line.startswith("# HELP underskin")]
    walked.examples["metrics"] = {"answer": f"{counted[0]}\n"}
    walked.problem("problem", "/v1/sigma", {**point, "a_over_h": [0.3, -1.0]})


def _mechanisms(walked: Walk) -> None:
    walked.ask("keep_mechanism", "POST", "/v1/mechanisms", mechanisms.EXAMPLE)
    walked.ask("mechanisms", "GET", "/v1/mechanisms")
    answer = walked.examples["mechanisms"]["answer"]
    answer["mechanisms"] = [answer["mechanisms"][0], answer["mechanisms"][-1]]
    walked.ask("discard_mechanism", "DELETE", "/v1/mechanisms/{name}", name=mechanisms.EXAMPLE["name"])


def _umbridge(walked: Walk) -> None:
    model: dict[str, Any] = {"name": "sigma", "config": {}}
    at = {**model, "input": [[0.3, 0.6, 0.01]]}
    derivative = {**at, "outWrt": 0, "inWrt": 0}
    walked.ask("umbridge_info", "GET", "/umbridge/Info")
    walked.ask("umbridge_model_info", "POST", "/umbridge/ModelInfo", model)
    walked.ask("umbridge_input_sizes", "POST", "/umbridge/InputSizes", model)
    walked.ask("umbridge_output_sizes", "POST", "/umbridge/OutputSizes", model)
    walked.ask("umbridge_evaluate", "POST", "/umbridge/Evaluate", at)
    walked.ask("umbridge_gradient", "POST", "/umbridge/Gradient", {**derivative, "sens": [1.0]})
    walked.ask("umbridge_apply_jacobian", "POST", "/umbridge/ApplyJacobian", {**derivative, "vec": [1.0, 0.0, 0.0]})
    walked.problem("umbridge_problem", "/umbridge/ApplyHessian", model)
    walked.examples["umbridge_apply_hessian"] = {"request": model}  # which these models do not support


def _campaigns(walked: Walk) -> None:
    of_campaign = "/v1/campaigns/{campaign_id}"
    sent = walked.ask("post_campaigns", "POST", "/v1/campaigns", campaigns.EXAMPLE)
    second = walked.ask(
        None, "POST", "/v1/campaigns", {**campaigns.EXAMPLE, "name": "another"}, params={"skin": "palm-3b"}
    )
    walked.ask("campaigns", "GET", "/v1/campaigns", params={"skin": sent["skin_id"]})
    walked.ask("campaign_document", "GET", f"{of_campaign}/document", campaign_id=sent["id"])
    walked.ask("campaign_d33", "GET", f"{of_campaign}/d33", campaign_id=sent["id"])
    walked.ask("skins", "GET", "/v1/skins")
    join = {"skin_id": "palm-3b", "reason": "the same skin, under another name"}
    walked.ask("join_skins", "POST", "/v1/skins/{skin_id}/join", join, skin_id=sent["skin_id"])
    walked.ask("skin", "GET", "/v1/skins/{skin_id}", skin_id=sent["skin_id"])
    excluded = {"recording": "r2", "reason": "the cable was loose"}
    walked.ask("exclude_recording", "POST", f"{of_campaign}/exclusions", excluded, campaign_id=sent["id"])
    walked.ask("campaign", "GET", of_campaign, campaign_id=sent["id"])
    walked.ask("skin_history", "GET", "/v1/skins/{skin_id}/history", skin_id=sent["skin_id"])
    withdrawn = {"reason": "recorded with the wrong sphere"}
    walked.ask("withdraw_campaign", "POST", f"{of_campaign}/withdraw", withdrawn, campaign_id=second["id"])
    _annotated(walked, sent["id"], second["skin_id"])


def _annotated(walked: Walk, campaign_id: str, skin_id: str) -> None:
    of_campaign, of_skin = "/v1/campaigns/{campaign_id}", "/v1/skins/{skin_id}"
    campaign = {"name": "palm 3, after the bath", "remark": "wet for a day", "tags": ["wet", "batch 7"]}
    walked.ask("annotate_campaign", "PATCH", of_campaign, campaign, campaign_id=campaign_id)
    skin = {"title": "left palm", "remark": None, "tags": ["silicone"]}
    walked.ask("annotate_skin", "PATCH", of_skin, skin, skin_id=skin_id)
    trial = {**campaigns.EXAMPLE, "name": "a trial"}
    tried = walked.ask(None, "POST", "/v1/campaigns", trial, params={"skin": "trial"})
    reason = {"reason": "a trial"}
    walked.ask("discard_campaign", "POST", f"{of_campaign}/discard", reason, campaign_id=tried["id"])
    walked.ask("discard_skin", "POST", f"{of_skin}/discard", reason, skin_id="trial")
    walked.ask("skin_changes", "GET", f"{of_skin}/changes", skin_id="trial")
    changes = walked.ask("campaign_changes", "GET", f"{of_campaign}/changes", campaign_id=tried["id"])["changes"]
    walked.ask("undo_change", "POST", "/v1/changes/{change_id}/undo", change_id=changes[0]["id"])


def _diagnoses(walked: Walk) -> None:
    recorded = campaign_of(record_lines(experiment(_EXPERIMENT)))
    skins = [f"palm-{number}" for number in (4, 5, 6)]
    sent = [walked.ask(None, "POST", "/v1/campaigns", recorded, params={"skin": skin}) for skin in skins]
    again = {**recorded, "name": "third day", "recordings": recorded["recordings"][::-1]}
    walked.ask(None, "POST", "/v1/campaigns", again, params={"skin": skins[0]})
    walked.ask(
        "diagnose_campaign", "POST", "/v1/campaigns/{campaign_id}/diagnosis", {"without": []}, campaign_id=sent[0]["id"]
    )
    diagnosed = walked.examples["diagnose_campaign"]["answer"]["id"]
    of_diagnosis = {"diagnosis_id": diagnosed}
    while walked.ask("diagnosis", "GET", "/v1/diagnoses/{diagnosis_id}", **of_diagnosis)["state"] in _UNDER_WAY:
        time.sleep(0.1)
    walked.ask("adopt_model", "POST", "/v1/skins/{skin_id}/model", of_diagnosis, skin_id=skins[0])
    walked.ask("skin_model", "GET", "/v1/skins/{skin_id}/model", skin_id=skins[0])
    reason = {"reason": "the tip was changed"}
    walked.ask("withdraw_model", "DELETE", "/v1/skins/{skin_id}/model", params=reason, skin_id=skins[0])
    walked.ask("skin_model_versions", "GET", "/v1/skins/{skin_id}/model/versions", skin_id=skins[0])
    export = walked.http.get(f"/v1/skins/{skins[0]}/export").content
    walked.examples["export_skin"] = {"given": {"skin_id": skins[0]}}
    headers = {"Content-Type": "application/octet-stream"}
    imported = walked.http.post("/v1/skins/import", content=export, headers=headers)
    walked.examples["import_skin"] = {"answer": imported.raise_for_status().json()}
    together: dict[str, Any] = {"campaigns": None, "name": "palm 4 since May", "without": []}
    walked.ask("diagnose_skin", "POST", "/v1/skins/{skin_id}/diagnosis", together, skin_id=skins[0])
    fleet = {"skins": skins, "name": "palms of batch 7", "without": []}
    queued = walked.ask("diagnose_fleet", "POST", "/v1/fleets/diagnosis", fleet)
    walked.ask("cancel_diagnosis", "DELETE", "/v1/diagnoses/{diagnosis_id}", diagnosis_id=queued["id"])
    walked.ask("diagnoses", "GET", "/v1/diagnoses", params={"state": "done"})


@contextmanager
def _server(folder: Path) -> Iterator[httpx.Client]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    # Without the settings of this machine, such as a database.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("UNDERSKIN_")}
    environment |= {"UNDERSKIN_DATA": str(folder), "UNDERSKIN_MECHANISMS": str(folder / "mechanisms")}
    environment["UNDERSKIN_DIAGNOSIS_WORKERS"] = "1"
    command = [sys.executable, "-m", "underskin", "serve", "--port", str(port)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        # Without a proxy that the environment names.
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60, trust_env=False) as http:
            while process.poll() is None:
                try:
                    http.get("/ready").raise_for_status()
                    break
                except httpx.HTTPError:
                    time.sleep(0.1)
            yield http
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder, _server(Path(folder)) as http:
        FILE.write_bytes(orjson.dumps(walk(http), option=orjson.OPT_INDENT_2) + b"\n")

"""The request that returns what a page shows, to copy: for a shell and for Python."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote, urlencode

from fastapi import Request


@dataclass(frozen=True)
class SameRequest:
    """The request as a command of a shell and as Python."""

    curl: str
    python: str


def get(request: Request, path: str, call: str) -> SameRequest:
    """GET `path`; `call` is the same with underskin.Client."""
    return SameRequest(_curl(request, path), _python(request, call))


def post(request: Request, path: str, document: Mapping[str, Any], call: str) -> SameRequest:
    """POST a JSON document."""
    body = shlex.quote(json.dumps(document, ensure_ascii=False))
    return SameRequest(_curl(request, path, f"-H 'Content-Type: application/json' -d {body}"), _python(request, call))


def from_file(request: Request, path: str, file: str, call: str) -> SameRequest:
    """POST a JSON document that is in a file; `call` has {} for the document."""
    curl = _curl(request, path, f"-H 'Content-Type: application/json' -d @{file}")
    python = _python(request, call.format(f"json.loads(pathlib.Path({file!r}).read_text())"))
    return SameRequest(curl, f"import json\nimport pathlib\n{python}")


def files(
    request: Request, labels: Sequence[str], rig: str | None, skin: str, estimator: str | None = None
) -> SameRequest:
    """POST files as a form, with a rig description where they need one."""
    fields = {name: value for name, value in (("skin", skin), ("estimator", estimator)) if value}
    query = "?" + urlencode(fields, quote_via=quote, safe="") if fields else ""
    parts = [f"file=@{label}" for label in labels] + ([] if rig is None else [f"rig=@{rig}"])
    curl = _curl(request, f"/v1/campaigns{query}", *(f"-F {shlex.quote(part)}" for part in parts))
    options = {**fields, **({} if rig is None else {"rig": rig})}
    arguments = [repr(list(labels)), *(f"{name}={value!r}" for name, value in options.items())]
    call = f"client.campaigns.post_files({', '.join(arguments)})"
    return SameRequest(curl, _python(request, call))


def exported_skin(request: Request, label: str) -> SameRequest:
    """POST a file that holds an exported skin."""
    send = f"-H 'Content-Type: application/x-hdf5' --data-binary {shlex.quote('@' + label)}"
    return SameRequest(_curl(request, "/v1/skins/import", send), _python(request, f"client.skins.load({label!r})"))


def planned(request: Request, campaign_id: str, options: Sequence[str], limits: str) -> SameRequest:
    """Fetch a campaign, and plan its next experiment with `options` of the command, `limits` of the library."""
    file = "campaign.json"
    fetch = f"{_curl(request, f'/v1/campaigns/{campaign_id}/document')} -o {file}"
    python = (
        "from underskin import RigLimits, diagnose, read_file\n\n"
        f"report = diagnose(read_file({file!r}, {file!r}), limits=RigLimits({limits}))\n"
        "print(report['next_experiment'])"
    )
    return SameRequest(f"{fetch}\n{shlex.join(['underskin', 'plan', file, *options])}", python)


def _curl(request: Request, path: str, *sent: str) -> str:
    """`sent`: options that send something, each on a line of its own."""
    key = ' -H "Authorization: Bearer $UNDERSKIN_API_KEY"' if request.scope["key"] is not None else ""
    return " \\\n  ".join([f"curl -s {shlex.quote(_origin(request) + path)}{key}", *sent])


def _python(request: Request, call: str) -> str:
    key = ', os.environ["UNDERSKIN_API_KEY"]' if request.scope["key"] is not None else ""
    imports = "import os\n\nimport underskin" if key else "import underskin"
    return f"{imports}\n\nwith underskin.Client({_origin(request)!r}{key}) as client:\n    print({call})"


def _origin(request: Request) -> str:
    """The address by which the browser came."""
    return f"{scheme(request)}://{request.headers['host']}"


def scheme(request: Request) -> str:
    """http or https, as the browser sees it: a proxy with TLS says so in a header."""
    return "https" if request.headers.get("x-forwarded-proto") == "https" else request.url.scheme

"""A preload that is typed once for several files, or was for earlier ones, beside what each file's own force says."""

import html
import io

import httpx
import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from tests.service.pages.forms import BROWSING, token_of
from tests.support.store_server import Server

RATE_HZ, SAMPLES = 1024, 2048


def shaken(static: np.ndarray | float) -> bytes:
    """A shaker about a static force [N], in newtons and picocoulombs."""
    shaking = 0.1 * np.random.default_rng(3).normal(size=SAMPLES)
    timing = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0}
    buffer = io.BytesIO()
    with TdmsWriter(buffer) as writer:
        channels = [
            ChannelObject("press 1", name, values, {**timing, "unit_string": unit})
            for name, values, unit in (("Force", static + shaking, "N"), ("Charge", 7 * shaking, "pC"))
        ]
        writer.write_segment([RootObject({}), GroupObject("press 1", {}), *channels])
    return buffer.getvalue()


RIG = """\
schema: rig/1
kind: frf
skin: {thickness_mm: 2.5, youngs_modulus_mpa: 16, poisson_ratio: 0.5, sensor_radius_mm: 1.5,
       sensors: [{id: s1, x_mm: 0, y_mm: 0}]}
recording: {sensor: s1, indenter_radius_mm: 4, preload_n: 1}
channels: {force_n: {channel: Force}, charge_pc: {channel: Charge}}
"""


def test_stated_preload_held_against_force_file(server: Server) -> None:
    """A stated preload is held against the force of each file."""
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        form = {"form_token": token_of(client.get("/upload").text)}
        files = [("file", (f"{force}.tdms", shaken(force))) for force in (1.0, 2.0)]
        answer = client.post("/upload", data=form, files=[*files, ("rig", ("rig.yaml", RIG))], follow_redirects=True)
    assert "<b>2</b> recordings understood" in answer.text
    assert answer.text.count("as stated, but its force is") == 1
    assert "2.0.tdms: pressed by 1 N as stated, but its force is 2.00 N on average" in html.unescape(answer.text)

"""Broadband noise by the upload page: its dynamic force is measured, and where nothing was excited it says so."""

import numpy as np
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import campaigns_of, file, look_at
from tests.support.cases import first
from tests.support.store_server import Server

RATE_HZ, SAMPLES, EXCITED_HZ, PRELOAD_N = 1000.0, 40_000, (2.8, 200.0), 1.0


def shaken() -> tuple[str, float]:
    """A table of time, force and charge, and √2 times the rms of what shakes it [N]."""
    random = np.random.default_rng(5)
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
    spectrum = random.normal(size=len(frequency)) + 1j * random.normal(size=len(frequency))
    noise = np.fft.irfft(spectrum * ((frequency > EXCITED_HZ[0]) & (frequency < EXCITED_HZ[1])), SAMPLES)
    noise *= 0.05 / np.sqrt(2) / noise.std()
    force = PRELOAD_N + noise + 1e-4 * random.normal(size=SAMPLES)
    charge = 7.0 * (PRELOAD_N + noise) + 1e-2 * random.normal(size=SAMPLES)
    rows = [f"{n / RATE_HZ:.4f},{f:.6f},{q:.6f}" for n, (f, q) in enumerate(zip(force, charge, strict=True))]
    return "\n".join(["Time [s],Force [N],Charge [pC]", *rows]), float(np.sqrt(2) * (force - force.mean()).std())


@pytest.mark.soak
@pytest.mark.parametrize("width", first(1, [390, 1280]))
def test_dynamic_force_noise_measured_not_asked(visitor: Visit, server: Server, width: int) -> None:
    """The dynamic force of noise is measured and not asked for."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 844})
    text, amplitude = shaken()
    skin = f"shaken{width}"
    look_at(visitor, [file("noise.csv", text)], skin=skin)
    for label, value in (
        ("thickness h", "2.5"), ("Young's modulus", "2"), ("sensor radius", "1.5"), ("Layout", "s1, 0, 0"),
        ("sensor that was pressed", "s1"), ("sphere radius", "4"), ("preload F", str(PRELOAD_N)),
    ):  # fmt: skip
        page.get_by_label(label).first.fill(value)
    assert page.get_by_label("dynamic force").first.input_value() == ""
    page.get_by_role("button", name="Read it with these settings").click()
    page.get_by_text("1 recording understood").wait_for()
    told = page.locator(".taken").inner_text()
    assert (
        f"dynamic force, peak [N]: measured: √2 times the rms of the force about its drift, {amplitude:.4g} N" in told
    )
    cells = page.locator("table", has_text="|FRF|, median").locator("tbody td").all_inner_texts()
    assert any(cell.startswith("7.0") for cell in cells), cells  # not of the lines that nothing excited
    visitor.require_accessible()
    page.get_by_role("button", name="Keep").click()
    page.wait_for_url("**/campaigns/*")
    (kept,) = campaigns_of(server, skin)
    (recording,) = server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"]
    assert recording["dynamic_force_n"] == pytest.approx(amplitude, rel=1e-3)
    page.get_by_text("Why this band").click()
    why = page.locator("details", has_text="Why this band").inner_text()
    assert "Hz it was not excited" in why
    assert "falls off" not in why

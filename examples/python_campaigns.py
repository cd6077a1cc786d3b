"""Campaigns from Python: a batch of files, d33 of the array, history. Needs a running service (`make serve`)."""

import os
from pathlib import Path

from rich.progress import track

import underskin

SKIN = "python-palm"
FILES = sorted((Path(__file__).parent / "campaigns").glob("2017-*"))

url = os.environ.get("UNDERSKIN_URL", "http://127.0.0.1:8000")
with underskin.Client(url, api_key=os.environ.get("UNDERSKIN_API_KEY")) as client:
    for file in track(FILES, description="sending"):
        # Under an Idempotency-Key of your own, a file that is sent twice is kept once.
        for kept in client.campaigns.post_files([file], skin=SKIN, idempotency_key=f"{SKIN} {file.name}"):
            good = [recording for recording in kept.recordings if recording.status == "ok"]
            print(f"{kept.file}: {len(good)} of {len(kept.recordings)} recordings kept")
            for recording in kept.recordings:
                for error in recording.errors:
                    print(f"  {recording.id}: {error.field} = {error.value}: {error.allowed}")

    latest = next(client.campaigns.all(skin=SKIN))
    answer = client.campaigns.d33(latest.id)
    if answer.array is not None:
        print(f"{latest.name}: d33 {answer.array.d33_pc_per_n:.2f} ± {answer.array.d33_uncertainty_pc_per_n:.2f} pC/N")
    for sensor in answer.sensors:
        print(f"  {sensor.sensor}: {sensor.d33_pc_per_n:.2f} ± {sensor.d33_uncertainty_pc_per_n:.2f} pC/N")

    for history in client.skins.history(SKIN).sensors:
        if (trend := history.trend) is not None:
            significant = "a trend" if trend.significant else "no significant trend"
            print(f"{history.sensor}: {trend.slope_pc_per_n_per_year:+.1f} pC/N a year, {significant}")

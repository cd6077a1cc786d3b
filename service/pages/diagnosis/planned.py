"""Planned recordings on pages: the conditions of each, how many have arrived, its rig description."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml
from fastapi import Response

from service.pages.shared.figures import attachment
from service.problems import Refusal
from service.store import AnyRow, Database, campaigns
from service.usecases import planned_recordings
from underskin.diagnosis.reporting.wording import axis

_HEADS = {
    "indenter_radius_mm": "sphere radius [mm]", "position_mm": "place x, y [mm]", "dwell_s": "hold [s]",
}  # fmt: skip


@dataclass(frozen=True)
class PlannedRow:
    """A planned recording: its conditions by field, the number of repeats, and how many have arrived."""

    values: Mapping[str, Any]
    repeats: int
    arrived: int

    @property
    def complete(self) -> bool:
        """Whether all have arrived."""
        return self.arrived >= self.repeats


def planned_rows(store: Database, row: AnyRow, plan: Mapping[str, Any] | None) -> list[PlannedRow]:
    """Those of a plan after the diagnosis `row`."""
    entries = (plan or {}).get("recordings", [])
    counts = store.read(planned_recordings.arrived, row, entries)
    return [
        PlannedRow(
            {name: value for name, value in planned.items() if name != "repeats" and value != []},
            planned["repeats"],
            count,
        )
        for planned, count in zip(entries, counts, strict=True)
    ]


def heads(rows: Sequence[PlannedRow]) -> dict[str, str]:
    """The table headings of the conditions."""
    return {name: _HEADS.get(name) or axis(name) for row in rows for name in row.values}


def rig_answer(store: Database, row: AnyRow, rows: Sequence[PlannedRow], number: int) -> Response:
    """The rig description of the planned recording `number`, counted from 1, with which its file can be sent."""
    if number > len(rows):
        raise Refusal(404, f"The plan has {len(rows)} recordings.")
    with store.reading() as connection:
        campaign = campaigns.find(connection, row.campaign_id)
        document = planned_recordings.rig_description(connection, campaign, rows[number - 1].values)
    content = yaml.safe_dump(document, sort_keys=False, allow_unicode=True)
    return attachment(f"rig-{number}.yaml", content, "application/yaml")

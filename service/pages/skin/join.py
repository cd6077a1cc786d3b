"""Two ids that turned out to mean one skin."""

from urllib.parse import quote

from fastapi import APIRouter, Response

from service.dependencies import WRITE, SkinId, Store
from service.pages.shared.forms import Form, see
from service.problems import validated
from service.schemas.skins import Join
from service.usecases import skins

router = APIRouter()


@router.post("/skins/{skin_id}/join", dependencies=WRITE)
def join(skin_id: SkinId, sent: Form, store: Store) -> Response:
    """Count the other as this one from now on."""
    asked = validated(Join, {"skin_id": sent.get("other", "").strip(), "reason": sent.get("reason", "")})
    skins.join(store, skin_id, asked.skin_id, asked.reason)
    return see(f"/skins/{quote(skin_id, safe='')}")

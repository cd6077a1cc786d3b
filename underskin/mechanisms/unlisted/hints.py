"""Which physics usually causes an unlisted law, by the quantity that it acts on and the axis that it follows.

docs/unlisted.md has the same table.
"""

from collections.abc import Mapping

from underskin.mechanisms.base import Kind

_ANY = ""
TURNED = "time_s, on the way back"
CONSTANT_PHASE = "frequency_hz, the same angle"
_HINTS: Mapping[str, Mapping[str, str]] = {
    "modulus": {
        "recorded_at": "A skin that warms up, cures on or swells would do this; note its temperature.",
        "time_of_day": "The temperature of the room would do this; at equal temperature it should vanish.",
        "order": "A skin that warms up or softens with use would do this; repeat in another order.",
        "previous_preload_n": "Softening by the press before (Mullins' effect) would do this; wait longer between "
        "recordings, or come to each preload from the same one.",
        "load_cycles": "Fatigue or Mullins' effect would do this.",
        "dwell_s": "Relaxation that the known creep does not follow would do this.",
        "x_mm": "Uneven mixing or curing along x would do this.",
        "y_mm": "Uneven mixing or curing along y would do this.",
        "preload_n": "Stiffening or softening by another exponent than the known law's would do this.",
        "displacement_mm": "A body that is not the same at all depths, or another law of stress and strain than the "
        "known one, would do this; press with a sphere of another radius.",
        "time_s": "Relaxation that the known creep does not follow would do this, or a body that dries; hold longer, "
        "and at two speeds.",
        TURNED: "A body that softens as it is pressed, or friction that turns with the sphere, would do this; press "
        "again at the same place.",
    },
    "thickness": {
        "recorded_at": "Swelling or shrinking would do this; measure the thickness again.",
        "order": "Swelling, shrinking or a skin that is replaced would do this.",
        "x_mm": "A mould that is not level gives a wedge along x; measure the thickness at both ends.",
        "y_mm": "A mould that is not level gives a wedge along y; measure the thickness at both ends.",
    },
    "contact_radius": {
        "preload_n": "A contact that grows with another power of the force than Hertz's would do this: roughness, a "
        "worn sphere.",
        "order": "A sphere that was changed, worn or dirty from then on would do this; look at it.",
        "recorded_at": "A sphere that was changed or wears would do this; look at it.",
    },
    "force": {
        "preload_n": "Friction in the guide takes a constant part of the force; a cell below the skin would show it.",
        "previous_preload_n": "Friction or hysteresis of the stage would do this; come to each preload from the same "
        "side.",
        "recorded_at": "A cell whose zero drifts would do this; set it to zero before each recording.",
        "time_of_day": "A cell whose zero follows the temperature would do this.",
        "order": "A cell whose zero drifts would do this; set it to zero before each recording.",
        "time_s": "A cell whose zero drifts otherwise than straight would do this; record longer in the air, before "
        "and after.",
        "displacement_mm": "Something that touches on the way, or a screw with a periodic error, would do this; record "
        "in the air.",
        TURNED: "Friction in the guide would do this; move through the air and back.",
    },
    "gain": {
        "recorded_at": "An amplifier that drifts, or d33 that follows the temperature, would do this; repeat the first "
        "recording at the end.",
        "time_of_day": "Temperature or humidity of the room would do this; at equal temperature it should vanish.",
        "order": "An amplifier or a plug that was changed on the way would do this; repeat the first recording.",
        "previous_preload_n": "A film that remembers the press before would do this; wait longer in between.",
        "x_mm": "A film that was drawn or poled unevenly along x would do this.",
        "y_mm": "A film that was drawn or poled unevenly along y would do this.",
        "dynamic_force_n": "A film or an amplifier that is not linear in the force would do this.",
        "preload_n": "A film whose d33 depends on the stress otherwise than the known law has it would do this.",
        "load_cycles": "Ageing by another law than the known one would do this.",
        "force_n": "A cell or a cantilever that is not linear would do this; calibrate it at several forces.",
    },
    "position": {
        "order": "A stage that loses steps or runs round would do this; return to its zero now and then.",
        "recorded_at": "A frame that creeps or warms up would do this.",
        "time_of_day": "A frame that follows the temperature would do this.",
        "previous_preload_n": "Play of the stage would do this; come to each place from the same side.",
        "displacement_mm": "A surface that is rough or dirty, a tip that is no sphere, or an encoder with a periodic "
        "error would do this; look at the tip, and press elsewhere.",
        "time_s": "A frame that warms up or creeps, or a surface that does not come back, would do this; press a stiff "
        "block in its place.",
        TURNED: "Play of the stage, or a surface that does not come back, would do this; press a stiff block.",
    },
    "frequency_response": {
        "frequency_hz": "A resonance of the frame, an electronic filter or a cable would do this; record a stiff steel "
        "block in place of the skin.",
        CONSTANT_PHASE: "The reference phase of a lock-in amplifier, or a sensor's loss angle, would do this; record a "
        "stiff steel block in place of the skin.",
        "dynamic_force_n": "Friction that grows with the amplitude would do this; record at several dynamic forces.",
        "preload_n": "Losses in the contact that grow with the preload would do this.",
        "recorded_at": "A clock or filter that drifts would do this.",
        _ANY: "Electronics or a frame that follow this axis would do this.",
    },
}
_OF_BLOCKS: Mapping[str, Mapping[str, str]] = {  # instead, where a sample is compressed or pulled
    "modulus": {
        "displacement_mm": "Another law of stress and strain than the known one, or a sample that slips in its grips "
        "or at its platens, would do this; measure the strain on the sample itself.",
        "force_n": "Another law of stress and strain than the known one, or a sample that slips in its grips or at its "
        "platens, would do this; measure the strain on the sample itself.",
        TURNED: "A sample that softens as it is strained, or friction at its platens, would do this; repeat the cycle.",
    },
    "position": {
        "displacement_mm": "Ends that are not even, grips that slip, or an encoder with a periodic error would do "
        "this; measure the strain on the sample itself.",
        TURNED: "Play of the machine, or a sample that does not come back, would do this; compress a stiff block.",
    },
}


def hint(acts_on: str, axis: str, kind: Kind) -> str:
    """The physics that usually causes such a law, as a sentence; empty where none is known."""
    of_kind = {"compression": _OF_BLOCKS}.get(kind, {})
    hints = {**_HINTS.get(acts_on, {}), **of_kind.get(acts_on, {})}
    return hints.get(axis, hints.get(_ANY, ""))

"""Fields of a rig description in the words of a lab, with their units."""

KINDS = {
    "frf": "FRF: charge against a shaken force",
    "indentation": "indentation: force against depth",
    "compression": "compression or tension of a sample of the elastomer",
    "tension": "tension of a strip or a rod, pull positive",
}
# Field, words, unit, and the kinds that have it.
SKIN = (
    ("thickness_mm", "thickness h", "mm"),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa"),
    ("poisson_ratio", "Poisson's ratio ν", ""),
    ("sensor_radius_mm", "sensor radius rT", "mm"),
)
RECORDING = (
    ("sensor", "sensor that was pressed", "", ("frf", "indentation")),
    ("indenter_radius_mm", "sphere radius R", "mm", ("frf", "indentation")),
    ("preload_n", "preload F", "N", ("frf",)),
    ("dynamic_force_n", "dynamic force, peak", "N", ("frf",)),
    ("sample_rate_hz", "sample rate, if the file does not say", "Hz", ("frf",)),
    ("stage_stiffness_n_per_mm", "spring's stiffness, if a formula subtracts it", "N/mm", ("indentation",)),
    ("sample_height_mm", "sample's height", "mm", ("compression",)),
    ("sample_length_mm", "strip's free length", "mm", ("tension",)),
    ("sample_width_mm", "strip's width", "mm", ("tension",)),
    ("sample_thickness_mm", "strip's thickness", "mm", ("tension",)),
    ("sample_diameter_mm", "sample's diameter", "mm", ("compression", "tension")),
    ("recorded_at", "date and time of recording", "", ("frf", "indentation", "compression", "tension")),
)
CHANNELS = {
    "force_n": "force",
    "charge_pc": "charge",
    "displacement_mm": "displacement",
    "time_s": "time",
    "frequency_hz": "frequency",
    "frf_re_pc_per_n": "FRF, real part",
    "frf_im_pc_per_n": "FRF, imaginary part",
    "frf_pc_per_n": "FRF, complex numbers",
    "frf_magnitude_pc_per_n": "FRF, magnitude",
    "frf_phase_deg": "FRF, phase",
    "coherence": "coherence γ²",
}  # possible roles of a channel, for either kind

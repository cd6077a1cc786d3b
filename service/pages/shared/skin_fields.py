"""The skin's fields that several forms ask for."""

# Field, words, unit.
FIELDS = (
    ("thickness_mm", "thickness h", "mm"),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa"),
    ("sensor_radius_mm", "sensor radius rT", "mm"),
    ("d33_pc_per_n", "d33", "pC/N"),
    ("poisson_ratio", "Poisson's ratio ν", ""),
)
UNITS = "units_checked"

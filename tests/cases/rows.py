"""The rows of the shared cases (`README.md` there): what each command must say.

A row is the folder, what follows the command's name, and what is right for `d33` and for `diagnose` (None where that
command is not asked).
"""

from tests.cases.outcomes import Right

REVERSE = "revers|counted negative|turned round|wrong sign"
SPHERE = "no sphere|not a sphere|blunt|flat|cone|misses by"
DEEP = "times the declared radius"
SATURATED = "saturat|clip|overload|at the end of its range"
DEAD = "dead|no charge beyond"

Row = tuple[str, str, Right | None, Right | None]


def _named(*names: str, value: float = 1.0, within: float = 0.02, says: str = "", never: str = "") -> Right:
    return Right(value, within, verdicts=("explained",), names=names, says=says, never=never)


def _nothing(value: float = 1.0, within: float = 0.02, says: str = "", never: str = "") -> Right:
    return Right(value, within, verdicts=("no_mismatch",), names=(), says=says, never=never)


def _by_rig(name: str, ending: str = "csv") -> str:
    return f"{name}.{ending} --rig {name}.yaml"


ONE = Right(1.0)
CURVES: list[Row] = [
    ("curves", "wrong_sign.json", Right(1.0, or_none=True, says="sign|revers|counted"), Right(1.0, or_none=True)),
    ("curves", "lift_before_press.csv --rig lift.yaml", Right(1.0, never=REVERSE), _nothing(never=REVERSE)),
    ("curves", "lift_before_press.csv --rig lift_auto.yaml", Right(1.0, never=REVERSE), _nothing(never=REVERSE)),
    ("curves", "lift_from_preload.csv --rig lift.yaml", Right(1.0, never=REVERSE), _nothing(never=REVERSE)),
    ("curves", "lift_from_preload.csv --rig lift_auto.yaml", Right(1.0, never=REVERSE), _nothing(never=REVERSE)),
    ("curves", _by_rig("reversed_rows"), Right(1.0, never=REVERSE), _nothing(never=REVERSE)),
    ("curves", _by_rig("layer_exact"), ONE, Right(1.0, 0.02, never="strain stiffening.*explain")),
    ("curves", _by_rig("layer_exact_deeper"), ONE, Right(1.0, 0.02)),
    ("curves", _by_rig("layer_exact_unknown"), None, Right(says="layer", verdicts=("ambiguous", "unexplained"))),
    ("curves", _by_rig("punch"), Right(none=True, says=SPHERE), Right(none=True, says=SPHERE)),
    ("curves", _by_rig("punch_in"), Right(none=True, says=SPHERE), Right(none=True, says=SPHERE)),
    ("curves", _by_rig("punch_in_thick"), Right(none=True, says=SPHERE), Right(none=True, says=SPHERE)),
    ("curves", _by_rig("cone"), Right(none=True, says=DEEP), Right(none=True, says=DEEP)),
    ("curves", _by_rig("deep"), Right(1.0, or_none=True, says="depth|deep"), Right(1.0, 0.03)),
    ("curves", _by_rig("clipped"), Right(1.0, says=SATURATED), Right(1.0, says=SATURATED, never="rough|encoder")),
    ("curves", _by_rig("clipped_in"), Right(1.0, says=SATURATED), Right(1.0, says=SATURATED, never="rough|encoder")),
    ("curves", _by_rig("interference"), Right(1.0, 0.05), Right(1.0, 0.05, says=r"0\.045|45.? µm")),
    ("curves", _by_rig("ting_two"), None, _named("contact_creep", within=0.05)),
    ("curves", _by_rig("tension_few_points"), ONE, Right(1.0, 0.05, never="sphere")),
    ("curves", _by_rig("tension_and_compression"), ONE, Right(1.0, 0.05)),
    ("curves", _by_rig("side_by_side"), Right(0.005), None),
    ("curves", "side_by_side.csv --rig side_by_side_joined.yaml", Right(0.005), None),
    ("curves", _by_rig("helper_columns", "xlsx"), ONE, _nothing(never="does not describe")),
    ("curves", _by_rig("headings_without_units", "txt"), Right(0.5), None),
    ("curves", _by_rig("comma_property"), Right(0.05), None),
]
PASSING: list[Row] = [
    ("curves/passing", _by_rig("hertz"), ONE, _nothing()),
    ("curves/passing", _by_rig("tilt"), Right(1.0, 0.03), _nothing()),
    ("curves/passing", _by_rig("preload"), Right(1.0), _nothing()),
    ("curves/passing", _by_rig("preload_tared"), Right(1.0, 0.1), _nothing()),
    ("curves/passing", _by_rig("jkr"), Right(1.0), _named("adhesion", within=0.03)),
    ("curves/passing", _by_rig("prony30"), Right(1.0), _named("contact_creep")),
    ("curves/passing", _by_rig("prony75"), Right(1.0), _named("contact_creep")),
    ("curves/passing", _by_rig("ting_one"), None, _named("contact_creep", within=0.05)),
    ("curves/passing", _by_rig("bioindenter", "txt"), Right(0.6225, 0.06), _named("contact_creep", value=0.6225)),
    ("curves/passing", _by_rig("cycles"), None, _named("contact_creep", value=0.1, within=0.05)),
    ("curves/passing", _by_rig("cycles_rising"), None, _nothing()),
    ("curves/passing", _by_rig("cycles_sphere_elastic"), None, _nothing()),
    ("curves/passing", "instron_us.csv --rig instron_us.yaml", Right(0.9), None),
    ("curves/passing", "mts_us.csv --rig instron_us.yaml", Right(0.9), None),
    ("curves/passing", _by_rig("stress_strain"), Right(0.9), None),
    ("curves/passing", _by_rig("tension_neohooke"), None, Right(1.0)),
]
D33 = Right(14.0, 0.05, never=rf"\bnC\b|{DEAD}")
LATE = r"conjugat|\bnC\b|dead"
FRF: list[Row] = [
    ("frf", "control.json", Right(14.0, 0.02), Right(14.0, 0.02, verdicts=("no_mismatch",), names=())),
    ("frf", "force-noise-3-percent.json", D33, Right(14.0, 0.05, names=(), never=r"\bnC\b")),
    (
        "frf",
        "force-noise-10-percent.json",
        Right(14.0, 0.11, never=r"\bnC\b"),
        Right(14.0, 0.11, names=(), never=r"\bnC\b"),
    ),
    (
        "frf",
        "high-pass-150-hz.json",
        Right(14.0, 0.5, says="behind a high.pass.*not to be quoted"),
        Right(14.0, names=("amplifier_high_pass",)),
    ),
    (
        "frf",
        "low-pass-100-hz.json",
        Right(14.0, 0.1, says="behind a low.pass.*not to be quoted"),
        Right(14.0, names=("amplifier_low_pass",)),
    ),
    (
        "frf",
        "force-lags-3-ms.json",
        D33,
        Right(14.0, names=("timing_delay",), parameter=("delay", -3300, -2700), never=LATE),
    ),
    (
        "frf",
        "charge-lags-5-ms.json",
        D33,
        Right(14.0, names=("timing_delay",), parameter=("delay", 4500, 5500), never=LATE),
    ),
    (
        "frf",
        "charge-lags-20-ms.json",
        D33,
        Right(14.0, names=("timing_delay",), parameter=("delay", 18000, 22000), never=LATE),
    ),
    ("frf", _by_rig("tdms-starts-40-ms-apart", "tdms"), Right(14.0, or_none=True), None),
    ("frf", _by_rig("lvm-multi-columns", "lvm"), Right(14.0), None),
    ("frf", "lvm-multi-columns.lvm --rig lvm-multi-columns-rate.yaml", Right(14.0), None),
    ("frf", _by_rig("scope-keysight"), Right(14.0), None),
    ("frf", _by_rig("scope-tektronix"), Right(14.0), None),
    ("frf", _by_rig("scope-rigol-sequence"), Right(14.0), None),
    ("frf", _by_rig("scope-picoscope-overload"), Right(14.0, says="overload.*left out"), None),
    ("frf", _by_rig("time-six-decimals"), Right(14.0), None),
    ("frf", _by_rig("microcontroller-jitter"), Right(14.0, 0.06, says="interpolated"), None),
    ("frf", _by_rig("frf-testlab", "txt"), Right(14.0), None),
    ("frf", _by_rig("frf-complex-numbers"), Right(14.0), None),
    ("frf", _by_rig("coherence-in-percent"), Right(14.0), None),
    ("frf", "frf-swept-down.csv --rig frf-real-imag.yaml", Right(14.0, says="sorted"), None),
    ("frf", "frf-three-readings-each.csv --rig frf-real-imag.yaml", Right(14.0, says="averaged"), None),
    ("frf", _by_rig("lvm-unit-words", "lvm"), Right(14.0), None),
    ("frf", _by_rig("tdms-volts", "tdms"), Right(14.0), None),
    ("frf", _by_rig("frf-in-volts-per-newton"), Right(14.0), None),
    ("frf", "frf-in-volts-per-newton.csv --rig frf-in-volts-per-newton-formula.yaml", Right(14.0), None),
    ("frf", "matlab-testlab-structures.mat --rig matlab-any.yaml", Right(14.0), None),
    ("frf", _by_rig("frf-in-decibels"), Right(14.0, or_none=True), None),
    ("frf", _by_rig("force-in-lbs-ac-coupled"), Right(14.0, or_none=True), None),
    ("frf", "blows-force-window.csv --rig blows.yaml", Right(14.0), None),
    ("frf", "blows-force-noise.csv --rig blows.yaml", Right(14.0, 0.2, says="noise|H2"), None),
    ("frf", "blows-force-noise.csv --rig blows.yaml --estimator H2", Right(14.0, says="its bias by noise"), None),
]
MAY = "glove7_may_tpl.xlsx"
LAB: list[Row] = [
    (
        "lab",
        f"{MAY} glove7_sep_tpl.csv --together glove-7",
        None,
        Right(verdicts=("ambiguous",), says="s06.*(dead|no charge)|dead.*s06"),
    ),
    ("lab", f"{MAY} sep_dead_4.csv --together glove-7", None, Right(verdicts=("ambiguous",), says="s06")),
    ("lab", f"{MAY} sep_dead_5.csv --together glove-7", None, Right(verdicts=("ambiguous",), says="s06")),
    ("lab", f"{MAY} sep_dead_6.csv --together glove-7", None, Right(verdicts=("ambiguous",), says="s06")),
    ("lab", f"{MAY} glove7_sep_alive_tpl.csv --together glove-7", None, Right(says="s03")),
    (
        "lab",
        "examples/campaigns/2017-05.csv 2017-06-s03dead.csv --together palm-3",
        None,
        Right(verdicts=("no_mismatch",), says="s03 is dead since"),
    ),
    ("lab", "glove7_sep_tpl.csv", Right(16.46, 0.02, says="s06"), Right(verdicts=("ambiguous",), says="s06")),
    ("lab", MAY, Right(16.72, 0.02), Right(verdicts=("ambiguous",), never="No known mechanism|poled along")),
    ("lab", "indent_pdms.txt --rig indent.yaml", Right(1.2, 0.05), _named("adhesion", value=1.2, within=0.03)),
    ("lab", "indent_N.txt --rig indent.yaml", Right(says="mN"), Right(says="mN", never="record what")),
    (
        "lab",
        "indent_swapped.txt --rig indent.yaml",
        Right(none=True, says="exchang|swap"),
        Right(none=True, says="exchang|swap", never="drift"),
    ),
    ("lab", "bad/swapped.csv", Right(none=True, says="exchang|swap"), None),
    ("lab", _by_rig("block0"), Right(1.6, 0.05), None),
    ("lab", _by_rig("wide"), Right(16.72, 0.01), None),
    ("lab", "glove7_may.xlsx --rig long_table.yaml", Right(16.72, 0.01), None),
    ("lab", "glove7_sep.csv --rig long_table.yaml", Right(16.46, 0.01, says="s06.*dead"), None),
    ("lab", "glove7_may.xlsx", Right(none=True, says="rig description.*Sensor.*Time"), None),
    ("lab", "wide.csv", Right(none=True, says="rig description"), None),
    ("lab", "bad/E_pa.csv", Right(says=r"\bPa\b"), None),
    ("lab", "bad/thick_m.csv", Right(says=r"\bm\b"), None),
    ("lab", "bad/thick_neg.csv", Right(says="thickness"), None),
    ("lab", "bad/skin_missing.csv", Right(says="skin|thickness"), None),
    ("lab", "bad/nanocoulomb.csv", Right(says="nC"), None),
    ("lab", "bad/deccomma_in_commas.csv", Right(says="line"), None),
    ("lab", "bad/deccomma_semicolon.csv", Right(14.23, 0.01), None),
    ("lab", "bad/nocoherence.csv", Right(14.23, 0.01), None),
    ("lab", "bad/cut.csv", Right(14.35, 0.01, says="left out"), None),
    ("lab", "bad/unknown_sensor.csv", Right(14.15, 0.01, says="s04"), None),
]
SERVICE: list[Row] = [
    (
        "service",
        "year1tz.json",
        Right(says="must|recorded_at", or_none=True),
        Right(says="recorded_at|date|must", or_none=True),
    ),
    ("service", "m198.json", Right(says="must"), None),
    ("service", "m319.json", Right(says="must"), None),
]
ROWS = [*CURVES, *PASSING, *FRF, *LAB, *SERVICE]

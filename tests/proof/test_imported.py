"""What stored results of the proof depend on: the modules that a diagnosis imports."""

from proof import joint
from proof.imported import of_a_diagnosis
from tests.support.repository import ROOT


def test_a_diagnosis_depends_on_what_it_imports_and_on_every_law_alone() -> None:
    texts = {
        "underskin.__init__": "from underskin.cli.app import main",
        "underskin.diagnosis.pipeline": "def begin():\n    from underskin.physics import hertz",
        "underskin.physics.__init__": "",
        "underskin.physics.hertz": "import underskin.units",
        "underskin.physics.field": "import underskin.units",
        "underskin.units": "from underskin import cli",
        "underskin.mechanisms.laws.creep": "",
        "underskin.cli.app": "",
    }
    packages = {"underskin.__init__", "underskin.physics.__init__"}
    left_out = {*packages, "underskin.physics.field", "underskin.cli.app"}
    assert set(of_a_diagnosis(texts)) == set(texts) - left_out
    further = of_a_diagnosis(texts, ["underskin.physics.field"])
    assert set(further) == set(texts) - left_out | {"underskin.physics.field"}


def test_joint_results_depend_on_how_sensors_of_several_campaigns_are_inverted() -> None:
    texts = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path.read_text(encoding="utf-8")
        for path in (ROOT / "underskin").rglob("*.py")
    }
    inverted = {"underskin.inversion.invert", "underskin.prediction.adopted_model"}
    assert inverted <= set(of_a_diagnosis(texts, joint.SEVERAL)) - set(of_a_diagnosis(texts))

"""What stored results of the proof depend on: the modules that a diagnosis imports."""

from proof.imported import of_a_diagnosis


def test_diagnosis_depends_imports_every_law() -> None:
    """A diagnosis depends on what it imports and on every law alone."""
    texts = {
        "underskin.__init__": "from underskin.cli.app import main",
        "underskin.diagnosis.diagnose": "def begin():\n    from underskin.physics import hertz",
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

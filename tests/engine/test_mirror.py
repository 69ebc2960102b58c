"""Every file of the engine has a test of its own name, which fails when that file alone is broken."""

from pathlib import Path

import pytest

import deadwood_engine

FILES = sorted(path.stem for path in Path(deadwood_engine.__file__).parent.glob("*.py") if path.stem != "__init__")


@pytest.mark.parametrize("name", FILES)
def test_each_file_has_its_test(name):
    mirror = Path(__file__).with_name(f"test_{name}.py")
    assert mirror.exists(), f"{name}.py has none"
    assert (
        f"deadwood_engine.{name} import" in mirror.read_text()
        or f'plain("{name}")' in mirror.read_text()
        or ("from deadwood_engine import" in mirror.read_text())
    )


def test_what_is_promised_is_there():
    """The public names, each once and in order, and each somewhere in the package."""
    assert deadwood_engine.__all__ == sorted(
        set(deadwood_engine.__all__), key=lambda n: (not n.isupper(), n.islower(), n)
    )
    assert all(hasattr(deadwood_engine, name) for name in deadwood_engine.__all__)

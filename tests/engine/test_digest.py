"""The digest of an engine: any edit of any of its sources is another engine, and nothing else is."""

import importlib.util
import shutil
from pathlib import Path

import pytest

from deadwood_engine import digest


@pytest.fixture
def told(tmp_path):
    """The digest of a small engine in a folder of its own, made anew at every call."""
    shutil.copy(digest.__file__, tmp_path / "digest.py")
    (tmp_path / "one.py").write_text("A = 1\n")
    (tmp_path / "two.py").write_text("B = 2\n")

    def tell(compiler="0.61"):
        spec = importlib.util.spec_from_file_location("a_digest", tmp_path / "digest.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.version = lambda name: {"numba": compiler}[name]
        return module.engine_digest()

    return tell


@pytest.mark.parametrize(
    "edit",
    [
        lambda folder: (folder / "two.py").write_text("B = 3\n"),
        lambda folder: (folder / "two.py").write_text("B = 2  # a comment\n"),
        lambda folder: (folder / "two.py").rename(folder / "three.py"),
        lambda folder: (folder / "three.py").write_text(""),
        lambda folder: (folder / "one.py").unlink(),
    ],
    ids=["number", "comment", "name", "more", "less"],
)
def test_any_edit_is_another_engine(told, tmp_path, edit):
    before = told()
    assert told() == before
    edit(tmp_path)
    assert told() != before


def test_another_compiler_is_another_engine_and_what_is_no_source_is_none(told, tmp_path):
    before = told()
    assert told("0.62") != before
    (tmp_path / "notes.txt").write_text("nothing")
    (tmp_path / "one.pyc").write_bytes(b"nothing")
    assert told() == before


def test_it_is_of_all_files_of_this_engine():
    """Its cache follows it: a source in a folder below would be served stale."""
    folder = Path(digest.__file__).parent
    assert sorted(folder.rglob("*.py")) == sorted(folder.glob("*.py"))

"""The digest of an engine: any edit of what any of its sources says is another engine, and nothing else is."""

import importlib.util
import shutil
from pathlib import Path

import pytest

from deadwood_engine import digest

TWO = '''"""What it is."""

B = 2


class C:
    """One of them."""

    def f(self, x=None, *, y=(1, "a", ...)):
        """What it does."""
        if x == 1:
            raise ValueError(f"one is {x}, too few")
        return [x, y, f"{x} {y!r:>3}"]
'''


@pytest.fixture
def told(tmp_path, monkeypatch):
    """The digest of a small engine in a separate folder, computed again at every call."""
    folder = tmp_path / "engine"
    folder.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shutil.copy(digest.__file__, folder / "digest.py")
    (folder / "one.py").write_text("A = 1\n")
    (folder / "two.py").write_text(TWO)

    def tell(compiler="0.61"):
        spec = importlib.util.spec_from_file_location("a_digest", folder / "digest.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.version = lambda name: {"numba": compiler}[name]
        return module.engine_digest()

    return tell


@pytest.mark.parametrize(
    "edit",
    [
        lambda folder: (folder / "two.py").write_text(TWO.replace("B = 2", "B = 3")),
        lambda folder: (folder / "two.py").write_text(TWO.replace("B = 2", "B = 2.0")),
        lambda folder: (folder / "two.py").write_text(TWO.replace("x=None", "x=0")),
        lambda folder: (folder / "two.py").write_text(TWO.replace(", *,", ",")),
        lambda folder: (folder / "two.py").write_text(TWO.replace("!r", "")),
        lambda folder: (folder / "two.py").write_text(TWO.replace("...", "'...'")),
        lambda folder: (folder / "two.py").write_text(TWO.replace("ValueError", "TypeError")),
        lambda folder: (folder / "two.py").rename(folder / "three.py"),
        lambda folder: (folder / "three.py").write_text(""),
        lambda folder: (folder / "one.py").unlink(),
    ],
    ids=["number", "type", "default", "keyword", "conversion", "string", "error", "name", "more", "less"],
)
def test_any_edit_of_the_code_is_another_engine(told, tmp_path, edit):
    before = told()
    assert told() == before
    edit(tmp_path / "engine")
    assert told() != before


@pytest.mark.parametrize(
    "words",
    [
        TWO.replace("B = 2", "B = 2  # a comment"),
        TWO.replace("What it", "That which it").replace("One of them", "More"),
        TWO.replace('    """One of them."""\n\n', ""),
        TWO.replace("x=None, *, y", "x=None,\n        *,\n        y").replace("B = 2", "B = (2)"),
        TWO.replace("\n", "\r\n"),
        TWO.replace('f"one is {x}, too few"', '"too few"'),
    ],
    ids=["comment", "docstring", "no docstring", "layout", "line ends", "message"],
)
def test_other_words_about_it_are_the_same_engine(told, tmp_path, words):
    before = told()
    assert words != TWO
    (tmp_path / "engine" / "two.py").write_bytes(words.encode())
    assert told() == before


def test_another_compiler_is_another_engine_and_what_is_no_source_is_none(told, tmp_path):
    before = told()
    assert told("0.62") != before
    (tmp_path / "engine" / "notes.txt").write_text("nothing")
    (tmp_path / "engine" / "one.pyc").write_bytes(b"nothing")
    assert told() == before


def test_what_is_remembered_is_believed_only_whole(told, tmp_path):
    """It saves the parsing; a truncated or changed line is ignored, and so is an unwritable file."""
    before, file = told(), tmp_path / "cache" / "deadwood-toolbox" / digest.REMEMBERED
    whole = file.read_text()
    read, found, _ = whole.split()
    assert found == before
    for damage in ("", whole[: len(whole) // 2], whole.replace(found, "0" * 16), "\x00" * 50, "a b c\n"):
        file.write_text(damage)
        assert told() == before
        assert file.read_text().splitlines()[-1] == whole.strip()
    file.write_text(digest._line(read, "f" * 16) + "\n")
    assert told() == "f" * 16  # it is read
    (tmp_path / "engine" / "one.py").write_text("A = 1  # again\n")
    assert told() == before  # other bytes, the same trees
    assert len(file.read_text().splitlines()) == 2
    for k in range(60):
        (tmp_path / "engine" / "one.py").write_text(f"A = 1  # {k}\n")
        assert told() == before
    assert len(file.read_text().splitlines()) <= digest._MOST
    file.unlink()
    file.mkdir()  # no place to write
    assert told() == before
    assert sorted(each.name for each in file.parent.iterdir()) == [digest.REMEMBERED]


def test_left_out_files_are_left_out(told, tmp_path):
    folder = tmp_path / "engine"
    before = digest.digest_of(folder, without={"two.py"})
    (folder / "two.py").write_text("B = 3\n")
    assert digest.digest_of(folder, without={"two.py"}) == before
    assert digest.digest_of(folder) != before


def test_it_is_of_all_files_of_this_engine():
    """Its cache follows it: a source in a folder below would be served stale."""
    folder = Path(digest.__file__).parent
    assert sorted(folder.rglob("*.py")) == sorted(folder.glob("*.py"))

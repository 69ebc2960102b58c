"""The cache of compiled kernels: the user's alone, and never believed where it is damaged."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import deadwood_engine
from deadwood_engine import engine_digest
from deadwood_engine.compiled import CheckedFiles, _cache_folder
from deadwood_engine.digest import private_folder

needs_owners = pytest.mark.skipif(not hasattr(os, "getuid"), reason="this system has no owners of files as Unix has")


def test_the_digest_names_the_sources_and_the_compiler(tmp_path):
    """Any edit, and another Numba, is another engine; the same sources are the same one in another process."""
    assert len(engine_digest()) == 16
    code = "from deadwood_engine import engine_digest; print(engine_digest())"
    root = Path(deadwood_engine.__file__).parents[1]
    told = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True, text=True
    )
    assert told.stdout.strip() == engine_digest(), told.stderr


@needs_owners
def test_a_new_folder_is_private_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        assert private_folder(tmp_path / "a" / "cache")
    finally:
        os.umask(before)
    assert (tmp_path / "a" / "cache").stat().st_mode & 0o777 == 0o700


@needs_owners
def test_a_link_is_refused(tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    (tmp_path / "cache").symlink_to(tmp_path / "elsewhere")
    assert not private_folder(tmp_path / "cache")
    (tmp_path / "file").write_text("")
    assert not private_folder(tmp_path / "file")


@needs_owners
def test_what_others_could_write_to_is_emptied(tmp_path):
    cache = tmp_path / "cache"
    cache.mkdir()
    (cache / "planted.nbi").write_bytes(b"code of another")
    cache.chmod(0o777)
    assert private_folder(cache)
    assert list(cache.iterdir()) == []
    assert cache.stat().st_mode & 0o777 == 0o700


@needs_owners
def test_a_folder_of_another_user_is_refused(tmp_path, monkeypatch):
    """Its files run as code; seen from another user's side, for a test cannot give files away."""
    cache = tmp_path / "cache"
    cache.mkdir(mode=0o700)
    (cache / "planted.nbi").write_bytes(b"code of another")
    monkeypatch.setattr(os, "getuid", lambda: 12345678)
    assert not private_folder(cache)
    assert (cache / "planted.nbi").exists()
    # the fallback in the temporary folder is this user's by its name alone: a fresh folder is made instead
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "deadwood-toolbox").mkdir()
    (tmp_path / "deadwood-toolbox-12345678").mkdir()
    chosen = _cache_folder()
    assert chosen.parent.name.startswith("deadwood-toolbox-")
    assert chosen.parent.name != "deadwood-toolbox-12345678"
    assert chosen.parent.stat().st_mode & 0o777 == 0o700


KERNEL = """
import sys
from deadwood_engine.rotation import half_turn
print(half_turn(3.0)[0], half_turn.stats.cache_hits[half_turn.signatures[0]] if half_turn.stats.cache_hits else 0)
"""


def test_an_edited_comment_leaves_kernels_compiled_and_an_edited_number_does_not(tmp_path):
    """Numba looks at lines and at the age of the source; the digest at what all sources say."""
    shutil.copytree(Path(deadwood_engine.__file__).parent, tmp_path / "deadwood_engine")
    source = tmp_path / "deadwood_engine" / "rotation.py"
    text = source.read_text(encoding="utf-8")

    def run(edited: str) -> list[str]:
        source.write_text(edited, encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        environment.pop("NUMBA_CACHE_DIR", None)
        done = subprocess.run([sys.executable, "-c", KERNEL], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    value, compiled = run(text)
    assert compiled == "0"
    assert run("# a comment above\n\n\n" + text.replace('"""', '"""Other words. ', 1)) == [value, "1"]
    assert text.count("math.cos(0.5 * angle)") == 1
    other, compiled = run(text.replace("math.cos(0.5 * angle)", "math.cos(0.25 * angle)"))
    assert compiled == "0"
    assert float(other) == pytest.approx(math.cos(0.75), abs=1e-12) != float(value)


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_a_damaged_file_is_compiled_again(tmp_path, suffix):
    """A truncated file was EOFError at every run until somebody thought of the cache; a flipped bit ran as it was."""
    root = Path(deadwood_engine.__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": str(root), "XDG_CACHE_HOME": str(tmp_path)}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run() -> list[str]:
        done = subprocess.run([sys.executable, "-c", KERNEL], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    value, _ = run()
    assert run() == [value, "1"]  # served from the cache
    file = next(f for f in tmp_path.rglob("*" + suffix) if "half_turn" in f.name)
    other = next(f for f in tmp_path.rglob("*.nb?") if f != file)
    for damage in ("empty", "cut", "bit", "another file", "zeros"):
        content = file.read_bytes()
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]
        worse = {"empty": b"", "cut": content[:middle], "bit": flipped, "another file": other.read_bytes()}
        file.write_bytes(worse.get(damage, bytes(len(content))))
        assert run() == [value, "0"], damage
        assert file.read_bytes()[32:] == content[32:], damage  # repaired
    assert run() == [value, "1"]


def test_a_full_disk_costs_the_cache_alone(tmp_path, monkeypatch):
    files = CheckedFiles(str(tmp_path), "kernel", "stamp")
    files.save("one", b"code")
    assert files.load("one") == b"code"

    def full(_: str):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "_open_for_write", full)
    files.save("two", b"code")
    assert files.load("two") is None


def test_a_kernel_is_the_same_called_from_python_and_from_a_kernel():
    """Called by a kernel it has no machine code of its own; from Python it has, and is compiled when it is needed."""
    from deadwood_engine.compiled import kernel
    from deadwood_engine.rotation import half_turn

    @kernel
    def twice(angle):
        c, s = half_turn(angle)
        return c + s, half_turn(2.0 * angle)

    compiled: Any = half_turn
    before = len(compiled.overloads)
    one, two = twice(0.3)
    assert len(compiled.overloads) == before  # compiled into its caller only
    assert one == sum(half_turn(0.3))
    assert two == half_turn(0.6)
    assert twice(0.3)[1] == half_turn(0.6)

"""Tolerances and limits: each says its unit and its reason, each is used, and no file keeps one of its own."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

from deadwood_engine import FIDELITIES, limits

FOLDER = Path(limits.__file__).parent
SOURCE = Path(limits.__file__).read_text(encoding="utf-8")
NAMES = [
    target.id
    for node in ast.parse(SOURCE).body if isinstance(node, ast.Assign)
    for target in node.targets if isinstance(target, ast.Name)
]  # fmt: skip
FILES = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.py") if path.name != "limits.py"}


def test_each_says_what_it_is():
    """A comment beside it, or above it, of three words at least."""
    comments = {
        token.start[0]: token.string.lstrip("# ") for token in tokenize.generate_tokens(io.StringIO(SOURCE).readline)
        if token.type == tokenize.COMMENT
    }  # fmt: skip
    for node in ast.parse(SOURCE).body:
        if isinstance(node, ast.Assign):
            said = " ".join(comments.get(line, "") for line in range(node.lineno - 1, (node.end_lineno or 0) + 1))
            assert len(said.split()) >= 3, ast.unparse(node)


@pytest.mark.parametrize("name", NAMES)
def test_each_is_used(name):
    if name == "GRAVITY" or any(re.search(rf"\b{name}\b", text) for text in FILES.values()):
        return
    pytest.fail(f"{name} is not used by any file of the engine")


@pytest.mark.parametrize("name", sorted(FILES))
def test_no_file_has_a_tolerance_of_its_own(name):
    """A number so small, or written with a power of ten, is a tolerance: it belongs where its reason stands."""
    if name == "fidelity.py":  # what users trade is there
        return
    text = FILES[name]
    lines = text.splitlines()
    own = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.NUMBER or not re.fullmatch(r"[\d_.eE+-]+", token.string):
            continue
        if "e" in token.string.lower() or 0.0 < float(token.string.replace("_", "")) < 0.02:
            own.append(f"{name}:{token.start[0]}: {lines[token.start[0] - 1].strip()}")
    assert own == []


def test_what_must_be_less_than_another_is():
    """Orders that kernels count on."""
    assert limits.REST_SOLVED < 1.0 < limits.ROCKING_GROWTH
    assert all(row.time_step > limits.SHORTEST_STEP for row in FIDELITIES.values())
    assert limits.AT_ONCE < limits.SHORTEST_STEP
    assert limits.HOVER_MOST < limits.UNFORESEEN < limits.NEAR_MARGIN
    assert limits.TOUCH_DEPTH < limits.FIRST_TOUCH < limits.LYING_TRAVEL <= limits.OBSTACLE_TRAVEL < 1.0
    assert limits.EXTRAPOLATE_FROM < limits.EXTRAPOLATE_LINES_FROM < limits.EXTRAPOLATE_UNTIL
    assert limits.EXTRAPOLATE_EVERY < limits.EXTRAPOLATE_FROM
    assert limits.REST_LOOK < limits.REST_SWEEPS
    assert limits.REST_WINDOW < limits.ROCKING_WINDOW
    assert limits.BLOW >= limits.IMPACT  # what rebounds is a blow
    for least, most in (limits.DIAMETER, limits.LENGTH, limits.DENSITY, limits.SHAPE_SIZE):
        assert 0.0 < least < most

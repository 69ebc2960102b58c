"""The arguments of kernels: few, and the same names for the same things."""

import ast
import re
from pathlib import Path

import deadwood_engine
from deadwood_engine.model import Model
from deadwood_engine.scene import SceneArrays

MOST = 7


def kernels():
    """(file, name, arguments) of every compiled function."""
    for file in sorted(Path(deadwood_engine.__file__).parent.glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and {"kernel", "inlined"} & set(map(ast.unparse, node.decorator_list)):
                yield file.name, node.name, [each.arg for each in node.args.args]


def test_kernels_take_at_most_seven_arguments():
    found = list(kernels())
    assert len(found) > 200
    assert not [each for each in found if len(each[2]) > MOST]


def test_what_changes_together_comes_in_one_order():
    """``model``, ``log``, ``state``, ``scratch``: as ``model`` lists them, after a cloud or a stage."""
    order = ("model", "log", "state", "scratch", "out")
    said = re.findall(r"^(\w+) {2,}\S", (Path(deadwood_engine.__file__).parent / "model.py").read_text(), re.M)
    assert tuple(said[1:]) == order
    for file, name, arguments in kernels():
        places = [order.index(each) for each in arguments if each in order]
        if "model" in arguments:
            assert places == sorted(places), (file, name, arguments)


def test_a_model_is_a_scene_and_settings():
    """``slide`` makes it of both, field by field."""
    assert Model._fields == (*SceneArrays._fields, "settings")

"""The inputs of an answer, as layers from which `slide-logs` gives the same answer, bit for bit.

The releases are those that were slid. A layer of the scene is only written again if something in it was changed: its
own rows with all columns, minus felled objects, followed by drawn ones.
"""

from __future__ import annotations

import glob
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pandas
import shapely

from deadwood_algorithms.explore.frames import Frame as Told
from deadwood_algorithms.explore.questions import Changes, Drawn, Question
from deadwood_algorithms.explore.released import releases_layer
from deadwood_algorithms.files.columns import schema_column
from deadwood_algorithms.files.outputs import STAGED
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.scene.inputs import SceneInputs
from deadwood_algorithms.scene.items import ids_of, plan_of, points_on
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.lying_logs import TIP
from deadwood_algorithms.schemas import BARRIERS, LYING_LOGS
from deadwood_algorithms.simulate.checkpoints import part_path

Layer = geopandas.GeoDataFrame
NAME = re.compile(r"\w[\w. -]{0,79}")
DRAWN = "drawn"  # name of a drawn object, followed by its number


@dataclass(frozen=True)
class Keeper:
    """Stores runs in a folder.

    slide : slides a run with these parameters instead of the scene's own, into the folder that they name
    write : writes layers into a file, with a record of their sources and of manual choices
    """

    inputs: SceneInputs
    folder: Path
    overwrite: bool
    slide: Callable[[Mapping[str, Any]], None]
    write: Callable[[Path, Mapping[str, Layer], Mapping[str, Any]], None]

    def keep(self, layers: SceneLayers, question: Question, changes: Changes, name: Any, run_too: bool = True) -> Told:
        """Write the layers of an answer, and slide a run on them, unless the caller does (``run_too``)."""
        if not isinstance(name, str) or not NAME.fullmatch(name) or name.endswith((".", " ")):
            raise UserError("give the run a name of letters, digits, blanks, points, - and _, at most 80 of them")
        run, beside = self.folder / name, self.folder / f"{name}_layers.gpkg"
        if not run.exists() and _holds_work(run):  # an engine that was killed while it saved this
            beside.unlink(missing_ok=True)
        for each in (run, beside):
            if each.exists() and not self.overwrite:
                raise UserError(f"a run or file '{each.name}' already exists; choose another name")
        kept = kept_layers(self.inputs, layers, question, changes)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.write(beside, kept, chosen(question, changes))
        if not run_too:
            return Told({"op": "kept", "name": name, "command": "", "files": [beside.name], "layers": list(kept)})
        friction = {} if question.friction is None else {"friction": question.friction}
        laws = {"rolling_friction": question.rolling_friction, "restitution": question.restitution}
        try:
            self.slide(
                {
                    **{each: f"{beside}|layername={each}" for each in kept},
                    **laws,
                    **friction,
                    "fidelity": question.fidelity,
                    "seed": question.seed,
                    "output": str(run),
                    "overwrite": self.overwrite,
                    "restart": True,
                }
            )
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        here = Path.cwd()  # where the tool was started, and the command is pasted
        folder = self.folder.relative_to(here) if self.folder.is_relative_to(here) else self.folder
        manifest, again = quoted(folder / name / "manifest.json"), quoted(folder / f"{name} again")
        command = f"deadwood-tool slide-logs --config {manifest} --output {again}"
        files = [name, beside.name]
        return Told(
            {"op": "kept", "name": name, "command": command, "at": str(here), "files": files, "layers": list(kept)}
        )


def _holds_work(run: Path) -> bool:
    return part_path(str(run)).is_dir() or any(run.parent.glob(f".{glob.escape(run.name)}{STAGED}*"))


def chosen(question: Question, changes: Changes) -> dict[str, Any]:
    """What was released and changed by hand, in numbers."""
    sizes = question.sizes
    return {
        "area": shapely.to_wkt(question.area, rounding_precision=-1),
        "radius_m": question.radius_m,
        "logs": question.n,
        "seed": question.seed,
        "dbh_cm": list(sizes.dbh_cm),
        "length_m": list(sizes.length_m),
        "density_kg_m3": sizes.density_kg_m3,
        "orientation": sizes.orientation,
        "felled": changes.fell.tolist(),
        "planted": changes.plant.tolist(),
        "barriers": [[each.points.tolist(), each.size] for each in changes.barriers],
        "lying_logs": [[each.points.tolist(), each.size] for each in changes.lying_logs],
    }


def kept_layers(inputs: SceneInputs, layers: SceneLayers, question: Question, changes: Changes) -> dict[str, Layer]:
    """The releases, and the layers of the scene that were changed, by the name of their parameter."""
    found = {"releases": releases_layer(question, inputs.defaults, layers.dem)}
    if len(changes.fell) or len(changes.plant):
        found["trees"] = trees_left(inputs, layers, changes)
    if changes.barriers:
        height = BARRIERS.column("height_m")
        own = named(own_rows(inputs.barriers, "line", "barriers", layers), "barrier_id", "name")
        if own is not None:
            own["height_m"] = schema_column(own, height)
        found["barriers"] = behind(own, drawn_rows(changes.barriers, "barrier_id", own, height_m=1.0), layers)
    if changes.lying_logs:
        own = named(own_rows(inputs.lying_logs, "line", "lying_logs", layers), "lying_id", "tree_id", "log_id", "name")
        if own is not None:
            base = schema_column(own, LYING_LOGS.column("diameter_cm"), inputs.lying_diameter_cm)
            tip = schema_column(own, LYING_LOGS.column(TIP)) if TIP in own else 0.5 * base
            own["diameter_cm"], own[TIP] = base, tip
        more = drawn_rows(changes.lying_logs, "lying_id", own, diameter_cm=1.0, **{TIP: 0.5})
        found["lying_logs"] = behind(own, more, layers)
    return found


def own_rows(path: str | None, geometry: str, what: str, layers: SceneLayers) -> Layer | None:
    """The rows of a layer of the scene, as read for it; None if there is none."""
    if path is None:
        return None
    return read_vector(path, geometry=(geometry,), target_crs=layers.dem.crs, what=what, feedback=Quiet())


def trees_left(inputs: SceneInputs, layers: SceneLayers, changes: Changes) -> Layer:
    """The trees without those that were felled, and with those that were planted."""
    own = own_rows(inputs.trees, "point", "trees", layers)
    x, y, dbh_cm, height = changes.plant.T
    planted: dict[str, Any] = {"dbh_cm": dbh_cm, "height_m": height}
    if own is not None:
        ids = ids_of(own, "tree_id")
        rows = np.flatnonzero(points_on(layers.dem, *plan_of(own)))
        stays = np.ones(len(own), bool)
        stays[rows[changes.fell]] = False
        own["tree_id"] = ids
        if len(x):
            number = pandas.api.types.is_integer_dtype(ids)
            planted["tree_id"] = int(ids.max()) + 1 + np.arange(len(x)) if number else new_ids(ids, len(x))
            if not number:
                own["tree_id"] = [str(each) for each in ids]
        own = Layer(own[stays])
    else:
        planted["tree_id"] = np.arange(1, len(x) + 1)
    return behind(own, Layer(planted, geometry=shapely.points(x, y), crs=layers.dem.plan_crs), layers)


def named(own: Layer | None, name: str, *others: str) -> Layer | None:
    """The rows with their ids, as text, in the first of these columns; drawn objects have one, too."""
    if own is not None:
        own[name] = [str(each) for each in ids_of(own, name, *others)]
    return own


def new_ids(taken: Iterable[Any], number: int) -> list[str]:
    """Ids that are not in use: drawn 1, drawn 2, ..."""
    known, found, k = {str(each) for each in taken}, [], 1
    while len(found) < number:
        if f"{DRAWN} {k}" not in known:
            found.append(f"{DRAWN} {k}")
        k += 1
    return found


def drawn_rows(drawn: Sequence[Drawn], name: str, own: Layer | None, **sizes: float) -> Layer:
    """Rows of what was drawn; sizes : by column, which part of the size that was given."""
    size = np.array([each.size for each in drawn])
    columns = {column: part * size for column, part in sizes.items()}
    ids = new_ids(list(own[name]) if own is not None else [], len(drawn))
    return Layer({name: ids, **columns}, geometry=[shapely.LineString(each.points) for each in drawn])


def behind(own: Layer | None, more: Layer, layers: SceneLayers) -> Layer:
    """The rows of a layer, and further ones behind them."""
    more = more.set_crs(layers.dem.plan_crs, allow_override=True)
    if own is None:
        return more
    own = own.set_crs(layers.dem.plan_crs, allow_override=True)
    if not len(more):
        return Layer(own.reset_index(drop=True))
    return Layer(pandas.concat([own, more], ignore_index=True), crs=layers.dem.plan_crs)

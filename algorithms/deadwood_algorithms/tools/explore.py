"""Try things on a slope: click to slide logs, fell a tree or draw a barrier, and see the effect within a second.

Loads the scene once, keeps the engine in memory, and opens a page in the browser. Release logs with a click, and see
the share that reaches each line with its interval; fell or plant trees, draw barriers and lying logs, and see the
paired difference for the same logs. A result can be saved as a run of slide-logs, with the changed layers; it is the
same as what slide-logs gives for them, byte for byte.

    deadwood-tool explore --dem dem.tif --trees trees.gpkg --lines road.gpkg

The page is served on this machine's loopback address only, to whoever has the token in the printed address. Ctrl-C ends
it. Logs move as in slide-logs, at draft unless another fidelity is chosen. With 300 logs a share is accurate to a few
percentage points; its interval shows how many. If the terrain model has more than 25 million cells, only the extent of
the layers and 500 m around it are read; a log that leaves this part counts as having left the terrain model.
"""

from __future__ import annotations

import json
import sys
import webbrowser
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.accounts import accounting
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.manifest import manifest
from deadwood_algorithms.params.messages import Hearing, warnings_among
from deadwood_algorithms.params.tool import Feedback, Outcome, Quiet, Tool, UserError
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene.released_scene import FrictionByName

if TYPE_CHECKING:
    from deadwood_algorithms.explore.kept import Keeper
    from deadwood_algorithms.explore.questions import Defaults
    from deadwood_algorithms.explore.stdio import Out

FRICTION = 0.25
CHILD = "from deadwood_algorithms.tools import explore; explore.answer_on_pipes()"


@dataclass(frozen=True, kw_only=True)
class Ask(FrictionByName):
    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        minimum=0.0,
        default=None,
        help=f"A number, a raster, or polygons with a field 'friction' or 'mu'. Default: {FRICTION:g}.",
    )
    fidelity: str = tool.choice(
        "Fidelity at the start: speed against accuracy", "draft", "standard", "fine", "reference", default="draft"
    )
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    port: int = tool.integer("Port of the page", default=0, minimum=0, maximum=65535, help="0: any free one.")
    no_browser: bool = tool.flag("Only print the address of the page")
    stdio: bool = tool.flag(
        "Answer on standard input and output instead of a page",
        advanced=True,
        help="For programs, such as the panel in QGIS: one line of JSON for each message, binary frames as answers.",
    )
    output: str = tool.output_folder("Folder in which runs are kept", default="explored")
    overwrite: bool = tool.overwrite()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.friction is None:
            object.__setattr__(self, "friction", FRICTION)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    if ask.stdio:
        from deadwood_algorithms.explore.stdio import own_stdout

        answer(ask, own_stdout(), feedback)
    else:
        serve_page(ask, feedback)
    return Outcome({})


def serve_page(ask: Ask, feedback: Feedback) -> None:
    """The page, until Ctrl-C; the scene and the engine are in a separate process."""
    from deadwood_algorithms.explore.server import serve

    def opened(address: str) -> None:
        print(address, flush=True)
        feedback.note("the page stays at this address while the command runs; Ctrl-C ends it")
        if not ask.no_browser and not webbrowser.open(address):
            feedback.note("no browser could be started; open the address yourself")

    values = manifest(TOOL, replace(ask, stdio=True))["parameters"]
    serve([sys.executable, "-c", CHILD], json.dumps(values), ask.port, feedback, opened)


def answer_on_pipes() -> None:
    """The engine process of the page: the first line of its input contains the parameters of the tool."""
    from deadwood_algorithms.explore.frames import Frame
    from deadwood_algorithms.explore.stdio import own_stdout

    out = own_stdout()
    ask = TOOL.ask_from(json.loads(sys.stdin.buffer.readline()))
    try:
        answer(ask, out, Said(out))
    except UserError as error:
        out.send(Frame({"op": "unfit", "text": str(error)}))


class Said(Quiet):
    """A feedback whose words go to the process that started this one."""

    def __init__(self, out: Out) -> None:
        self.out = out

    def say(self, how: str, text: str, **more: Any) -> None:
        from deadwood_algorithms.explore.frames import Frame

        self.out.send(Frame({"op": "said", "how": how, "text": text, **more}))

    def progress(self, done: float, total: float, what: str) -> None:
        self.say("progress", what, done=done, total=total)

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.say("note", message)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        self.say("warn", message)


def answer(ask: Ask, out: Out, feedback: Feedback) -> None:
    """Load the scene, then answer what comes in until the input ends."""
    from deadwood_algorithms.explore.relief import Relief
    from deadwood_algorithms.explore.session import Session
    from deadwood_algorithms.explore.stdio import Front
    from deadwood_algorithms.explore.surroundings import part_to_explore
    from deadwood_algorithms.results.identity import verify_inputs
    from deadwood_algorithms.scene.ground import warn_of_cells
    from deadwood_algorithms.simulate.simulation import open_simulation
    from deadwood_algorithms.simulate.warm_up import load_kernels
    from deadwood_algorithms.simulate.windows import scene_on
    from deadwood_engine import FIDELITIES

    where, hearing = Where(ask.threads, name=TOOL.name), Hearing(feedback)
    verify_inputs(TOOL, ask, hearing)
    with open_simulation(ask.inputs(), FIDELITIES[ask.fidelity], where, hearing) as simulation, accounting() as said:
        layers = scene_on(simulation, part_to_explore(simulation, hearing), hearing)
        warn_of_cells(layers.dem, hearing)
        load_kernels(layers.shape, feedback)
        session = Session(simulation, layers, defaults_of(ask, layers.friction), warnings_among(hearing.messages))
        session.warm_up()
        Front(session, Relief(layers.dem), out, keeper_of(ask, feedback, said)).serve(sys.stdin.buffer)


def defaults_of(ask: Ask, friction: Any) -> Defaults:
    from deadwood_algorithms.explore.questions import Defaults, Sizes

    return Defaults(
        Sizes((ask.dbh_cm, ask.dbh_cm), (ask.length_m, ask.length_m), ask.density_kg_m3, ask.orientation),
        ask.seed,
        ask.fidelity,
        friction if isinstance(friction, float) else None,
        ask.rolling_friction,
        ask.restitution,
        ask.friction_preset,
    )


def keeper_of(ask: Ask, feedback: Feedback, accounts: Mapping[str, Any]) -> Keeper:
    """What keeps an answer: its layers with the record of this tool, and a run of slide-logs on them.

    accounts : what became of the rows of the scene's layers, as of `accounting`
    """
    from deadwood_algorithms.explore.kept import Keeper
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.tools import slide_logs

    def slide(changes: Mapping[str, Any]) -> None:
        shared = {each.name for each in slide_logs.TOOL.parameters()} & {each.name for each in TOOL.parameters()}
        slide_logs.TOOL(feedback=feedback, **{name: getattr(ask, name) for name in shared} | dict(changes))

    def write(place: Path, layers: Mapping[str, Any], chosen: Mapping[str, Any]) -> None:
        with writing(TOOL, replace(ask, output=str(place)), feedback) as outputs:
            outputs.facts["chosen"] = chosen
            outputs.accounts.update(accounts)
            write_vector(outputs.file("output", ".gpkg"), layers)

    return Keeper(ask.inputs(), Path(ask.output), ask.overwrite, slide, write)


TOOL = Tool(
    "explore", "Simulate", "Explore on a page: release logs, fell trees, draw barriers", Ask, run, in_qgis=False
)

"""The parameters of every tool that slides logs: the layers of the scene, the released logs, and how to slide them.

Declared once, as the base of the ``Ask`` of every tool that takes a scene and released logs, so that the values of one
tool's manifest mean the same in another. Lower packages get them as a record, `SceneInputs`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.presets import FRICTIONS, Taken, choices_help
from deadwood_algorithms.scene.default_log import DEFAULTED, DefaultLog
from deadwood_algorithms.scene.inputs import CONTACT_LAWS, SceneInputs
from deadwood_algorithms.scene.laws import Breaking, scar_laws, slip_laws
from deadwood_algorithms.schemas import DBH_CM

# Ground into which a log sinks so far that resistance increases does not carry a rigid log
MOST_ROLLING = 0.5


@dataclass(frozen=True, kw_only=True)
class _Terrain:
    dem: str = tool.terrain("Terrain model")


@dataclass(frozen=True, kw_only=True)
class _Released(_Terrain):
    releases: str = tool.vector("Released logs", "point")


@dataclass(frozen=True, kw_only=True)
class _LayersAndLaws:
    trees: str | None = tool.vector("Standing trees", "point", default=None)
    barriers: str | None = tool.vector("Barriers", "line", default=None)
    height_field: str | None = tool.field_of(
        "barriers",
        "Field of the barriers' height in m",
        default=None,
        advanced=True,
        help="Without it: by its usual name.",
    )
    lying_logs: str | None = tool.vector(
        "Lying logs that hold others back",
        "line",
        default=None,
        help="Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and, optionally, 'tip_diameter_cm'. They "
        "are rigid, rest on the terrain and do not move.",
    )
    blocks: str | None = tool.vector(
        "Boulders that hold logs back",
        "point",
        default=None,
        help="Points with a field 'diameter_m' (or 'radius_m') and, optionally, 'height_m', that of the top above the "
        "terrain. They are rigid spheres, do not move, and have the ground's friction and restitution.",
    )
    lines: str | None = tool.vector("Roads, railways, houses", "line", "polygon", default=None)
    friction: str | float = tool.number_or_layer(
        "Friction coefficient", minimum=0.0, help="A number, a raster, or polygons with a field 'friction' or 'mu'."
    )
    friction_column: str | None = tool.text(
        "Column of the friction polygons", default=None, advanced=True, help="Default: 'friction', else 'mu'."
    )
    friction_elsewhere: float | None = tool.number(
        "Friction where the raster or the polygons have none",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Without it, a layer that does not cover the DEM is refused.",
    )
    restitution: float = tool.number(
        "Normal restitution of impacts", advanced=True, default=0.0, minimum=0.0, maximum=1.0
    )
    rolling_friction: float = tool.number(
        "Coefficient of rolling friction of the ground",
        advanced=True,
        default=0.1,
        minimum=0.0,
        maximum=MOST_ROLLING,
        help="The moment against rolling is at most this times the normal force times the log's radius. A roller "
        "of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09, 0.13; 0 is rigid ground. No value measured for logs is "
        "known.",
    )
    tree_friction: float | None = tool.number(
        "Friction of stems and lying logs",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Default: that of the ground there.",
    )
    tree_restitution: float | None = tool.number(
        "Restitution of stems and lying logs",
        default=None,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
        help="Default: that of the ground.",
    )
    barrier_friction: float | None = tool.number(
        "Friction of barriers", default=None, minimum=0.0, advanced=True, help="Default: that of the ground there."
    )
    barrier_restitution: float | None = tool.number(
        "Restitution of barriers",
        default=None,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
        help="Default: that of the ground.",
    )
    tree_capacity_kj: float | None = tool.number(
        "Energy that a tree of 40 cm DBH absorbs in a hit before it breaks",
        unit="kJ",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
        help="slide-logs counts the hits in which a tree takes more, and the logs that had one; with --break-trees the "
        "trees break.",
    )
    tree_capacity_power: float = tool.capacity_power()
    break_trees: bool = tool.flag(
        "Trees break above their capacity",
        advanced=True,
        help="Such a tree absorbs just its capacity and then disappears, for this log only; for other logs it stands. "
        "Without it trees are rigid, as in the paper.",
    )
    shape: str = tool.text(
        "Shape of what slides: cone, or a file of points",
        default="cone",
        advanced=True,
        path_like=True,
        help="A .pts file (x y z on each line, metres, no header) slides the convex hull of its points instead of "
        "logs: rocks, or logs as rings of vertices. dbh_cm and length_m of the releases are then ignored, the density "
        "is used; its z axis replaces the axis of a log.",
    )
    friction_max: float | None = tool.number(
        "Friction coefficient after much slip, for a point cloud",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Friction grows from --friction to this while the body touches the ground: mu(s) = mu_min + (2/pi) "
        "(mu_max - mu_min) atan(kappa s), s the distance its centre has moved on the ground (Leine et al. 2014). Needs "
        "--friction-kappa and --friction-beta.",
    )
    friction_kappa: float | None = tool.number(
        "How fast friction grows with slip, for a point cloud",
        unit="1/m",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
        help="After a slip of 1/kappa it is halfway.",
    )
    friction_beta: float | None = tool.number(
        "How fast slip decays in the air, for a point cloud",
        unit="1/s",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Off the ground the slip decays as exp(-beta t).",
    )
    soil_strength_mn_m2: float | None = tool.number(
        "Strength of soft ground, into which a point cloud digs",
        unit="MN/m2",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
        help="M_E of the scarring model of Lu et al. (2019), 10 to 25 on the alpine meadow of its experiments: the "
        "deeper a body digs in, the longer the soil brakes it. Needs --scar-drag. Without it the ground is hard.",
    )
    scar_drag: float | None = tool.number(
        "Drag coefficient of the soil that is compacted, for soft ground",
        default=None,
        minimum=0.0,
        advanced=True,
        help="C_s of the same model, 0.1 to 4 there; it adds to 1 for the soil that flows.",
    )
    time_limit_s: float = tool.number(
        "Longest simulated time of a log",
        advanced=True,
        unit="s",
        default=300.0,
        minimum=0.0,
        maximum=86_400.0,
        exclusive=True,
    )
    rest_speed_ms: float = tool.number(
        "Speed below which a log may be at rest", unit="m/s", default=0.1, minimum=0.0, exclusive=True, advanced=True
    )


@dataclass(frozen=True, kw_only=True)
class OpenScene(DefaultLog, _LayersAndLaws, _Terrain):
    """A scene whose logs are released later (`explore`).

    Fields in the order of the bases from the last: the terrain, the layers and laws, the default log, then these.
    """

    lying_diameter_cm: float = tool.number(
        "Base diameter of lying logs, where the layer has none",
        advanced=True,
        unit="cm",
        default=40.0,
        minimum=0.0,
        maximum=DBH_CM[1],
        exclusive=True,
    )
    min_runout_m: float | None = tool.min_runout(advanced=True)
    seed: int = tool.seed()
    crs: str | None = tool.crs()

    def inputs(self, releases: str = "") -> SceneInputs:
        """The inputs of a simulation, as a record."""
        return SceneInputs(
            dem=self.dem,
            crs=self.crs,
            friction=self.friction,
            friction_column=self.friction_column,
            friction_elsewhere=self.friction_elsewhere,
            trees=self.trees,
            barriers=self.barriers,
            height_field=self.height_field,
            lying_logs=self.lying_logs,
            lying_diameter_cm=self.lying_diameter_cm,
            blocks=self.blocks,
            lines=self.lines,
            shape=self.shape,
            releases=releases,
            defaults={name: getattr(self, name) for name in DEFAULTED},
            laws={
                **{name: getattr(self, name) for name in CONTACT_LAWS},
                "time_limit": self.time_limit_s,
                "rest_speed": self.rest_speed_ms,
                **slip_laws(self.shape, self.friction_max, self.friction_kappa, self.friction_beta),
                **scar_laws(self.shape, self.soil_strength_mn_m2, self.scar_drag),
            },
            breaking=Breaking.from_options(self.break_trees, self.tree_capacity_kj, self.tree_capacity_power),
        )


@dataclass(frozen=True, kw_only=True)
class ReleasedScene(OpenScene, _Released):
    """The same with the layer of the logs, which follows the terrain."""

    def inputs(self, releases: str = "") -> SceneInputs:
        return super().inputs(releases or self.releases)


@dataclass(frozen=True, kw_only=True)
class FrictionByName(OpenScene, tool.TakesPresets):
    """A scene with a friction that may be selected by name."""

    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        minimum=0.0,
        default=None,
        unless="friction_preset",
        help="A number, a raster, or polygons with a field 'friction' or 'mu'. Needed, unless --friction-preset names "
        "one.",
    )
    friction_preset: str | None = tool.choice(
        "Friction coefficient by name", *FRICTIONS, default=None, help=choices_help(FRICTIONS)
    )

    def __post_init__(self) -> None:
        if self.friction is None and self.friction_preset in FRICTIONS:
            object.__setattr__(self, "friction", FRICTIONS[self.friction_preset].values["friction"])

    def taken_presets(self) -> tuple[Taken, ...]:
        if self.friction_preset is None:
            return ()
        return (Taken.of(FRICTIONS[self.friction_preset], "--friction-preset", {"friction": self.friction}),)

    def inputs(self, releases: str = "") -> SceneInputs:
        return replace(super().inputs(releases), presets=self.taken_presets())


@dataclass(frozen=True, kw_only=True)
class SceneByName(FrictionByName, ReleasedScene):
    """Both: the parameters of slide-logs and similar tools."""

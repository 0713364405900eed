"""Every kind of exchangeable part, and what a part of each kind may declare. Light to import.

A shipped part is one file: `torc/parts/planners/dg_select.py` is the task planner `dg-select`. The first line of its
docstring is its help, and `PART` is its class, or a function that makes one. Other packages register a class by an
entry point of the kind's group (`torc.planners`), or a whole package with folders like these by one entry point of the
group `torc.parts`. Any class can also be named directly, as "module:Class" or "path/to/file.py:Class".
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

FOLDERS = "torc.parts"
"""The package with a folder of parts for each kind; also the group of entry points that adds further packages."""


class Traits:
    """What a part declares about itself, as class attributes.

    Inherit the traits of a kind to declare some; a class that does not inherit can set attributes of the same names.
    """


class CameraTraits(Traits):
    """The traits of a camera."""

    real: bool = False
    """It looks at the real world, or at a recording of it: no simulated trial can use it."""
    unplaced: Callable[[], Any] | None = None
    """A method that takes a snapshot in the camera's own frame while its pose is unknown."""

    @classmethod
    def check_library(cls) -> None:
        """Raise MissingDependencyError, with the remedy, if a library of this camera is missing."""

    @classmethod
    def devices(cls) -> list[str] | None:
        """Return a line for each connected device; None if that is unknown."""
        return None

    def close(self) -> None:
        """Free the device."""


class DepthTraits(Traits):
    """The traits of a depth stage."""

    needs_pair: bool = False
    """It reads the stereo pair of an observation. A simulated camera takes one only then."""
    simulated_only: bool = False
    """It adds errors to exact depth. A real picture has errors of its own."""
    rough: bool = False
    """Its depth has a sensor's errors: perception and the occlusion volume then use their settings for real cameras."""


class PerceptionTraits(Traits):
    """The traits of a perception."""

    needs_labels: bool = False
    """It takes the true masks: its `perceive` has a keyword argument `label_image` (object id per pixel)."""
    needs_pictures: bool = False
    """It recognises the target by reference pictures. A simulated trial takes them only then."""
    reads_words: bool = False
    """It recognises the target by its description."""
    recognise: Callable[..., float | None] | None = None
    """A method `recognise(observation, mask, wanted, scene, object_id)` that returns the probability that the object in
    the gripper is the target, or None if it cannot say; see `torc.perception.protocol.Perception`."""


class MotionPlannerTraits(Traits):
    """The traits of a motion planner."""

    config: Any = None
    """If a `MotionConfig`, grasps count as valid only if straight motions by these settings exist."""

    def warm_up(self, request: Any) -> None:
        """Run each compiled kernel once, before a trial, on a made-up request."""


class TaskPlannerTraits(Traits):
    """The traits of a task planner."""

    name: str = ""
    """Its name in tables. Required."""
    asks_model: bool = False
    """It asks a VLM: its class takes a `client`."""
    reads_picture: bool = True
    """It may read the colour picture. Otherwise a simulated trial draws none, unless something else needs it. A
    subclass does not inherit False."""
    privileged: bool = False
    """It knows more than a camera shows, such as the simulator's truth. It plays as a reference and is not ranked; it
    cannot decide for real pictures."""

    @property
    def bound(self) -> Any:
        """How sure a reference is that no planner can do with fewer picks; None for other planners."""
        return None

    def warm_up(self, context: Any) -> None:
        """Run each compiled kernel once, before a trial, on a made-up context."""


class ArmTraits(Traits):
    """The traits of an arm driver."""

    feels_contact: bool = False
    """The contact force in its status means something: motions are then guarded by it."""


T = TypeVar("T", bound=Traits)


@dataclass(frozen=True)
class Kind(Generic[T]):
    """A kind of part that can be exchanged.

    Attributes:
        what: its name in messages.
        option: its option on the command line, and the beginning of its settings ("grasps.candidates.max_blocked").
        folder: the folder of shipped parts below `torc.parts`; with "torc." before it, the group of entry points.
        call: the method that every part has, with its arguments.
        base: the traits that a part may declare.
        suite: the conformance suite in `torc.testing`, or torc-lab's for drivers; "" if there is none.
        in_file: its settings are entries of a lab file and not options.
    """

    what: str
    option: str
    folder: str
    call: str
    base: type[T]
    suite: str = ""
    in_file: bool = False

    @property
    def group(self) -> str:
        """The group of entry points by which packages register a part."""
        return f"torc.{self.folder}"

    @property
    def title(self) -> str:
        """`what`, for the beginning of a sentence."""
        return self.what[0].upper() + self.what[1:]

    @property
    def method(self) -> str:
        """The name of the method."""
        return self.call.partition("(")[0]

    def traits(self, part: object) -> T:
        """Return what a part, or a class of parts, declares, with defaults for the rest."""
        return traits_of(part, self.base)


def traits_of(part: object, base: type[T]) -> T:
    """Return what a part declares, with the defaults of `base` for the rest.

    This is the only place where torc looks into a part that does not inherit the traits of its kind.
    """
    if isinstance(part, base) or (isinstance(part, type) and issubclass(part, base)):
        return cast(T, part)
    found = {name: getattr(part, name) for name in declarable(base) if hasattr(part, name)}
    wrapped = {name: staticmethod(value) if callable(value) else value for name, value in found.items()}
    return cast(T, type(base.__name__, (base,), wrapped)())


def declarable(base: type[Traits]) -> Mapping[str, Any]:
    """Return the traits of a base, with their defaults."""
    return {name: value for name, value in vars(base).items() if not name.startswith("_")}


CAMERAS = Kind("camera", "camera", "cameras", "capture()", CameraTraits, "camera_conformance")
DEPTHS = Kind("depth", "depth", "depths", "measure(observation)", DepthTraits, "depth_conformance")
PERCEPTIONS = Kind(
    "perception",
    "perception",
    "perceptions",
    "perceive(observation, wanted, before)",
    PerceptionTraits,
    "perception_conformance",
)
GRASP_PLANNERS = Kind(
    "grasp planner", "grasps", "grasp_planners", "plan(scene, volume, rng)", Traits, "grasp_conformance"
)
MOTION_PLANNERS = Kind(
    "motion planner",
    "motion",
    "motion_planners",
    "plan_pick(request, rng)",
    MotionPlannerTraits,
    "motion_conformance",
)
TASK_PLANNERS = Kind(
    "task planner", "planner", "planners", "decide(context, rng)", TaskPlannerTraits, "planner_conformance"
)
CLIENTS = Kind("VLM client", "vlm", "vlm_clients", "ask(question)", Traits, "vlm_client_conformance")
ARM_DRIVERS = Kind(
    "arm driver", "arm", "arm_drivers", "start(trajectory)", ArmTraits, "arm_conformance", in_file=True
)
GRIPPER_DRIVERS = Kind(
    "gripper driver",
    "gripper",
    "gripper_drivers",
    "open(width_m)",
    Traits,
    "gripper_conformance",
    in_file=True,
)
SCENE_FAMILIES = Kind(
    "scene family", "family", "scene_families", "finished(problem, inspector, stillness)", Traits
)

KINDS: tuple[Kind[Any], ...] = (
    CAMERAS,
    DEPTHS,
    PERCEPTIONS,
    GRASP_PLANNERS,
    MOTION_PLANNERS,
    TASK_PLANNERS,
    CLIENTS,
    ARM_DRIVERS,
    GRIPPER_DRIVERS,
    SCENE_FAMILIES,
)
"""All kinds."""
STAGES: Mapping[str, Kind[Any]] = {
    kind.option: kind for kind in (CAMERAS, PERCEPTIONS, DEPTHS, GRASP_PLANNERS, MOTION_PLANNERS)
}
"""The stages around the task planner, as `Conditions` names them."""
CONFIGURED: Mapping[str, str] = {
    "noise": "torc.perception.noise:stereo_camera",
    "occlusion": "torc.occlusion.volume:FIXED_CAMERA",
    "failures": "torc.pipeline.failures:FailureConfig",
    "bets": "torc.pipeline.better_bet:BetConfig",
    "simulation": "torc.sim.robot:SimulatedRobotConfig",
}
"""Configurations that are not parts: name -> the default settings, or a function that makes them."""

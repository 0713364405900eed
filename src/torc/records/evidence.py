"""The evidence behind a decision: for the log, the pages and the pictures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from pydantic import TypeAdapter, ValidationError

from torc.errors import InputError
from torc.io.record_files import to_plain
from torc.records.graph import DependencyGraph


@dataclass(frozen=True)
class Certainty:
    """How exact the sink probabilities of a dependency graph are.

    Attributes:
        exact: the probabilities are exact; otherwise they are lower bounds, and `upper` are upper bounds by object id.
        decided: the bounds are tight enough to decide among the graspable sinks.
        bound_hit: the limit that was hit, in words; empty if exact.
        lost: the probability that ends at no sink.
    """

    exact: bool
    decided: bool
    bound_hit: str = ""
    upper: Mapping[int, float] = field(default_factory=dict)
    lost: float = 0.0


@dataclass(frozen=True)
class BeliefEvidence:
    """Where the planner BELIEF expects the target, and what it means to remove.

    Attributes:
        order: object ids in the order of removal.
        expected_picks: expected number of picks to the target along that order.
        picks_now: expected number of picks if the target in sight is taken now; None if it cannot be, or is hidden.
        reveals: by object id, the probability that removing it alone shows the target.
        behind: by object id, the probability that the target is behind it.
        hidden_by: by object id, the probability that it hides the target.
        prices: by object id, the expected number of picks to remove it.
        beyond: the probability that the target is where no removal shows it.
        particles: number of target poses that fit the unseen space.
        presence: probability that the target is there at all.
        suspects: by object id, the probability that it is the target, unrecognised.
        tile_px: edge of a tile of the belief's picture.
        tiles: (row, column, probability) of each tile that counts.
    """

    order: tuple[int, ...]
    expected_picks: float
    picks_now: float | None = None
    reveals: Mapping[int, float] = field(default_factory=dict)
    behind: Mapping[int, float] = field(default_factory=dict)
    hidden_by: Mapping[int, float] = field(default_factory=dict)
    prices: Mapping[int, float] = field(default_factory=dict)
    beyond: float | None = None
    particles: int | None = None
    presence: float | None = None
    suspects: Mapping[int, float] = field(default_factory=dict)
    tile_px: int | None = None
    tiles: tuple[tuple[int, int, float], ...] = ()


@dataclass(frozen=True)
class Tokens:
    """Tokens of a reply, as the server counts them; None where it does not say. `reply` includes `thinking`."""

    prompt: int | None = None
    reply: int | None = None
    thinking: int | None = None


@dataclass(frozen=True)
class ModelTry:
    """One request to a model. `useless` says why the reply could not be used; None if it could."""

    useless: str | None = None
    finish: str = ""
    model_version: str = ""
    tokens: Tokens = field(default_factory=Tokens)
    seconds: float = 0.0


@dataclass(frozen=True)
class ModelEvidence:
    """A model's input beside the question, and every try; the texts are the decision's `exchanges`.

    Attributes:
        prompt, prompt_sha256: name and digest of the prompt file.
        image_sha256: digest of the marked picture, the first of `pictures`.
        pictures: facts of each picture that was sent.
        system: instructions before the conversation.
        examples: turns before the question.
        tries: every request.
    """

    prompt: str = ""
    prompt_sha256: str = ""
    system: str = ""
    examples: tuple[Mapping[str, Any], ...] = ()
    image_sha256: str = ""
    pictures: tuple[Mapping[str, Any], ...] = ()
    tries: tuple[ModelTry, ...] = ()


@dataclass(frozen=True)
class Corrections:
    """A model's changes to the proposed relations, and those that were refused, in words."""

    changes: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


@dataclass(frozen=True)
class Evidence:
    """The evidence behind a decision. Every field may be empty.

    Attributes:
        rule: the rule that applied, in a few words.
        graph: the dependency graph; it is drawn with the decision.
        probabilities: by object id, how probably picking it makes progress (sink probabilities, or a learned score).
        certainty: how exact those are.
        belief: where the target is expected.
        vlm: what a model was asked.
        corrections: what a model corrected.
        notes: anything else as JSON-compatible data, e.g. of your own planner.
    """

    rule: str = ""
    graph: DependencyGraph | None = None
    probabilities: Mapping[int, float] = field(default_factory=dict)
    certainty: Certainty | None = None
    belief: BeliefEvidence | None = None
    vlm: ModelEvidence | None = None
    corrections: Corrections | None = None
    notes: Mapping[str, Any] = field(default_factory=dict)

    def to_plain(self) -> dict[str, Any]:
        """Return JSON-compatible data without empty fields, notes beside the others. `from_plain` reads it."""
        plain = {f.name: _plain(getattr(self, f.name)) for f in fields(self) if f.name != "notes"}
        return {k: v for k, v in plain.items() if v not in ("", None, {})} | to_plain(self.notes)

    @staticmethod
    def from_plain(plain: Mapping[str, Any]) -> "Evidence":
        """Read what `to_plain` wrote, also in older versions of torc. Unreadable parts stay as notes."""
        known: dict[str, Any] = {}
        for name, value in plain.items():
            try:
                if name in _READERS:
                    known[name] = _READERS[name](value)
            except (InputError, ValidationError, RecursionError):
                continue
        return Evidence(**known, notes={k: v for k, v in plain.items() if k not in known})


_READERS: Mapping[str, Callable[[Any], Any]] = {
    "graph": DependencyGraph.from_dict,
    "rule": TypeAdapter(str).validate_python,
    "probabilities": TypeAdapter(dict[int, float]).validate_python,
    "certainty": TypeAdapter(Certainty).validate_python,
    "belief": TypeAdapter(BeliefEvidence).validate_python,
    "vlm": TypeAdapter(ModelEvidence).validate_python,
    "corrections": TypeAdapter(Corrections).validate_python,
}


def _plain(value: Any) -> Any:
    """Return a part of the evidence as plain data without its empty fields."""
    if isinstance(value, DependencyGraph):
        return value.to_dict()
    if is_dataclass(value):
        return {k: v for k, v in to_plain(value).items() if v not in (None, "", {})}
    return to_plain(value)

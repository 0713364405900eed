"""Settings of the planner `belief`. Lengths are in metres; every ingredient can be switched off."""

from dataclasses import dataclass, field

from torc.errors import InputError
from torc.task_planning.dg_select import DgSelectConfig

Size = tuple[float, float, float]

GENERIC_SIZES_M: tuple[Size, ...] = (
    (0.04, 0.07, 0.09),
    (0.05, 0.08, 0.13),
    (0.07, 0.07, 0.10),
    (0.065, 0.065, 0.19),
    (0.08, 0.08, 0.08),
    (0.05, 0.14, 0.20),
    (0.06, 0.06, 0.06),
    (0.02, 0.05, 0.14),
)
"""Edges of boxes around usual household goods: a small and a flat carton, can, bottle, mug, cereal box, fruit and tool.
"""


@dataclass(frozen=True)
class ParticleConfig:
    """How poses of a hidden target are proposed.

    Attributes:
        proposals: poses drawn at every look.
        most: most fitting proposals kept, in the order in which they were drawn.
        fewest: with fewer than this, DG-SELECT's order applies.
        on_support: share of the proposals that stand or lie on the support; the others lie where they fall, or at the
            height at which they were drawn if nothing known is below.
        told_size: use the target's size if the user gave it.
        sizes_m: edge lengths of the boxes that stand for a target of unknown size, all equally likely.
        unseen_share: a proposal fits if at least this share of it was never seen.
        least_unseen_share: it does not fit if no more than this share was never seen; in between its weight grows.
        inside_share: share of a proposal that may lie inside bodies in sight at no loss.
        most_inside_share: with this share inside it does not fit; 1 leaves bodies out of the test.
        body_scale: scale of the bodies in sight for that test, about their centres: they are boxes around them.
    """

    proposals: int = 12_000
    most: int = 1_500
    fewest: int = 60
    on_support: float = 0.6
    told_size: bool = True
    sizes_m: tuple[Size, ...] = GENERIC_SIZES_M
    unseen_share: float = 0.9
    least_unseen_share: float = 0.6
    inside_share: float = 0.1
    most_inside_share: float = 0.3
    body_scale: float = 0.85

    def __post_init__(self) -> None:
        if self.proposals < 1 or self.most < 1 or self.fewest < 1:
            raise InputError("particles: proposals, most and fewest must be at least 1.")
        if self.proposals > 1_000_000:
            raise InputError(f"particles.proposals is {self.proposals}; more than a million take too long.")
        if not 0 <= self.on_support <= 1 or not 0 < self.body_scale <= 1:
            raise InputError("particles.on_support must be from 0 to 1, body_scale above 0 and at most 1.")
        if not 0 <= self.least_unseen_share < self.unseen_share <= 1:
            raise InputError("particles: least_unseen_share must be below unseen_share, both from 0 to 1.")
        if not 0 <= self.inside_share < self.most_inside_share <= 1:
            raise InputError("particles: inside_share must be below most_inside_share, both from 0 to 1.")
        if not self.sizes_m or min(e for size in self.sizes_m for e in size) <= 0:
            raise InputError("particles: there must be at least one size, and all edges must be positive.")


@dataclass(frozen=True)
class HidingConfig:
    """What hides a particle, and what reveals it.

    Attributes:
        plain_share: share of the belief that is spread over all hidden space, whatever fits there, so that no true pose
            is ruled out; 0 for none, 1 for nothing else.
        plain_points: points that stand for that share.
        all_layers: also count each body in sight that the camera's ray meets on its way to the particle, not only the
            object in the picture.
        layer_scale: scale of bodies for that test, about their centres.
        reveal_share: a particle is revealed when this share of its hidden part comes into sight.
        front_share: an object that hides at least this share of a particle may still block its grasps.
    """

    plain_share: float = 0.25
    plain_points: int = 300
    all_layers: bool = True
    layer_scale: float = 0.9
    reveal_share: float = 0.2
    front_share: float = 0.3

    def __post_init__(self) -> None:
        if not 0 <= self.plain_share <= 1 or self.plain_points < 1:
            raise InputError("hiding.plain_share must be from 0 to 1, and plain_points at least 1.")
        if not 0 < self.reveal_share <= 1 or not 0 < self.front_share <= 1:
            raise InputError("hiding: reveal_share and front_share must be above 0 and at most 1.")
        if not 0 < self.layer_scale <= 1:
            raise InputError("hiding.layer_scale must be above 0 and at most 1.")


@dataclass(frozen=True)
class OpeningConfig:
    """The chance of grasping a blocked object once others are gone.

    Fitted to 8,942 blocked objects of 96 generated scenes, each before and after a removal (docs/task_planners.md). s
    is the number of its grasps, each counted as `nearly` to the power of its remaining blockers (the scene then looks
    different, and other grasps are found). q is the probability of the best grasp that nothing blocks any more, 0 if
    there is none.

    Attributes:
        there: it has a valid grasp with a probability whose logit is a + b ln(s + .05) + c q.
        holds: the best one then holds with a + b ln(s + .05) + c q. It is more than q, which accounts for the clutter.
    """

    nearly: float = 0.1
    there: tuple[float, float, float] = (-2.18, 1.03, 3.22)
    holds: tuple[float, float, float] = (0.697, 0.055, 0.138)

    def __post_init__(self) -> None:
        if not 0 <= self.nearly <= 1:
            raise InputError("prices.opening.nearly is from 0 to 1.")


@dataclass(frozen=True)
class PriceConfig:
    """What things cost, in picks.

    Attributes:
        hold: a removal costs 1 / p(hold) picks. Off: 1 pick, whatever its grasp.
        dropped: removing an object while others lie on it, for each of them.
        loaded: taking the target while objects lie on it, for each of them.
        fallen: removing an object on which the hidden target lies; 0 to leave that out.
        lost_share: share of the failed tries with the target that lose it, and with it all picks that are left.
        still_blocking: probability that an object which hides much of a particle still blocks the target's grasps once
            it is in sight.
        missing: price of each further removal needed when a plan counts on a grasp that is blocked now and turns out to
            be missing.
        opening: the probability that it is there.
        detour: factor on the direct cost of what is still hidden where the search ends: other places come first.
        worth_waiting: a graspable target waits only if clearing something first saves more than this.
    """

    hold: bool = True
    dropped: float = 1.5
    loaded: float = 4.0
    fallen: float = 0.5
    lost_share: float = 0.15
    still_blocking: float = 0.5
    missing: float = 1.0
    opening: OpeningConfig = field(default_factory=OpeningConfig)
    detour: float = 1.5
    worth_waiting: float = 0.25

    def __post_init__(self) -> None:
        prices = self.dropped, self.loaded, self.fallen, self.missing, self.detour, self.worth_waiting
        if min(prices) < 0:
            raise InputError("prices must not be negative.")
        if not all(0 <= p <= 1 for p in (self.lost_share, self.still_blocking)):
            raise InputError("prices: lost_share and still_blocking are from 0 to 1.")


MAX_CANDIDATES = 16


@dataclass(frozen=True)
class SearchConfig:
    """How far ahead the search looks.

    Attributes:
        candidates: most objects whose removal is considered; those that hide most come first.
        depth: removals that it looks ahead; 1 is greedy.
        least_share: objects that hide a smaller share of the belief are not candidates, unless they block one.
    """

    candidates: int = 12
    depth: int = 4
    least_share: float = 0.02

    def __post_init__(self) -> None:
        if not 1 <= self.candidates <= MAX_CANDIDATES or self.depth < 1:
            raise InputError(f"search.candidates must be from 1 to {MAX_CANDIDATES}, and depth at least 1.")


@dataclass(frozen=True)
class GiveUpConfig:
    """When the planner says that the target is not there: no unseen place has room for it, and nothing seen may be it.

    Attributes:
        size_m: a target of unknown size may be where a cube of this edge was never seen.
        proposals: cubes drawn at every look.
        presence: probability, before the first look, that the target is on the table.
        below: gives up when the probability that it is there, after all that was seen, falls below this; 0: never.
    """

    size_m: float = 0.015
    proposals: int = 3000
    presence: float = 0.99
    below: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < self.presence <= 1 or not 0 <= self.below < 1:
            raise InputError("give_up: presence must be above 0 and at most 1, below from 0 to less than 1.")
        if self.size_m <= 0 or not 1 <= self.proposals <= 1_000_000:
            raise InputError("give_up: size_m must be positive, and proposals from 1 to a million.")


@dataclass(frozen=True)
class BeliefConfig:
    """Configuration of the planner `belief`; `fallback` configures DG-SELECT, for what the belief cannot decide."""

    particles: ParticleConfig = field(default_factory=ParticleConfig)
    hiding: HidingConfig = field(default_factory=HidingConfig)
    prices: PriceConfig = field(default_factory=PriceConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    give_up: GiveUpConfig = field(default_factory=GiveUpConfig)
    fallback: DgSelectConfig = field(default_factory=DgSelectConfig)

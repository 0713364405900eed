"""The planner `belief`: what it believes, chooses, says and draws."""

import json
from dataclasses import replace

import numpy as np
import pytest

from torc.drawing.belief_picture import draw_belief
from torc.errors import InputError
from torc.geometry.extent import extent
from torc.pipeline.planners import make_planner
from torc.records import BeliefEvidence, Decision, Evidence, KnownObject, PickOutcome, PickResult
from torc.registry.settings import arguments
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.belief.costs import ways_of
from torc.task_planning.belief.hiding import believe
from torc.task_planning.belief.particles import bodies_of, boxes_like, propose, unseen_room
from torc.task_planning.belief.settings import (
    BeliefConfig,
    GiveUpConfig,
    HidingConfig,
    ParticleConfig,
    SearchConfig,
)
from torc.task_planning.belief.target_plans import presence, search_target
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.relations import find_relations
from torc.testing import contexts
from torc.testing.contexts import box, make_context
from torc.testing.planner_conformance import CASES, check_case

CLUTTER = contexts.cluttered_context(12, seed=6, hidden_target=True)


def decide(context, config: BeliefConfig | None = None, seed: int = 0) -> Decision:
    return BeliefPlanner(config).decide(context, np.random.default_rng(seed))


def particles_of(context, config: ParticleConfig, seed: int = 0):
    bodies = bodies_of(context.scene, context.volume)
    return bodies, propose(context.volume, bodies, config, np.random.default_rng(seed))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_conforms(case):
    check_case(BeliefPlanner, case)


GREEDY = BeliefConfig(search=SearchConfig(depth=1))
ABLATIONS = {
    "particles.proposals": 2000,
    "particles.told_size": False,
    "particles.most_inside_share": 1.0,
    "particles.on_support": 1.0,
    "hiding.plain_share": 0.0,
    "hiding.all_layers": False,
    "prices.hold": False,
    "prices.dropped": 0.0,
    "prices.loaded": 0.0,
    "prices.fallen": 0.0,
    "prices.still_blocking": 0.0,
    "search.depth": 1,
    "give_up.below": 0.0,
}


@pytest.mark.parametrize("setting", ABLATIONS)
def test_every_ingredient_can_be_switched_off(setting):
    config = arguments(BeliefPlanner, {setting: ABLATIONS[setting]}, "planner")["config"]
    assert config != BeliefConfig()
    assert decide(CLUTTER, config).object_id in CLUTTER.report.graspable_ids
    assert make_planner("belief", config=config).name == "belief"


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: ParticleConfig(proposals=0),
        lambda: ParticleConfig(sizes_m=((0.1, 0.0, 0.1),)),
        lambda: ParticleConfig(least_unseen_share=0.95),
        lambda: HidingConfig(plain_share=1.5),
        lambda: SearchConfig(candidates=40),
        lambda: GiveUpConfig(presence=0.0),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError):
        wrong()


def test_particles_lie_in_space_that_was_never_seen():
    config = ParticleConfig(unseen_share=1.0, least_unseen_share=0.99)
    _, particles = particles_of(contexts.hidden_context(), config)
    assert len(particles) > 50
    assert particles.weights.sum() == pytest.approx(1.0)
    volume = contexts.hidden_context().volume
    index = volume.grid.index_of(particles.poses[:, :3])
    assert not volume.seen[tuple(index.T)].any()
    assert (particles.poses[:, 2] - particles.poses[:, 5] >= volume.grid.origin[2] - 1e-9).all()


def test_what_a_later_look_shows_to_be_free_holds_no_particle():
    """The volume's memory is all the update: what is seen now is no place any more."""
    context = contexts.hidden_context()
    bodies, before = particles_of(context, ParticleConfig())
    seen = context.volume.seen.copy()
    seen[:, : seen.shape[1] // 2] = True
    now = replace(context.volume, seen=seen, hidden_by=np.where(seen, 0, context.volume.hidden_by))
    after = propose(now, bodies, ParticleConfig(), np.random.default_rng(0))
    middle = now.grid.origin[1] + now.grid.voxel_size_m * (seen.shape[1] // 2)
    assert (before.poses[:, 1] < middle).any()
    assert (after.poses[:, 1] >= middle).all()
    same = [
        propose(v, bodies, ParticleConfig(), np.random.default_rng(0), (0.1, 0.07)).room
        for v in (context.volume, now)
    ]
    assert 0 <= same[1] < same[0] < 1
    rooms = [unseen_room(v, bodies, 0.015, 3000, np.random.default_rng(0)) for v in (context.volume, now)]
    assert 0 <= rooms[1] < rooms[0] < 1


def test_the_plain_share_rules_no_hidden_voxel_out():
    context = contexts.hidden_context()
    bodies, particles = particles_of(context, ParticleConfig())
    eye = context.scene.observation.T_world_camera[:3, 3]
    rng = np.random.default_rng(0)
    belief = believe(particles, context.volume, bodies, eye, HidingConfig(plain_share=0.2), rng)
    assert belief.weights.sum() == pytest.approx(1.0)
    assert belief.weights[belief.fitting :].sum() == pytest.approx(0.2)
    index = context.volume.grid.index_of(belief.poses[belief.fitting :, :3])
    assert (context.volume.hidden_by[tuple(index.T)] != 0).all()


def test_layers_behind_the_front_one_count():
    """A box looks out above another one: much of what it hides is hidden by that one in the picture."""
    shapes = (box(1, 0.55, 0.0, (0.06, 0.16, 0.20)), box(2, 0.64, 0.0, (0.06, 0.12, 0.24)))
    context = make_context(shapes, valid={1: 2, 2: 2})
    bodies, particles = particles_of(context, ParticleConfig())
    eye = context.scene.observation.T_world_camera[:3, 3]
    beliefs = [
        believe(particles, context.volume, bodies, eye, HidingConfig(all_layers=on), np.random.default_rng(0))
        for on in (True, False)
    ]
    deep, flat = (b.mass_behind() for b in beliefs)
    assert deep[2] > flat[2] + 0.1
    np.testing.assert_allclose(flat, beliefs[1].mass_hidden(), atol=1e-9)


def test_it_looks_behind_the_largest_shadow_and_says_so():
    decision = decide(contexts.hidden_context())
    assert decision.object_id == 1
    assert decision.evidence.rule == "search"
    assert decision.reason.startswith("Pick 1: with it gone the target comes into sight with p = ")
    evidence = json.loads(json.dumps(decision.evidence.to_plain(), allow_nan=False))["belief"]
    assert evidence["order"][0] == 1
    assert evidence["reveals"]["1"] > evidence["reveals"].get("2", 0.0)
    assert sum(share for _, _, share in evidence["tiles"]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_the_same_seed_gives_the_same_decision(seed):
    assert decide(CLUTTER, seed=seed) == decide(CLUTTER, seed=seed)


@pytest.mark.parametrize("most", [1, 3])
def test_what_no_candidate_hides_takes_longer_than_all_of_them(most):
    ways = ways_of(CLUTTER, find_relations(CLUTTER.scene, BeliefConfig().fallback.relations))
    few = BeliefConfig(search=SearchConfig(candidates=most))
    search = search_target(CLUTTER, ways, few, np.random.default_rng(0))
    shares = search.places.beyond, float(search.places.weights.sum())
    assert sum(shares) == pytest.approx(1.0)
    assert min(shares) > 0.1
    assert search.expected_picks > search.plan.price + search.places.beyond * (most + 1)
    assert decide(CLUTTER, few).reason.endswith(f"About {search.expected_picks:.1f} picks to the target.")


def test_a_target_that_can_be_grasped_is_taken_and_what_lies_on_it_goes_first():
    assert decide(contexts.open_context()).object_id == 0
    assert decide(contexts.stacked_context()).object_id == 1
    decision = decide(contexts.behind_context())
    assert decision.object_id == 1
    assert decision.evidence.belief.order == (1,)


def test_a_target_that_is_deep_down_is_made_way_for():
    """0 waits for 1, 1 for 2, and 2 for 3: more than a greedy search can see."""
    shapes = [box(k, 0.55 + 0.08 * (k % 2), -0.3 + 0.15 * k, (0.04, 0.04, 0.06)) for k in range(5)]
    blocked = {0: [(1,)], 1: [(2,)], 2: [(3,)]}
    context = make_context(shapes, valid={3: 2, 4: 5}, blocked=blocked)
    decision = decide(context)
    assert decision.evidence.belief.order == (3, 2, 1)
    assert "once 3, 2 and 1 are gone the target 0 can be taken" in decision.reason
    greedy = decide(make_context(shapes, valid={1: 1, 4: 5}, blocked={0: [(1, 2)], 2: [(4,)]}), GREEDY)
    assert greedy.object_id == 1
    assert "still blocked" in greedy.reason


def test_where_it_does_not_know_it_chooses_as_dg_select():
    rng = np.random.default_rng(0)
    few = BeliefConfig(ParticleConfig(fewest=10**6))
    assert decide(CLUTTER, few).object_id == DgSelectPlanner().decide(CLUTTER, rng).object_id
    assert "too few places" in decide(CLUTTER, few).evidence.notes["by_graph_because"]
    stuck = contexts.nothing_graspable_context()
    assert decide(stuck).object_id is None
    assert not decide(stuck).give_up


def test_it_gives_up_when_all_has_been_seen_and_not_before():
    flat = make_context((box(1, 0.60, -0.1, (0.05, 0.05, 0.012)),), valid={1: 2})
    decision = decide(flat)
    assert decision.give_up
    assert decision.object_id is None
    assert "not in sight" in decision.reason
    assert not decide(flat, BeliefConfig(give_up=GiveUpConfig(below=0.0))).give_up
    assert not decide(contexts.hidden_context()).give_up


@pytest.mark.parametrize(
    ("target_p", "gives_up"),
    [
        ({1: 0.012}, False),
        ({1: 0.008}, True),
        ({1: 0.0}, False),
        ({5: 0.5, 1: 0.008}, True),
        ({7: 0.02, 1: 0.008}, False),
    ],
)
def test_it_does_not_give_up_while_something_that_is_there_may_be_the_target(target_p, gives_up):
    """Objects 5 and 7 were seen before, and are not in sight: 5 has been brought, as has another object 1 than the one
    that is called so now.
    """
    flat = make_context((box(1, 0.60, -0.1, (0.05, 0.05, 0.012)),), valid={1: 2})
    none = np.zeros((0, 3), np.float32)
    known = tuple(KnownObject(k, none, np.ones(1, np.float32), 1.0, target_p=p) for k, p in target_p.items())
    brought = [PickOutcome(PickResult.REMOVED, k, k, True, True) for k in (5, 1)]
    missed = PickOutcome(PickResult.MISSED, 7, None, False, False)
    decision = decide(replace(flat, scene=replace(flat.scene, known=known), history=(*brought, missed)))
    assert decision.give_up == gives_up
    assert decision.evidence.belief.suspects == {k: p for k, p in target_p.items() if k == 1 and p > 0.01}


def test_it_gives_up_as_soon_as_there_is_no_room_for_a_target_of_that_size():
    context = contexts.hidden_context()
    told = [decide(replace(context, target_size_m=size_m)) for size_m in ((0.05, 0.04), (0.9, 0.5))]
    assert [d.give_up for d in told] == [False, True]
    unused = BeliefConfig(ParticleConfig(told_size=False))
    assert not decide(replace(context, target_size_m=(0.9, 0.5)), unused).give_up


@pytest.mark.parametrize("edges", [(0.03, 0.06, 0.2), (0.05, 0.05, 0.12), (0.02, 0.14, 0.20)])
def test_boxes_like_a_target_are_as_long_and_as_thick(edges):
    corners = np.array(np.meshgrid(*([-0.5, 0.5] * np.array(edges)[:, None]))).reshape(3, -1).T
    length_m, thickness_m = extent(corners)
    for box_m in boxes_like(length_m, thickness_m):
        assert np.linalg.norm(box_m) == pytest.approx(np.linalg.norm(edges), rel=0.03)
        assert np.linalg.norm(np.sort(box_m)[:2]) == pytest.approx(np.linalg.norm(edges[:2]), rel=0.03)
    flat = boxes_like(0.2, 0.2)
    assert all(min(b) > 0.01 and max(b) < 0.2 for b in flat)


def test_presence_follows_bayes_rule():
    """Half of the places unseen: 0.9 * 0.5 against 0.1."""
    assert presence(0.5, GiveUpConfig(presence=0.9)) == pytest.approx(0.45 / 0.55)
    assert presence(0.0, GiveUpConfig()) == 0.0
    assert presence(0.3, GiveUpConfig(presence=1.0)) == pytest.approx(1.0)


def test_the_plan_looks_no_further_than_there_are_picks():
    last = replace(CLUTTER, picks_left=2)
    ways = ways_of(last, find_relations(last.scene))
    assert len(search_target(last, ways, BeliefConfig(), np.random.default_rng(0)).order) == 1


def test_the_picture_is_warm_where_the_belief_is():
    context = contexts.hidden_context()
    decision = decide(context)
    image = draw_belief(decision, context.scene)
    assert image.shape == (*context.scene.label_image.shape, 3)
    tiles, px = np.array(decision.evidence.belief.tiles), decision.evidence.belief.tile_px
    row, col, _ = tiles[tiles[:, 2].argmax()]
    cold = draw_belief(
        replace(
            decision, evidence=Evidence(belief=BeliefEvidence((1,), 1, tile_px=px, tiles=((0, 0, 1.0),)))
        ),
        context.scene,
    )
    at = (slice(int(row) * px, int(row + 1) * px), slice(int(col) * px, int(col + 1) * px))
    assert image[at].astype(float)[..., 0].mean() > cold[at].astype(float)[..., 0].mean() + 30


@pytest.mark.parametrize(
    "belief",
    [
        None,
        BeliefEvidence((1,), 2.0),
        BeliefEvidence((1,), 2.0, tile_px=8),
        BeliefEvidence((1,), 2.0, tile_px=0, tiles=((1, 1, 1.0),)),
    ],
)
def test_a_belief_without_places_is_not_drawn(belief):
    scene = contexts.open_context().scene
    assert draw_belief(Decision(1, "mine", evidence=Evidence(belief=belief)), scene) is None

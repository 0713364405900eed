"""What a robot knows of a pick, and what only the simulator does."""

from torc.records import FeltOutcome, PickOutcome, PickResult, Touch

TOUCH = Touch((0.1, 0.2), 0.05)


def test_a_robot_knows_what_it_felt_and_how_its_arm_was():
    truth = PickOutcome(
        PickResult.SLIPPED,
        3,
        held_id=5,
        held_after_lift=True,
        dropped=(5, 6),
        target_lost=True,
        detail="finger on object 5",
        duration_s=9.0,
        at_home=False,
        touch=TOUCH,
        felt=FeltOutcome(PickResult.REMOVED, True, True),
    )
    told = PickOutcome(PickResult.REMOVED, 3, 3, True, True, duration_s=9.0, at_home=False, touch=TOUCH)
    assert truth.as_felt == told
    assert told.as_felt == told

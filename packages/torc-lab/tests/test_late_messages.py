"""Messages that come late, twice, out of order, or from before: nothing moves that was not checked, nothing hangs."""

import json
import time
from contextlib import suppress

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm
from test_supervisor import QUICK, motion, supervised
from torc_lab.protocols import LabError
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.ros.messages import Arrivals, duration
from torc_lab.simple_message.arm import MotomanArm, MotomanConfig
from torc_lab.simple_message.messages import Comm, Command, Frame, Kind, MotionReply, Result
from torc_lab.twin.motoman import MotomanTwin
from torc_lab.twin.ros import RosTwin

MANY = 10_000


def ros_arm(twin):
    names = tuple(twin.joint_names)
    arm = RosArm(RosArmConfig(twin.url, twin.ros, twin.action, names, start_tolerance_rad=0.05))
    arm._proven = True
    return arm


def result(ros, action, goal, status):
    if ros == 2:
        values = {"error_code": 0, "error_string": ""}
        return {"op": "action_result", "action": action, "id": goal, "status": status, "values": values}
    told = {"status": {"goal_id": {"id": goal}, "status": status, "text": ""}, "result": {"error_code": 0}}
    return {"op": "publish", "topic": f"{action}/result", "msg": told}


@pytest.mark.parametrize("ros", [1, 2])
def test_ten_thousand_messages_of_ros_never_end_another_goal_nor_bring_an_old_place_back(ros, robot, rng):
    """Against a model: the newest place by its own stamp counts, and a goal ends by its own final status alone."""
    pytest.importorskip("websockets")
    rest, done, going = robot.arm.rest_qpos, {1: 3, 2: 4}[ros], {1: 1, 2: 2}[ros]
    with RosTwin(ObedientArm(rest), robot.arm.joint_names, ros) as twin:
        arm = ros_arm(twin)
        twin.silent = True
        time.sleep(0.1)
        sent = []
        arm._bridge._send = sent.append
        began, newest, place = time.time() + 1, 0.0, rest
        goals, ended, backlog = [], "", []
        for step in range(MANY):
            if step % 100 == 0:
                arm._send(motion(rest))
                goals, ended = [*goals[-5:], arm._goal], None
            stamp = began + 0.01 * step
            here = rest + 1e-6 * step
            names, positions = list(robot.arm.joint_names), here.tolist()
            header = {"stamp": duration(stamp, ros)}
            fresh = {"op": "publish", "topic": "/joint_states"}
            fresh["msg"] = {"header": header, "name": names, "position": positions}
            backlog = [*backlog[-50:], (stamp, here, fresh)]
            kind = rng.random()
            if kind < 0.7:  # fresh, or one from before, or one of the last again
                stamp, here, message = backlog[-1 if kind < 0.35 else int(rng.integers(len(backlog)))]
                if stamp > newest:
                    newest, place = stamp, here
            else:
                goal = goals[int(rng.integers(len(goals)))] if kind < 0.95 else "nobody's"
                status = int(rng.choice([going, done, 5]))
                message = result(ros, twin.action, goal, status)
                if goal == goals[-1] and ended is None:  # the first counts
                    unfinished = None if ros == 1 else "another end"
                    ended = {done: "", going: unfinished}.get(status, "another end")
            arm._bridge._take(json.dumps(message))
            if newest:
                np.testing.assert_allclose(arm.status().qpos, place, atol=1e-12)
            found = arm.ended()
            assert (found if found in ("", None) else "another end") == ended, step
        assert (
            len([r for r in sent if "goal" in str(r) and r["op"] in ("publish", "send_action_goal")])
            == MANY // 100
        )
        arm.close()


def test_what_comes_late_is_as_old_as_it_is():
    arrivals = Arrivals()

    def state(at):
        return {"header": {"stamp": {"sec": int(at), "nanosec": round((at % 1) * 1e9)}}}

    apart = -5_000.0  # of the clocks
    for k in range(100):
        at = 10_000 + 0.02 * k
        late = 0.0 if k < 50 else 0.8
        _, stamp_s = arrivals.take(state(at), at + apart + 0.01 + late)
        age_s = at + apart + 0.01 + late - stamp_s
        assert age_s == pytest.approx(late, abs=0.005)
    message, before = arrivals.take(state(10_000.5), 1e6)  # from before: not taken
    assert message == state(10_000 + 0.02 * 99)
    assert arrivals.take(message, 2e6)[1] == before
    assert arrivals.take({"name": []}, 7.0) == ({"name": []}, 7.0)
    for broken in (
        None,
        {"header": 3},
        {"header": {"stamp": {"sec": "x"}}},
        {"header": {"stamp": {"sec": 0}}},
    ):
        assert arrivals.take(broken, 8.0)[1] == 8.0


class Tangle:
    """What a server says, delayed, doubled and out of order at random."""

    def __init__(self, send, rng, share):
        self.send, self.rng, self.share, self.held = send, rng, share, []

    def __call__(self, connection, message):
        self.held.append(message)
        if self.rng.random() < self.share and len(self.held) < 40:
            return
        if self.rng.random() < self.share:
            self.rng.shuffle(self.held)
        for one in [*self.held, *(self.held[-1:] if self.rng.random() < self.share else [])]:
            self.send(connection, one)
        self.held.clear()


@pytest.mark.long
@pytest.mark.parametrize("ros", [1, 2])
def test_on_the_wire_of_ros_a_motion_ends_well_or_in_an_error_and_no_other_begins(ros, robot, rng):
    pytest.importorskip("websockets")
    with RosTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.joint_names, ros) as twin:
        say = twin._say
        for _ in range(12):
            twin._say = say
            arm = ros_arm(twin)
            twin._say = Tangle(say, rng, rng.choice([0.3, 0.8, 0.97]))
            check_motion(arm, robot, twin.arm, lambda: goals_heard(twin))
            arm.close()


def goals_heard(twin):
    goals = [h for h in twin.heard if "goal" in str(h) and h["op"] != "advertise"]
    return len([h for h in goals if "cancel" not in str(h.get("op")) + str(h.get("topic", ""))])


def check_motion(arm, robot, behind, motions):
    """It ends soon; at most this one motion was sent; the arm is on its way, or at an end of it."""
    began, here, before = time.monotonic(), behind.qpos.copy(), motions()
    watched = supervised(arm, robot)
    watched.config = QUICK  # a pause of a busy machine is an error here, too, and that is an end
    with suppress(LabError):
        watched.follow(motion(here, by=0.02))
    assert time.monotonic() - began < 6
    assert motions() - before <= 1
    gone = behind.qpos - here
    assert -1e-6 < gone[0] < 0.0201
    assert np.abs(gone[1:]).max() < 1e-6


def replies(order, sequence, command, rng, past):
    """One reply: the right one, or one from before, or one of something else."""
    right = MotionReply(1, sequence, command, Result.SUCCESS, 0)
    kind = rng.random()
    if kind < 0.9:
        return right
    if kind < 0.95 and past:
        return past[int(rng.integers(len(past)))]
    return MotionReply(1, int(rng.integers(0, 50)), int(rng.choice([14, *Command])), Result.SUCCESS, 0)


def test_ten_thousand_replies_of_simple_message_are_taken_for_their_own_request_alone(robot, rng):
    with MotomanTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.max_speed) as twin:
        motion_port, state_port = twin.ports
        arm = MotomanArm(MotomanConfig("127.0.0.1", 1, motion_port, state_port), 7)
        told, asked = [], []

        class Scripted:
            def ask(self, frame):
                numbers = np.frombuffer(frame.body, ">i4", 3)
                point = frame.kind == Kind.JOINT_TRAJ_PT_FULL
                sequence = int(numbers[1])
                command = frame.kind if point else int(numbers[2])
                reply = replies("big", sequence, command, rng, told)
                asked.append((sequence, command))
                told.append(reply)
                return Frame(Kind.MOTION_REPLY, Comm.REPLY, reply.pack("big"), reply=1)

            def close(self):
                return None

        real, arm._motion = arm._opened(), Scripted()
        path, refused, nothing = motion(robot.arm.rest_qpos), 0, arm._cancelled
        for _ in range(MANY):
            before = len(told)
            try:
                if rng.random() < 0.5:
                    arm._send(path, int(rng.integers(0, 30)), nothing)
                else:
                    arm._command(rng.choice([Command.CHECK_QUEUE_COUNT, Command.STOP_MOTION]))
                accepted = True
            except LabError:
                accepted, refused, arm.lost = False, refused + 1, ""
            assert len(told) == before + 1
            assert accepted == ((told[-1].sequence, told[-1].command) == asked[-1])
            del told[:-30]
            del asked[:-30]
        assert 200 < refused < 2000
        real.close()
        arm.close()


@pytest.mark.long
def test_on_the_wire_of_simple_message_doubled_and_late_replies_end_in_an_error(robot, rng):
    behind = ObedientArm(robot.arm.rest_qpos)
    with MotomanTwin(behind, robot.arm.max_speed) as twin:
        answer, first = twin._answer, Kind.JOINT_TRAJ_PT_FULL
        for _ in range(12):
            twin._answer = answer
            twin.state = type(twin.state)(1, 0, 0, 0, 0, 2, 1)
            motion_port, state_port = twin.ports
            arm = MotomanArm(MotomanConfig("127.0.0.1", 1, motion_port, state_port, 0.5), 7)
            past, share = [], rng.choice([0.0, 0.05, 0.3])

            def tangled(frame, past=past, share=share):
                past.append(answer(frame))
                if rng.random() < share:
                    return past[int(rng.integers(len(past)))]
                if rng.random() < 0.1 * share:
                    time.sleep(0.7)
                return past[-1]

            twin._answer = tangled
            check_motion(arm, robot, behind, lambda: starts(twin, first))
            with suppress(LabError):
                arm.stop()
            arm.close()
            twin._points = []
            time.sleep(0.05)


def starts(twin, kind):
    """How many trajectories were begun: the first point has number 0."""
    return len([f for f in twin.heard if f.kind == kind and np.frombuffer(f.body, ">i4", 2)[1] == 0])

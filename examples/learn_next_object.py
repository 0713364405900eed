"""Learns which object to pick next: a linear softmax policy over the objects' features, by REINFORCE, in NumPy alone.

    torc problems generate --count 20 --seed 5000 --out practice
    cd examples
    python learn_next_object.py --problems ../practice --held-out validation --curve curve.svg

It is the smallest thing that learns, meant to show the environment, not to win. It plays on one set of problems and is
judged on another, with the same seeds each time, beside RANDOM. An episode takes 5 to 10 s.
"""

import argparse
import importlib.util
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import gymnasium
import numpy as np
from scipy.stats import t

from torc.gym_env.env import PER_OBJECT, stacked

_LONGEST_PATH = 4
_TARGET = PER_OBJECT.index("target")


class LinearPolicy:
    """p(object) = softmax(features @ weights) over the objects that can be picked; at first all of them alike."""

    def __init__(self, features: int) -> None:
        self.weights = np.zeros(features)

    def probabilities(self, rows: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Of each object id. Where nothing can be picked, every id is a lost pick, and none is masked."""
        mask = mask.astype(bool) if mask.any() else np.ones(len(mask), dtype=bool)
        scores = np.where(mask, rows @ self.weights, -np.inf)
        p = np.exp(scores - scores.max())
        return p / p.sum()

    def gradient(self, rows: np.ndarray, mask: np.ndarray, action: int) -> np.ndarray:
        """Of log p(action) by the weights."""
        return rows[action] - self.probabilities(rows, mask) @ rows


def random_policy(features: int) -> LinearPolicy:
    """RANDOM of torc: the target if it can be picked, else anything that can."""
    policy = LinearPolicy(features)
    policy.weights[_TARGET] = 100.0
    return policy


def features(observation: dict[str, np.ndarray]) -> np.ndarray:
    """A row per object id: the environment's, and two of the dependency graph.

    These are how much the target waits for the object by way of others (the sum over paths of up to _LONGEST_PATH edges
    of the product of their weights), and for how much the object itself waits. One column for direct edges alone would
    say nothing of what blocks that which blocks the target.
    """
    edges = observation["edges"].astype(float)
    reached, waits = observation["target"].astype(float), np.zeros(len(edges))
    for _ in range(_LONGEST_PATH):
        reached = reached @ edges
        waits += reached
    return np.column_stack([stacked(observation), waits, edges.sum(axis=1)])


class Baseline:
    """What to expect of a state, whatever is done in it: ridge regression of the rewards to come on its features."""

    def __init__(self) -> None:
        self._states: list[np.ndarray] = []
        self._to_go: list[float] = []

    def add(self, states: Sequence[np.ndarray], to_go: Sequence[float]) -> None:
        """What came of states."""
        self._states += states
        self._to_go += to_go

    def advantages(self, states: Sequence[np.ndarray], to_go: np.ndarray) -> np.ndarray:
        """How much better it went than expected, in standard deviations of what is not foreseen; 0 at first."""
        if not self._states:
            return np.zeros(len(to_go))
        x, y = np.array(self._states), np.array(self._to_go)
        weights = np.linalg.solve(x.T @ x + np.eye(x.shape[1]), x.T @ y)
        return (to_go - np.array(states) @ weights) / max(1.0, float(np.std(y - x @ weights)))


def state_of(observation: dict[str, np.ndarray], rows: np.ndarray) -> np.ndarray:
    """A constant, the picks left, and the sums of the objects' features (a tenth, to be near 1)."""
    return np.concatenate(
        [[1.0], observation["picks_left"], rows[observation["visible"] > 0].sum(axis=0) / 10]
    )


@dataclass
class Played:
    """An episode: per pick the gradient, the state and the reward; the last info."""

    gradients: list[np.ndarray]
    states: list[np.ndarray]
    rewards: list[float]
    info: dict

    @property
    def broke(self) -> bool:
        """The simulation broke: it says nothing."""
        return "error" in self.info

    def cost(self, max_picks: int) -> int:
        """Picks to retrieval; without the target the whole budget, as torc report counts."""
        return self.info["picks"] if self.info["is_success"] else max_picks


def play(
    env: gymnasium.Env, policy: LinearPolicy, rng: np.random.Generator, options: dict | None = None
) -> Played:
    """One episode; `options` as of reset."""
    played, done = Played([], [], [], {}), False
    observation, info = env.reset(options=options)
    while not done:
        rows, mask = features(observation), info["action_mask"]
        action = int(rng.choice(len(mask), p=policy.probabilities(rows, mask)))
        played.gradients.append(policy.gradient(rows, mask, action))
        played.states.append(state_of(observation, rows))
        observation, reward, terminated, truncated, info = env.step(action)
        played.rewards.append(float(reward))
        done = terminated or truncated
    played.info = info
    return played


def learn(
    env: gymnasium.Env, policy: LinearPolicy, episodes: int, rate: float, seed: int
) -> Iterator[Played]:
    """REINFORCE: changes the policy after each episode, and yields the episode."""
    rng, baseline = np.random.default_rng(seed), Baseline()
    env.reset(seed=seed)
    for _ in range(episodes):
        played = play(env, policy, rng)
        if not played.broke:
            to_go = np.cumsum(played.rewards[::-1])[::-1]
            for gradient, value in zip(played.gradients, baseline.advantages(played.states, to_go)):
                policy.weights += rate * value * gradient
            baseline.add(played.states, to_go.tolist())
        yield played


@dataclass(frozen=True)
class Judged:
    """Picks to retrieval on the held-out problems: the mean, its 95 % interval over problems, and how many were got."""

    cost: float
    low: float
    high: float
    retrieved: float

    def __str__(self) -> str:
        return f"picks to retrieval {self.cost:5.2f} [{self.low:.2f}, {self.high:.2f}]   retrieved {self.retrieved:.2f}"


def judge(env: gymnasium.Env, policy: LinearPolicy, repeats: int) -> Judged:
    """Play every problem of an environment with the same seeds each time; broken episodes do not count."""
    inner = env.unwrapped
    costs, retrieved = [], []
    for problem in inner.problems:
        episodes = [
            play(env, policy, np.random.default_rng(seed), {"problem": problem, "episode_seed": seed})
            for seed in range(repeats)
        ]
        whole = [p for p in episodes if not p.broke]
        if whole:
            costs.append(np.mean([p.cost(inner.max_picks) for p in whole]))
            retrieved.append(np.mean([p.info["is_success"] for p in whole]))
    half = (
        t.ppf(0.975, max(1, len(costs) - 1)) * np.std(costs, ddof=1) / np.sqrt(len(costs))
        if len(costs) > 1
        else 0.0
    )
    mean = float(np.mean(costs))
    return Judged(mean, mean - half, mean + half, float(np.mean(retrieved)))


def draw(path: str, costs: Sequence[float], points: dict[int, Judged], random: Judged) -> None:
    """The learning curve as a picture: practice as it went, the held-out problems now and then, RANDOM on these."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplots()
    window = min(20, len(costs))
    smooth = np.convolve(costs, np.ones(window) / window, "valid")
    axes.plot(
        np.arange(window, len(costs) + 1),
        smooth,
        color="#999999",
        label=f"practice, mean of {window} episodes",
    )
    axes.axhspan(random.low, random.high, color="#e69f00", alpha=0.15, linewidth=0)
    axes.axhline(random.cost, color="#e69f00", linestyle="--", label="RANDOM, held-out problems")
    at, means = list(points), np.array([p.cost for p in points.values()])
    ends = [means - [p.low for p in points.values()], np.array([p.high for p in points.values()]) - means]
    axes.errorbar(at, means, ends, color="#0072b2", marker="o", capsize=4, label="learner, held-out problems")
    axes.set(xlabel="episodes of practice", ylabel="picks to retrieval", ylim=(0, None))
    axes.legend(frameon=False, fontsize=8, loc="lower left")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None)


def main() -> None:
    """Parse the command line, learn, and judge now and then."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--problems", required=True, help="to practise on: sets, problems, files, directories"
    )
    parser.add_argument("--held-out", default="validation", help="to judge on, the like")
    parser.add_argument("--episodes", type=int, default=120)
    parser.add_argument("--rate", type=float, default=0.2, help="step size")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--judge-every", type=int, default=40, help="episodes")
    parser.add_argument("--repeats", type=int, default=2, help="episodes per held-out problem")
    parser.add_argument(
        "--curve", help="draw the learning curve into this file, e.g. curve.svg (needs matplotlib)"
    )
    a = parser.parse_args()
    if a.curve and importlib.util.find_spec("matplotlib") is None:
        parser.error("--curve needs matplotlib: scripts/setup report")
    env, held_out = (
        gymnasium.make("torc.gym_env:torc/Retrieval-v0", problems=p) for p in (a.problems, a.held_out)
    )
    policy = LinearPolicy(features(env.observation_space.sample()).shape[1])
    random = judge(held_out, random_policy(len(policy.weights)), a.repeats)
    points = {0: judge(held_out, policy, a.repeats)}
    print(f"RANDOM          {random}\nepisode      0   {points[0]}", flush=True)
    costs: list[float] = []
    for episode, played in enumerate(learn(env, policy, a.episodes, a.rate, a.seed), start=1):
        if not played.broke:
            costs.append(played.cost(env.unwrapped.max_picks))
        if episode % a.judge_every == 0 or episode == a.episodes:
            points[episode] = judge(held_out, policy, a.repeats)
            print(
                f"episode {episode:6d}   {points[episode]}   weights {np.round(policy.weights, 2).tolist()}",
                flush=True,
            )
            if a.curve:
                draw(a.curve, costs, points, random)
    env.close()
    held_out.close()


if __name__ == "__main__":
    main()

"""Learns which object to pick next: a linear softmax policy over the objects' features, by REINFORCE, in NumPy alone.

    cd examples
    python learn_next_object.py --problems validation --episodes 300

It is the smallest thing that learns, meant to show the environment, not to win. An episode takes 10 s or more, and
returns differ by several picks from one to the next: expect some hundred episodes before the curve says anything. A few
only show that everything works.
"""

import argparse

import gymnasium
import numpy as np

from torc.gym_env.features import stacked


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


def play(env: gymnasium.Env, policy: LinearPolicy, rng: np.random.Generator) -> tuple[list, list, dict]:
    """One episode: the gradients and the rewards of its picks, and the last info."""
    gradients, rewards, done = [], [], False
    observation, info = env.reset()
    while not done:
        rows, mask = stacked(observation), info["action_mask"]
        action = int(rng.choice(len(mask), p=policy.probabilities(rows, mask)))
        gradients.append(policy.gradient(rows, mask, action))
        observation, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        done = terminated or truncated
    return gradients, rewards, info


def learn(env: gymnasium.Env, episodes: int, rate: float, seed: int, report_every: int) -> LinearPolicy:
    """REINFORCE with the mean return so far as the baseline; prints a line every few episodes."""
    rng = np.random.default_rng(seed)
    observation, _ = env.reset(seed=seed)
    policy = LinearPolicy(stacked(observation).shape[1])
    returns: list[float] = []
    picks: list[int] = []
    retrieved: list[bool] = []
    for episode in range(1, episodes + 1):
        gradients, rewards, info = play(env, policy, rng)
        if "error" in info:  # the simulation broke: nothing to learn from
            continue
        to_go = np.cumsum(rewards[::-1])[::-1]
        baseline = np.mean(returns) if returns else to_go[0]
        for gradient, value in zip(gradients, to_go):
            policy.weights += rate * (value - baseline) * gradient
        returns.append(float(to_go[0]))
        picks.append(info["picks"])
        retrieved.append(info["is_success"])
        if episode % report_every == 0 or episode == episodes:
            last = slice(-report_every, None)
            print(
                f"episode {episode:5d}   of the last {len(returns[last])}: return {np.mean(returns[last]):7.2f}   "
                f"picks {np.mean(picks[last]):5.2f}   retrieved {np.mean(retrieved[last]):.2f}",
                flush=True,
            )
    return policy


def main() -> None:
    """Parse the command line and learn."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--problems", default="validation", help="sets, problems, files, directories")
    parser.add_argument("--episodes", type=int, default=300)
    parser.add_argument("--rate", type=float, default=0.01, help="step size")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--report-every", type=int, default=20, help="episodes per line of the curve")
    a = parser.parse_args()
    env = gymnasium.make("torc.gym_env:torc/Retrieval-v0", problems=a.problems)
    policy = learn(env, a.episodes, a.rate, a.seed, a.report_every)
    env.close()
    print("weights:", np.round(policy.weights, 3).tolist())


if __name__ == "__main__":
    main()

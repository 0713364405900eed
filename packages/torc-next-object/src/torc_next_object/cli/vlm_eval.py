"""`torc vlm-eval`: test a VLM on the data set torc-next-object."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc import InputError
from torc.cli.options import VlmOptions
from torc.cli.printing import print_json, printable, tell
from torc_next_object.data.opening import CAVEAT, SAMPLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torc import VlmConfig
    from torc_next_object.asking.evaluation import Asked, Row

_EVERY = 10
_YES = ("y", "yes")
_SHOWN_MISTAKES = 24
_OF_EVALUATION = ("variant", "prompt", "prompt_sha256", "data_sha256", "temperature", "thinking")


@dataclass(frozen=True)
class VlmEvalCommand:
    """Ask a VLM which object to remove first, decision by decision, and score its choices.

    No simulation runs: the data set knows the value of every choice. The command estimates tokens and cost, and asks
    before it begins. Each reply is kept as it comes; the same command resumes.

      torc vlm-eval --vlm openai:MODEL@http://localhost:8000/v1 \\
          --out runs/local
      torc vlm-eval --vlm gemini:MODEL --vlm-prices 0.3,2.5 --variant grasps \\
          --limit 50 --data next_object --out runs/gemini

    It writes scores.json (a leaderboard takes it), worst.html (the worst mistakes with their pictures), replies.jsonl
    and failures.jsonl. Regret is 0 for the best choices and 1 for random ones. A reply without a valid number counts as
    a random choice; a question that the server did not answer counts as nothing and is asked again next time.

    Exit code 0 when every question was answered, 1 when some were not, 2 for wrong input.
    """

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Where replies and results go."""
    data: Annotated[str, tyro.conf.arg(metavar="DIR")] = SAMPLE
    """The data set: a folder of Parquet files, or OWNER/NAME on the Hugging Face hub. "sample" names the 60 decisions
    that come with torc, for trying things."""
    variant: Literal["image", "grasps", "relations"] = "image"
    """What the model gets beside the picture: nothing; what is graspable and what blocks what; what seems to stand
    behind what."""
    split: Literal["train", "test", "hidden"] = "test"
    """Part of the data set."""
    limit: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """At most this many decisions, always the same ones; a higher limit in the same --out adds to them."""
    workers: int = 4
    """Questions under way at a time."""
    yes: bool = False
    """Begin without asking."""
    vlm: VlmOptions = field(default_factory=VlmOptions)
    json: Annotated[bool, tyro.conf.arg(help="Print scores.json instead of a table.")] = False

    def run(self) -> int:
        """Evaluate; return the exit code."""
        from torc.pipeline.planners import open_client
        from torc_next_object.asking.evaluation import ask_rows, begin, chosen_rows, data_digest
        from torc_next_object.data.opening import open_rows
        from torc_next_object.prompting import version_of

        config = self._config()
        whole = open_rows(self.data, self.split)
        rows = chosen_rows(whole, self.limit)
        if self.data == SAMPLE:
            tell(f"The data: {len(whole)} decisions that come with torc. {CAVEAT}")
        client = open_client(config, self.vlm.cache())
        digest, version = data_digest(whole, self.variant), version_of(whole[0])
        file, facts = begin(self.out, config, self.variant, digest, version)
        waiting = [row for row in rows if row["id"] not in file.found]
        if waiting:
            self._consent(config, waiting, file.found)
        asked = ask_rows(client, rows, self.variant, file, self.workers, _tell_progress)
        for row_id, why in islice(asked.failures.items(), 3):
            tell(f"No reply to {row_id}: {why}")
        return self._results(config, facts, rows, asked)

    def _config(self) -> VlmConfig:
        config = self.vlm.config()
        if config is None:
            raise InputError("Say which model: --vlm gemini:MODEL, openai:MODEL@URL, or another of --help.")
        if config.words:
            raise InputError(
                f"Pictures and prompts are the data set's own: leave out {', '.join(config.words)}."
            )
        if self.workers < 1 or (self.limit is not None and self.limit < 1):
            raise InputError("--workers and --limit must be at least 1.")
        return config

    def _consent(self, config: VlmConfig, waiting: Sequence[Row], known: dict[str, Any]) -> None:
        from torc_next_object.asking.estimate import estimate

        most = config.max_output_tokens
        tell(f"{config.text}: {estimate(waiting, self.variant, known.values(), most, config.prices)}")
        if self.yes or (self.vlm.vlm_cache is not None and self.vlm.vlm_cache_mode == "replay"):
            return
        if not sys.stdin.isatty():
            raise InputError("Nothing was asked yet. Add --yes to begin.")
        tell("Go on? [y/N]")
        if sys.stdin.readline().strip().lower() not in _YES:
            raise InputError("Nothing was asked.")

    def _results(self, config: VlmConfig, facts: dict[str, Any], rows: Sequence[Row], asked: Asked) -> int:
        from datetime import UTC, datetime

        from torc.io.results import write_json
        from torc_next_object.asking.mistakes import mistakes_page, worst_mistakes
        from torc_next_object.asking.standing import FORMAT, standing
        from torc_next_object.scoring import scores_table

        if not asked.replies:
            tell("The server answered no question, so there are no scores. The same command asks again.")
            return 1
        found = {
            "format": FORMAT,
            "harness": "torc vlm-eval",
            "model": config.text,
            "date": datetime.now(UTC).date().isoformat(),
            "split": self.split,
            **{name: facts[name] for name in _OF_EVALUATION},
            **standing(rows, asked.replies, config.prices),
        }
        write_json(self.out / "scores.json", found)
        worst, page = worst_mistakes(rows, asked.replies, _SHOWN_MISTAKES), self.out / "worst.html"
        title = f"Worst mistakes of {config.text}, {facts['prompt']}"
        page.write_text(mistakes_page(title, worst), encoding="utf-8")
        if self.json:
            print_json(found)
        else:
            print(printable(scores_table({config.text: found["scores"], **found["baselines"]})))
            print(
                f"\n{found['answered']} decisions of {found['scores']['scenes']} problems. Regret: 0 as the"
            )
            print("best choices, 1 as random ones. The worst mistakes:", printable(str(page)))
        if missing := found["not_answered"]:
            gave_up = " The server was given up." if asked.untried else ""
            tell(
                f"{missing} of {len(rows)} questions have no reply and count as nothing.{gave_up} The same command "
                "asks them again."
            )
        return 1 if missing else 0


def _tell_progress(done: int, total: int) -> None:
    if done % _EVERY == 0 or done == total:
        tell(f"{done} of {total}")

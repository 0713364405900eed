"""Keep the leaderboard of torc-next-object: results/next-object/leaderboard.yaml and the page made from it.

python packages/torc-next-object/tools/leaderboard.py baselines next_object  # the choices that the data set holds
python packages/torc-next-object/tools/leaderboard.py add runs/model/scores.json --by "who ran it"
python packages/torc-next-object/tools/leaderboard.py page  # results/next-object/README.md
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import tyro
import yaml

from torc.errors import InputError
from torc.io.reading import read_text
from torc_next_object.asking.evaluation import data_digest
from torc_next_object.asking.standing import FORMAT as SCORES_FORMAT
from torc_next_object.data.opening import open_rows
from torc_next_object.prompting import VARIANTS
from torc_next_object.scoring import GROUPS, group_regrets, score_baselines, shown

FORMAT = "torc-leaderboard/1"
ROOT = Path(__file__).parents[3]
FILE, PAGE = (ROOT / "results" / "next-object" / name for name in ("leaderboard.yaml", "README.md"))
SPLIT = "test"
SCORES = ("rows", "scenes", "regret", "regret_low", "regret_high", "top1", "lost", "invalid")
PROVENANCE = (
    "model",
    "model_versions",
    "date",
    "harness",
    "variant",
    "prompt",
    "prompt_sha256",
    "data_sha256",
)
_NO_MODEL = "No model has been run yet. These are baselines only.\n"
_HEAD = """# Leaderboard

Scores on the data set [torc-next-object](../../docs/next_object.md), split `test`: {rows} decisions in {scenes}
problems. Regret is 0 for the best choices and 1 for RANDOM's; the 95 % interval is over problems. *Hard* means that the
target is more than 2.5 picks away. Every number here was measured.

"""
_TAIL = """
`learned`, `belief` and `dg-select` are [torc's planners](../../docs/task_planners.md). `simulated-P` is torc's
[simulated VLM](../../docs/vlm.md#the-simulated-vlm), which knows the scene and gets a share P of all facts right; it
shows how good a model must be and does not compete. `first` takes the lowest number, `largest` and `nearest` the
largest and the nearest object in the picture.

`python packages/torc-next-object/tools/leaderboard.py page` makes this page from [leaderboard.yaml](leaderboard.yaml),
which records where each line comes from. [How to submit a result](../../docs/next_object.md#submit-a-result).
"""


def read(file: Path = FILE) -> dict[str, Any]:
    """Return the leaderboard; empty if the file does not exist. Raises InputError if it has another format."""
    if not file.exists():
        return {"format": FORMAT, "split": SPLIT, "data_sha256": {}, "baselines": {}, "models": []}
    found = yaml.safe_load(read_text(file))
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise InputError(f"'{file}' is not a leaderboard of the format {FORMAT}.")
    return found


def write(board: Mapping[str, Any], file: Path = FILE) -> None:
    """Write the leaderboard as YAML, keys in the given order."""
    file.write_text(yaml.safe_dump(dict(board), sort_keys=False, width=120), encoding="utf-8")


def entry(scores: Mapping[str, Any], by: str, board: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's line, made from the scores of `torc vlm-eval`. Raises InputError if they do not qualify."""
    if scores.get("format") != SCORES_FORMAT:
        raise InputError(
            f"These are no scores of the format {SCORES_FORMAT}, as `torc vlm-eval` writes them."
        )
    if scores["split"] != SPLIT:
        raise InputError(f"The leaderboard is of the split '{SPLIT}', these scores of '{scores['split']}'.")
    whole = _size(board)["rows"]
    if scores["not_answered"] or scores["answered"] != whole:
        raise InputError(f"All {whole} decisions must be answered; here {scores['answered']} are.")
    if scores["data_sha256"] != board["data_sha256"][scores["variant"]]:
        raise InputError("These scores are of other data than the leaderboard's.")
    if scores["model"].startswith("simulated"):
        raise InputError("The simulated VLM is told the truth: it is a baseline, no model.")
    used = {name: scores["use"].get(name) for name in ("tokens_sent", "tokens_written", "cost", "currency")}
    provenance = {name: scores[name] for name in PROVENANCE}
    return (
        provenance
        | {"replies_sha256": scores["replies_sha256"], "by": by, "use": used}
        | line(scores["scores"])
    )


def line(scores: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scores that the leaderboard keeps."""
    return {name: scores[name] for name in SCORES} | {"regret_by": group_regrets(scores)}


def page(board: Mapping[str, Any]) -> str:
    """Return the page as Markdown, best first."""
    some = _size(board)
    models = sorted(board["models"], key=lambda e: e["regret"])
    table = [
        "| who | variant | regret | 95 % | best choice | invalid | regret, hard | hidden | visible |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_row(f"**{e['model']}**, {e['date']}, by {e['by']}", e["variant"], e) for e in models),
        *(
            _row(f"`{name}`", "", e)
            for name, e in sorted(board["baselines"].items(), key=lambda kv: kv[1]["regret"])
        ),
    ]
    head = _HEAD.format(rows=some["rows"], scenes=some["scenes"]) + ("" if models else _NO_MODEL + "\n")
    return head + "\n".join(table) + "\n" + _TAIL


def _size(board: Mapping[str, Any]) -> Mapping[str, int]:
    """Return the numbers of rows and scenes, which all lines share."""
    lines: list[Mapping[str, int]] = [*board["baselines"].values(), {"rows": 0, "scenes": 0}]
    return lines[0]


def _row(who: str, variant: str, e: Mapping[str, Any]) -> str:
    parts = " | ".join(shown(e["regret_by"][name]) for name in GROUPS)
    interval = f"{shown(e['regret_low'])} to {shown(e['regret_high'])}"
    return f"| {who} | {variant} | {shown(e['regret'])} | {interval} | {e['top1']:.2f} | {e['invalid']:.2f} | {parts} |"


@dataclass(frozen=True)
class Baselines:
    """Score the baselines that the data set holds, and put them into the leaderboard."""

    data: tyro.conf.Positional[str]
    """A folder of Parquet files, or OWNER/NAME on the Hugging Face hub."""

    def run(self) -> None:
        """Score and write."""
        rows = open_rows(self.data, SPLIT)
        found = score_baselines(rows)
        board = {
            "format": FORMAT,
            "split": SPLIT,
            "baselines_date": datetime.now(UTC).date().isoformat(),
            "data_sha256": {variant: data_digest(rows, variant) for variant in VARIANTS},
            "baselines": {name: line(scores) for name, scores in found.items()},
        }
        old = read()
        if old["models"] and old["data_sha256"] != board["data_sha256"]:
            raise InputError("The models were run on other data; theirs would stand beside other baselines.")
        write(board | {"models": old["models"]})


@dataclass(frozen=True)
class Add:
    """Add a model's scores; they replace an older line with the same model, variant and prompt."""

    scores: tyro.conf.Positional[Path]
    """scores.json of `torc vlm-eval`."""
    by: str
    """Who ran it."""

    def run(self) -> None:
        """Check and write. Raises InputError if the scores do not qualify."""
        board = read()
        new = entry(json.loads(read_text(self.scores)), self.by, board)
        same = ("model", "variant", "prompt")
        kept = [e for e in board["models"] if any(e[name] != new[name] for name in same)]
        write(board | {"models": [*kept, new]})


@dataclass(frozen=True)
class Page:
    """Make results/next-object/README.md."""

    def run(self) -> None:
        """Write it."""
        PAGE.write_text(page(read()), encoding="utf-8")


def main() -> None:
    """Run one of the three."""
    command = tyro.cli(
        Annotated[Baselines, tyro.conf.subcommand("baselines")]
        | Annotated[Add, tyro.conf.subcommand("add")]
        | Annotated[Page, tyro.conf.subcommand("page")]
    )
    try:
        command.run()
    except InputError as error:
        raise SystemExit(f"error: {error}") from None


if __name__ == "__main__":
    main()

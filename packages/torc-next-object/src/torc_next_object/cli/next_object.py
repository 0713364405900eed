"""`torc next-object`: make, check, score and export the data set torc-next-object."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from torc import InputError
from torc.cli.commands import Group
from torc.cli.printing import print_json, printable
from torc.io.reading import read_text


@dataclass(frozen=True)
class MakeCommand:
    """Make decisions with the value of every choice, as Parquet files.

    Of every problem it takes the first look, and looks on the way of dg-select
    and random. Finding a decision's values takes some tens of looks in simulation;
    known ones (--values) take none. Stop it at any time: rows are kept beside
    --out, and the same command resumes. For example:

      torc next-object make --problems torc40 --decisions 100 --out next_object
      torc problems generate --structured --count 20 --seed 91 --out fresh
      torc next-object make --problems fresh --hidden-seed SECRET --out hidden

    A hidden set needs problems that nobody else has: the seed of `torc problems
    generate` is as secret as --hidden-seed.
    """

    problems: Annotated[str, tyro.conf.arg(metavar="SET")]
    """Sets, problems, problem files or directories of them, comma-separated."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """The directory to make, or to continue."""
    decisions: int | None = None
    """Make at most this many new ones (several workers may make a few more); if not given, all."""
    per_problem: int = 5
    """Largest number of decisions per problem."""
    looks: int = 40
    """Looks per search for values; more narrow the intervals, and take longer. 0 makes only the decisions whose values
    are known."""
    values: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Known values, which need no search: results/next-object/values.jsonl has those of the published set. Values of
    further decisions are added."""
    workers: int = 1
    """Processes; each takes a problem at a time, and a core."""
    questions: Literal[1, 2] = 1
    """Version of the questions: 1 is what the leaderboard compares; 2 has pictures drawn for the question and says more
    of gripper, sizes and grasps."""
    hidden_seed: str | None = None
    """Make the split "hidden", by a word that the host keeps. It decides numbers and ids, and is written nowhere."""

    def run(self) -> int:
        """Make the rows."""
        from torc.problems.sets import select_problems
        from torc_next_object.making.building import Making, build
        from torc_next_object.making.rows import PUBLIC_KEY, MakingConfig

        if self.workers < 1 or (self.decisions is not None and self.decisions < 1):
            raise InputError("--workers and --decisions must be at least 1.")
        if self.looks == 0 and self.values is None:
            raise InputError(
                "--looks 0 makes only decisions whose values are known: name them by --values FILE."
            )
        hidden = self.hidden_seed is not None
        if hidden and self.values is not None:
            raise InputError("The values of a hidden set belong in no file: leave out --values.")
        config = MakingConfig(
            key=PUBLIC_KEY if self.hidden_seed is None else self.hidden_seed,
            hidden=hidden,
            per_problem=self.per_problem,
            most_looks=self.looks,
            questions=self.questions,
        )
        making = Making(select_problems(self.problems), config, self.values, self.workers)
        splits, new = build(making, self.out, self.decisions, lambda t: print(printable(t), flush=True))
        counts = ", ".join(f"{split} {n}" for split, n in splits.items())
        print(f"{new} new decisions. In {self.out}: {counts}")
        return 0


@dataclass(frozen=True)
class CheckCommand:
    """Check a set before it is published: types, values, ids, and signs that
    give the answer away. Exit code 1 for any fault.
    """

    directory: tyro.conf.Positional[Path]
    """What `torc next-object make` wrote, or one Parquet file."""

    def run(self) -> int:
        """Check; print the faults, and the scores of the baselines."""
        from torc_next_object.data.checking import blind_scores, check_directory, leaks
        from torc_next_object.scoring import score_baselines, scores_table

        rows, faults = check_directory(self.directory)
        for fault in faults:
            print(printable(fault))
        problems = len({row.scene for row in rows})
        print(f"{len(rows)} decisions of {problems} problems: {len(faults) or 'no'} faults.")
        for what, signs in leaks(rows).items():
            print(f"  {what}: {signs:+.1f} standard errors from chance")
        print("Without the picture, where the regret should be about 1:")
        print(scores_table(blind_scores(rows)))
        print("With it:")
        print(scores_table(score_baselines([row.to_dict() for row in rows])))
        return 1 if faults else 0


@dataclass(frozen=True)
class ScoreCommand:
    """Score replies of a model, whoever asked it.

    REPLIES has a line per decision: {"id": "...", "reply": "...Answer: 7"}.
    `torc_next_object.replies` says how the number is read.
    """

    directory: tyro.conf.Positional[Path]
    """The data set."""
    replies: tyro.conf.Positional[Path]
    """JSON lines."""
    split: str = "test"
    """Rows that count; "" for all. A row without a reply counts as an invalid answer."""
    json: Annotated[bool, tyro.conf.arg(help="Print all scores as JSON.")] = False

    def run(self) -> int:
        """Score. Exit code 2 for replies that cannot be read."""
        from torc_next_object.data.tables import read_plain
        from torc_next_object.replies import read_number
        from torc_next_object.scoring import score_answers, score_baselines, scores_table

        rows = read_plain(self.directory, self.split)
        if not rows:
            raise InputError(f"'{self.directory}' has no rows of the split '{self.split}'.")
        replies = read_replies(self.replies)
        unknown = sorted(set(replies) - {row["id"] for row in rows})
        if unknown and len(unknown) == len(replies):
            raise InputError(f"'{self.replies}' is of other rows: none has the id '{printable(unknown[0])}'.")
        numbers = [read_number(replies.get(row["id"]), row["numbers"]) for row in rows]
        scores = score_answers(zip(rows, numbers)).to_dict()
        missing = sum(row["id"] not in replies for row in rows)
        if self.json:
            print_json(scores | {"missing": missing})
            return 0
        print(scores_table({"replies": scores, **score_baselines(rows)}))
        if missing or unknown:
            print(f"{missing} rows have no reply; {len(unknown)} replies are of other rows.")
        return 0


@dataclass(frozen=True)
class ExportCommand:
    """Write the files of an evaluation harness, and print how to run it.

    lmms-eval gets YAML files and their functions, VLMEvalKit TSV files and
    their class; inspect_ai needs no files, but gets its samples as JSON lines:

      torc next-object export next_object --harness lmms-eval --out lmms_tasks
    """

    data: tyro.conf.Positional[str]
    """The data set: a folder of Parquet files, or OWNER/NAME on the Hugging Face hub."""
    harness: Literal["lmms-eval", "vlmevalkit", "inspect"]
    """Which harness."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """The folder to make."""
    split: Literal["train", "test", "hidden"] = "test"
    """Part of the data set."""

    def run(self) -> int:
        """Write, and print the command."""
        from torc_next_object.harnesses.exporting import export_for

        for line in export_for(self.harness, self.data, self.out, self.split):
            print(printable(line))
        return 0


def read_replies(path: Path) -> dict[str, str]:
    """Return replies by the id of their row. Raises InputError for another file, or two replies to a row."""
    try:
        lines = read_text(path).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"'{path}' cannot be read: {error}.") from None
    found: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            entry = json.loads(line)
            key, reply = str(entry["id"]), entry["reply"]
        except (ValueError, KeyError, TypeError, RecursionError):
            raise InputError(f'\'{path}\', line {number}: it must be {{"id": ..., "reply": ...}}.') from None
        if key in found:
            raise InputError(f"'{path}', line {number}: a second reply to '{printable(key)}'.")
        found[key] = reply
    return found


NEXT_OBJECT = Group(
    "Which object to remove first: a data set with the value of every choice, and its scores.",
    {
        "make": ("decisions from problems, as Parquet files", MakeCommand),
        "check": ("whether a set is whole and gives no answer away", CheckCommand),
        "score": ("replies of a model, without a simulator", ScoreCommand),
        "export": ("for inspect_ai, lmms-eval or VLMEvalKit", ExportCommand),
    },
)

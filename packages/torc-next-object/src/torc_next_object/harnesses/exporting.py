"""Write the data set in the forms of evaluation harnesses, as files outside their trees."""

import base64
import csv
import json
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from torc import InputError
from torc.io.pictures import data_url
from torc_next_object.data.opening import open_rows
from torc_next_object.data.tables import parquet_files, read_plain
from torc_next_object.prompting import VARIANTS, prompt_name, prompt_text, sent_pictures, version_of
from torc_next_object.scoring import COLUMNS

_TEMPLATE = "_next_object_template_yaml"
_KIT = "vlmevalkit.py"
TSV_COLUMNS = ("index", "image", "question", "answer", "category", "split", "row")
"""`row` is JSON with the columns that scoring needs."""


def export_for(harness: str, source: str, directory: Path, split: str) -> list[str]:
    """Write the files of a harness into a new directory; return lines that say how to run it.

    `source` is as for `open_rows`. Raises InputError if there are no rows, or the directory is not empty.
    """
    if directory.exists() and any(directory.iterdir()):
        raise InputError(f"'{directory}' is not empty. Name another directory.")
    rows = open_rows(source, split)
    directory.mkdir(parents=True, exist_ok=True)
    exports: dict[str, Callable[..., list[str]]] = {
        "lmms-eval": _lmms_eval,
        "vlmevalkit": _vlmevalkit,
        "inspect": _inspect,
    }
    return exports[harness](source, rows, directory, split)


def _lmms_eval(source: str, rows: Sequence[Mapping[str, Any]], directory: Path, split: str) -> list[str]:
    """Copy the YAML files and their functions; the data stay where they are."""
    shipped = files("torc_next_object.harnesses") / "lmms_eval"
    for file in shipped.iterdir():
        if file.name.endswith(".yaml") or file.name == "utils.py":
            (directory / file.name).write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    path = Path(source).expanduser()
    if path.exists():
        some = [str(file.resolve()) for file in parquet_files(path) if read_plain(file, split)]
        place: dict[str, Any] = {"dataset_path": "parquet", "dataset_kwargs": {"data_files": {split: some}}}
    else:
        place = {"dataset_path": source}
    text = (shipped / _TEMPLATE).read_text(encoding="utf-8")
    head = yaml.safe_dump(place | {"test_split": split}, sort_keys=False)
    text = text.replace("dataset_path: DATASET\ntest_split: test\n", head)
    (directory / _TEMPLATE).write_text(text, encoding="utf-8")
    tasks = ",".join(f"torc_next_object_{variant}" for variant in VARIANTS)
    return [f"python -m lmms_eval --model MODEL --include_path {directory} --tasks {tasks} --batch_size 1"]


def _vlmevalkit(source: str, rows: Sequence[Mapping[str, Any]], directory: Path, split: str) -> list[str]:
    """Write a TSV for each variant, and the class that reads and scores them."""
    for variant in VARIANTS:
        name = f"TorcNextObject_{variant}.tsv"
        with open(directory / name, "w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, TSV_COLUMNS, delimiter="\t")
            table.writeheader()
            table.writerows(_line(i, row, variant, split) for i, row in enumerate(rows))
    shipped = files("torc_next_object.harnesses") / _KIT
    (directory / _KIT).write_text(shipped.read_text(encoding="utf-8"), encoding="utf-8")
    tasks = " ".join(f"TorcNextObject_{variant}" for variant in VARIANTS)
    return [
        f"LMUData={directory.resolve()} PYTHONPATH={directory.resolve()}:VLMEvalKit "
        f"python -m vlmevalkit VLMEvalKit/run.py --data {tasks} --model MODEL"
    ]


def _line(index: int, row: Mapping[str, Any], variant: str, split: str) -> dict[str, Any]:
    """Return a line of the table; several pictures are written as a Python list."""
    pictures = [base64.b64encode(picture).decode() for picture in sent_pictures(row)]
    return {
        "index": index,
        "image": pictures[0] if len(pictures) == 1 else str(pictures),
        "question": prompt_text(row, variant),
        "answer": ", ".join(str(number) for number in row["best"]),
        "category": row["category"],
        "split": split,
        "row": json.dumps({name: row[name] for name in COLUMNS}),
    }


def _inspect(source: str, rows: Sequence[Mapping[str, Any]], directory: Path, split: str) -> list[str]:
    """Write a sample a line, for tools that read inspect_ai's samples; its tasks themselves need no files."""
    for variant in VARIANTS:
        with open(directory / f"next_object_{variant}.jsonl", "w", encoding="utf-8") as file:
            for row in rows:
                file.write(json.dumps(_sample(row, variant)) + "\n")
    place = Path(source).resolve() if Path(source).exists() else source
    more = "" if split == "test" else f" -T split={split}"
    return [
        f"inspect eval torc_next_object/next_object_{variant} -T data={place}{more} --model MODEL"
        for variant in VARIANTS
    ]


def _sample(row: Mapping[str, Any], variant: str) -> dict[str, Any]:
    content = [{"type": "image", "image": data_url(picture)} for picture in sent_pictures(row)]
    return {
        "id": row["id"],
        "input": [
            {"role": "user", "content": [*content, {"type": "text", "text": prompt_text(row, variant)}]}
        ],
        "target": [str(number) for number in row["best"]],
        "metadata": {"prompt": prompt_name(variant, version_of(row))}
        | {name: row[name] for name in (*COLUMNS, "best")},
    }

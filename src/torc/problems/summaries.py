"""Name, category, size and description of problems, for lists. Light to import."""

import os
from dataclasses import dataclass

import yaml

from torc.problems.sets import shipped_path

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class ProblemSummary:
    """A line in a list of problems; `objects` is how many lie on the table."""

    name: str
    category: str
    objects: int
    description: str


def problem_summary(name_or_path: str) -> ProblemSummary:
    """Summarise a problem. A shipped file is read up to its objects; any other is checked as a whole.

    Raises:
        InputError: there is no such problem, or its file cannot be used.
    """
    path = None if os.path.isfile(name_or_path) else shipped_path(name_or_path)
    if path is None:
        from torc.problems.problem import load_problem

        problem = load_problem(name_or_path)
        return ProblemSummary(problem.name, problem.category, len(problem.objects), problem.description)
    head, _, objects = path.read_text(encoding="utf-8").partition("\nobjects:\n")
    facts = yaml.load(head, Loader=_LOADER)  # a SafeLoader: builds plain values only
    count = sum(line.startswith("- ") for line in objects.splitlines())
    return ProblemSummary(facts["name"], facts["category"], count, facts["description"])

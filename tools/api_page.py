"""Write docs/api.md from the docstrings of the public names: `python -m tools.api_page`."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import torc

PAGE = Path(__file__).parents[1] / "docs" / "api.md"
CHAPTERS = {
    "Play": ("Episode", "play", "bench", "run_trial", "read_trial", "Trial", "Table"),
    "Decide for a picture": ("load_frame", "save_frame", "decide_frame", "Answer", "Grasp", "Wanted"),
    "What a planner sees and answers": (
        "PlanningContext",
        "Observation",
        "GraspStatus",
        "build_dependency_graph",
        "DependencyGraph",
        "Decision",
        "Evidence",
    ),
    "What came of a pick": ("PickOutcome", "PickResult"),
    "What is played": (
        "TrialSpec",
        "PlannerSpec",
        "Conditions",
        "VlmConfig",
        "Problem",
        "problem_names",
        "load_problem",
        "load_robot",
        "load_workspace",
        "make_planner",
    ),
    "Errors": ("TorcError", "InputError"),
}
_HEAD = """# Python interface

`import torc` offers the names on this page; each is imported when it is first used. Everything else in torc is private
and may change, apart from `torc.protocols`, which holds what [your own parts](extending.md) need, and the conformance
suites in `torc.testing`. [modules.md](modules.md) is for packages beside torc. Units are metres, radians and seconds,
quaternions are wxyz, and the camera frame is OpenCV's.

<!-- Written by `python -m tools.api_page` from the docstrings. -->
"""
_SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Example):$")


def page() -> str:
    """Return the page."""
    parts = [_HEAD]
    for title, names in CHAPTERS.items():
        parts.append(f"## {title}\n")
        parts += [_entry(name, getattr(torc, name)) for name in names]
    return "\n".join(parts)


def _entry(name: str, what: Any) -> str:
    text = [
        f"### torc.{name}\n",
        f"```python\n{_signature(name, what)}\n```\n",
        _markdown(inspect.getdoc(what) or ""),
    ]
    if isinstance(what, type) and (documented := field_docs(what)):
        text.append(
            "\n".join(["**Attributes**", "", *(f"- `{k}`: {v}" for k, v in documented.items())]) + "\n"
        )
    if isinstance(what, type) and issubclass(what, Enum):
        text.append("\n".join(f"- `{one.name}`" for one in what) + "\n")
    elif isinstance(what, type):
        members = [f"- `{shown}`: {doc}" for shown, doc in _members(what)]
        text += ["\n".join(members) + "\n"] if members else []
    return "\n".join(text)


def _signature(name: str, what: Any) -> str:
    if isinstance(what, type) and issubclass(what, Enum | Exception):
        return f"class {name}"
    if is_dataclass(what):
        given = [
            f.name + ("" if f.default is f.default_factory is MISSING else "=...")
            for f in fields(what)
            if f.init
        ]
    else:
        signature = inspect.signature(what)
        given = [_parameter(p) for p in signature.parameters.values()]
        keyword = [p.kind is p.KEYWORD_ONLY for p in signature.parameters.values()]
        if True in keyword:
            given.insert(keyword.index(True), "*")
    line = f"{name}({', '.join(given)})"
    return line if len(line) <= 100 else f"{name}(\n    " + ",\n    ".join(given) + ",\n)"


def _parameter(p: inspect.Parameter) -> str:
    if p.kind is p.VAR_KEYWORD:
        return f"**{p.name}"
    if p.default is p.empty:
        return p.name
    if isinstance(p.default, str):
        return f'{p.name}="{p.default}"'
    return f"{p.name}={p.default!r}" if isinstance(p.default, int | float | None) else f"{p.name}=..."


def field_docs(cls: type) -> dict[str, str]:
    """The texts that stand below the fields of a class, its parents' first."""
    found: dict[str, str] = {}
    for part in reversed(cls.__mro__[:-1]):
        if not part.__module__.startswith("torc") or issubclass(part, Enum):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(part))).body[0]
        assert isinstance(body, ast.ClassDef)
        for one, text in zip(body.body, body.body[1:]):
            if (
                isinstance(one, ast.AnnAssign)
                and isinstance(one.target, ast.Name)
                and isinstance(text, ast.Expr)
            ):
                found[one.target.id] = " ".join(ast.literal_eval(text.value).split())
    return found


def _members(cls: type) -> Iterator[tuple[str, str]]:
    """Public methods and properties of a class, with the first paragraph of their docs."""
    for name, member in vars(cls).items():
        is_property = isinstance(member, property) or hasattr(member, "attrname")
        code = getattr(member, "__func__", member)
        if name.startswith("_") or not (is_property or inspect.isfunction(code)):
            continue
        doc = (inspect.getdoc(member) or "").split("\n\n")[0].replace("\n", " ")
        parameters = [] if is_property else [*inspect.signature(code).parameters.values()]
        given = ", ".join(_parameter(p) for p in parameters if p.name not in ("self", "cls"))
        yield (name if is_property else f"{name}({given})"), doc


def _markdown(doc: str) -> str:
    """A docstring as Markdown: its sections as lists, its example as code."""
    lines: list[str] = []
    section = ""
    for line in doc.splitlines():
        if found := _SECTION.match(line):
            section = found[1]
            lines += [f"**{section}**", "", *(["```python"] if section == "Example" else [])]
        elif section == "Example":
            lines.append(line.removeprefix("    "))
        elif section and (item := re.match(r"^    ([\w, ]+): (.*)", line)) and section != "Returns":
            lines.append(f"- `{item[1]}`: {item[2]}")
        elif section and line.startswith("    "):
            lines.append(("  " if section != "Returns" else "") + line.strip())
        else:
            section = "" if line.strip() else section
            lines.append(line)
    return "\n".join([*lines, *(["```"] if section == "Example" else [])]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

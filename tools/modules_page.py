"""Write docs/modules.md, the modules of torc that other packages build on: `python -m tools.modules_page`.

They are the modules that torc's own satellites import, and those in the docs and examples, with the names used there.
"""

import ast
import importlib
import inspect
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "modules.md"
PUBLIC = ("torc", "torc.protocols")
"""Their names have a page of their own, or are listed with it."""
_HEAD = """# Modules for packages

To write a part you need only `torc`, `torc.protocols` and `torc.testing` ([extending.md](extending.md)). This page
lists the modules and names that torc-lab, torc-networks, torc-next-object and the examples use. They may change between
minor versions; CHANGELOG.md then says so. Other names are private.

<!-- Written by `python -m tools.modules_page`. -->
"""


def used_names() -> dict[str, set[str]]:
    """Return the names that satellites, docs and examples import, by module of the core."""
    used: defaultdict[str, set[str]] = defaultdict(set)
    files = [*ROOT.glob("packages/*/src/**/*.py"), *ROOT.glob("examples/*.py")]
    sources = [ast.parse(path.read_text()) for path in files]
    pages = [ROOT / "README.md", *ROOT.glob("docs/*.md")]
    sources += [ast.parse(line) for page in pages for line in _imports_of(page.read_text())]
    for tree in sources:
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "torc":
                for alias in node.names:
                    used[node.module].add(alias.name)
    return {
        m: names for m, names in sorted(used.items()) if m not in PUBLIC and not m.startswith("torc.testing")
    }


def _imports_of(page: str) -> Iterator[str]:
    for found in re.finditer(r"^ *(from torc[\w.]* import (?:\([^)]*\)|[^\n]+))", page, re.M):
        yield found[1].strip()


def page() -> str:
    """Return the page."""
    parts = [_HEAD]
    for name, names in used_names().items():
        module = importlib.import_module(name)
        parts.append(f"## {name}\n\n{_line(module)}\n")
        parts.append("\n".join(f"- `{each}`{_about(getattr(module, each))}" for each in sorted(names)) + "\n")
    return "\n".join(parts)


def _about(what: object) -> str:
    """Return what a name is, if it can say so: constants are documented in their module."""
    documented = inspect.isclass(what) or inspect.isroutine(what) or inspect.ismodule(what)
    return f": {_line(what)}" if documented and what.__doc__ else ""


def _line(what: object) -> str:
    return " ".join((inspect.getdoc(what) or "").split("\n\n")[0].split())


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

"""Write the table of what can be exchanged into docs/extending.md: `python -m tools.extension_points`."""

import re
from pathlib import Path

from torc.registry.kinds import KINDS, declarable
from torc.registry.loading import shipped_paths
from torc.satellites import SATELLITES

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
_BLOCK = re.compile(r"(<!-- extension points -->\n).*?(<!-- end -->)", re.DOTALL)


def table() -> str:
    """Return a row for each kind of part."""
    heads = ("part", "chosen by", "shipped", "method", "may declare", "suite in `torc.testing`")
    rows = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for kind in KINDS:
        chosen = f"`{kind.option}: driver:` in a lab file" if kind.in_file else f"`--{kind.option}`"
        names = [f"`{name}`" for name in shipped_paths(kind)]
        names += [f"`{name}` ({s.package})" for s in SATELLITES for name in s.parts.get(kind.group, ())]
        shipped = ", ".join(names)
        declared = ", ".join(f"`{name}`" for name in declarable(kind.base))
        suite = f"`{kind.suite}`" if kind.suite else ""
        suite += " of `torc_lab.testing`" if suite and kind.in_file else ""
        rows.append(f"| {kind.what} | {chosen} | {shipped} | `{kind.call}` | {declared} | {suite} |")
    return "\n".join(rows) + "\n"


def page(text: str) -> str:
    """Return a page with the table of today."""
    return _BLOCK.sub(lambda found: found[1] + table() + found[2], text)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

"""Put files outside docs/ on the mkdocs site: pages and pictures of results/ as they are, others as text."""

import os.path
import re
from pathlib import Path
from typing import Any

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")
_SHOWN = ("*.md", "*.png", "*.jpg", "*.svg")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages of results/ with their pictures, and every other file that a page links to."""
    from mkdocs.structure.files import File

    docs = Path(config.docs_dir).resolve()

    def add(path: Path) -> None:
        if files.get_file_from_path(_on_site(path, docs)) is None:
            files.append(File.generated(config, _on_site(path, docs), abs_src_path=str(path)))

    for pattern in _SHOWN:
        for path in sorted((docs.parent / "results").rglob(pattern)):
            add(path)
    for page in list(files.documentation_pages()):
        source = docs / page.src_uri
        if not source.exists():
            source = docs.parent / page.src_uri
        for _, _, target, _ in _LINK.findall(page.content_string):
            path = (source.parent / target).resolve()
            if path.is_file() and path.is_relative_to(docs.parent) and not path.is_relative_to(docs):
                add(path)
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Point links at these files. A link to a directory becomes plain text."""
    docs = Path(config.docs_dir).resolve()
    source = Path(page.file.abs_src_path).resolve()

    def rewritten(link: re.Match[str]) -> str:
        mark, text, target, anchor = link.groups()
        path = (source.parent / target).resolve()
        if target.startswith(("http:", "https:")) or not path.is_relative_to(docs.parent):
            return link.group()
        if not path.is_file():
            return text
        address = os.path.relpath(_on_site(path, docs), Path(page.file.src_uri).parent)
        return f"{mark}[{text}]({address}{anchor or ''})"

    return _LINK.sub(rewritten, markdown)


def _on_site(path: Path, docs: Path) -> str:
    """Return a file's place on the site. Text keeps mkdocs from making pages of what is not one."""
    if path.is_relative_to(docs):
        return str(path.relative_to(docs))
    below = path.relative_to(docs.parent)
    shown = below.parts[0] == "results" and any(path.match(pattern) for pattern in _SHOWN)
    return str(below) if shown else f"repository/{below}.txt"

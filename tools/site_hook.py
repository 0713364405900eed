"""For mkdocs: files of the repository that pages link to, but that are not in docs/, are put on the site as text."""

import re
from pathlib import Path
from typing import Any

_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((\.\./[^)#\s]+)(#[^)]*)?\)")


def on_files(files: Any, config: Any) -> Any:
    """Adds the linked files."""
    from mkdocs.structure.files import File

    docs = Path(config.docs_dir)
    for page in list(files.documentation_pages()):
        for _, target, _ in _LINK.findall(page.content_string):
            path = (docs / page.src_uri).parent / target
            if (
                _is_outside(path, docs)
                and path.is_file()
                and not files.get_file_from_path(_on_site(path, docs))
            ):
                files.append(File.generated(config, _on_site(path, docs), abs_src_path=str(path.resolve())))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Leads the links there; what is no file (a directory) loses its link."""
    docs = Path(config.docs_dir)
    here = (docs / page.file.src_uri).parent

    def rewritten(link: re.Match[str]) -> str:
        text, target, _ = link.groups()
        path = here / target
        if not _is_outside(path, docs):
            return link.group()
        up = "../" * (len(here.relative_to(docs).parts))
        return f"[{text}]({up}{_on_site(path, docs)})" if path.is_file() else text

    return _LINK.sub(rewritten, markdown)


def _is_outside(path: Path, docs: Path) -> bool:
    return not path.resolve().is_relative_to(docs.resolve())


def _on_site(path: Path, docs: Path) -> str:
    """Text, so that browsers show it and mkdocs makes no page of it."""
    return f"repository/{path.resolve().relative_to(docs.resolve().parent)}.txt"

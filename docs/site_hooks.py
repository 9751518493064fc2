"""Hooks of mkdocs: pages that stand outside docs/, and links that hold in a checkout and in the site alike.

Links in the pages are those of the repository, as a git host follows them. In the site a link out of docs/ leads to the
page made of that file: of Markdown a page, of anything else its text.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from posixpath import dirname, normpath, relpath
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
#: Markdown from outside docs/, by its page in the site
PAGES = {
    "README.md": "overview.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "benchmarks/results.md": "benchmarks.md",
}
#: before the pages that would answer every search
LAST_IN_SEARCH = "---\nsearch:\n  boost: 0.1\n---\n"
LINK = re.compile(r"(\]\()(?![a-z]+:|#)([^)\s#]+)")
LANGUAGE = {".py": "python", ".toml": "toml", ".yml": "yaml", ".json": "json", ".cff": "yaml"}


def on_files(files: Any, config: Any) -> Any:
    """Add the pages from outside docs/, and of each other file that a page links to its text."""
    for origin, page in PAGES.items():
        last = LAST_IN_SEARCH if origin == "CHANGELOG.md" else ""
        files.append(File.generated(config, page, content=last + (ROOT / origin).read_text()))
    own = [f"docs/{file.src_uri}" for file in files.documentation_pages() if file.generated_by is None]
    for target in sorted({target for origin in (*PAGES, *own) for target in _links(origin) if _is_text(target)}):
        files.append(File.generated(config, _page(target), content=_text_page(target)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Turn links of the repository into links of the site."""
    uri = page.file.src_uri
    origin = {page: origin for origin, page in PAGES.items()}.get(uri, f"docs/{uri}")

    def site_link(match: re.Match[str]) -> str:
        target = _page(normpath(f"{dirname(origin)}/{match[2]}".lstrip("/")))
        return match[1] + relpath(target, dirname(uri) or ".")

    return LINK.sub(site_link, markdown)


def _links(origin: str) -> Iterator[str]:
    """What a page links to, as paths from the root of the repository."""
    for match in LINK.finditer((ROOT / origin).read_text()):
        yield normpath(f"{dirname(origin)}/{match[2]}".lstrip("/"))


def _is_text(target: str) -> bool:
    """Whether the target is a file that the site has no page of its own for."""
    inside = target.startswith("docs/") and target.endswith((".md", ".svg", ".png"))
    return not inside and target not in PAGES and (ROOT / target).is_file()


def _page(target: str) -> str:
    """The file of the site for a path from the root of the repository."""
    if target in PAGES:
        return PAGES[target]
    if _is_text(target):
        return f"files/{target}.md"
    return "index.md" if target == "docs" else target.removeprefix("docs/")


def _text_page(target: str) -> str:
    """A page that shows a file as it is; the search passes over it."""
    text = (ROOT / target).read_text()
    language = LANGUAGE.get(Path(target).suffix, "text")
    return f"---\nsearch:\n  exclude: true\n---\n# {target}\n\n````{language}\n{text.rstrip()}\n````\n"

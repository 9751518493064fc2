"""Runs the notebooks in docs/notebooks/, each in an empty folder, and keeps of their outputs the words alone.

python docs/notebooks.py [NAME]

Text outputs stay in the notebook, so that a reader sees them and a test can compare; figures are megabytes that change
with every version of plotly, and appear when the notebook is run. Beside each notebook lies a page for the site.
"""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).parent
FOLDER = HERE / "notebooks"
FIGURE = "application/vnd.plotly.v1+json"
NO_FIGURE = "(a figure: run the notebook to see it)"


def pages() -> list[Path]:
    """All notebooks."""
    return sorted(FOLDER.glob("*.ipynb"))


def executed(notebook: Path, folder: Path) -> Any:
    """The notebook as it is after a run in ``folder`` by this Python, its outputs in words."""
    content = nbformat.read(notebook, as_version=4)
    environment = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = str(HERE.parent)  # what the kernel imports
    try:
        NotebookClient(content, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
    finally:
        os.environ.pop("PYTHONPATH")
        if environment is not None:
            os.environ["PYTHONPATH"] = environment
    for cell in content.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.execution_count = None
            words = "".join(_words(output) for output in cell.outputs)
            cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=words)] if words else []
    content.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return content


def _words(output: Any) -> str:
    """An output as text; a figure says that it is one."""
    if output.output_type == "stream":
        return str(output.text)
    return (NO_FIGURE if FIGURE in output.data else str(output.data["text/plain"])) + "\n"


def words_of(content: Any) -> list[str]:
    """What each code cell of a notebook prints."""
    return ["".join(output.text for output in cell.outputs) for cell in content.cells if cell.cell_type == "code"]


def site_page(content: Any, name: str) -> str:
    """The notebook as a page of the site."""
    parts = []
    for cell in content.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source.replace(".ipynb)", ".md)"))
            continue
        parts.append(f"```python\n{cell.source}\n```")
        if words := "".join(output.text for output in cell.outputs):
            parts.append(f"```text\n{words.rstrip()}\n```")
    title, *rest = parts[0].splitlines()
    parts[0] = "\n".join([title, "", f"The notebook: [{name}.ipynb]({name}.ipynb).", *rest])
    return "\n\n".join(parts) + "\n"


def main() -> None:
    """Run the notebooks, all or the one that is named, and write them and their pages."""
    for notebook in pages():
        if sys.argv[1:] and notebook.stem not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory() as folder:
            content = executed(notebook, Path(folder))
        nbformat.write(content, notebook)
        notebook.with_suffix(".md").write_text(site_page(content, notebook.stem))
        print(notebook.name)


if __name__ == "__main__":
    main()

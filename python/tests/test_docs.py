"""Pages, examples and the notebook do what they show."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path

import pytest

from conftest import ROOT

PAGES = [*sorted((ROOT / "python" / "docs").glob("*.md")), ROOT / "README.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def prop_the_code_of_a_page_runs(page, monkeypatch):
    for name in ("pandas", "xarray"):
        pytest.importorskip(name)
    pytest.importorskip("matplotlib").use("Agg")
    if not page.exists():
        pytest.skip("the page belongs to the repository and not to the package")
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    assert blocks
    # One after the other, as a reader types them.
    exec(compile("\n".join(blocks), str(page), "exec"), {"__name__": page.stem})


def prop_the_example_runs(capsys):
    runpy.run_path(str(ROOT / "python" / "examples" / "typed.py"), run_name="__main__")
    assert capsys.readouterr().out == "0.0\n"


def prop_the_notebook_runs(monkeypatch):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    path = ROOT / "python" / "examples" / "first_test.ipynb"
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    folder = {"metadata": {"path": str(path.parent)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=folder).execute()
    shown = json.dumps([cell.get("outputs") for cell in notebook.cells])
    assert "iframe" in shown

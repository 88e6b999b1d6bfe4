"""What is written about the package, and for tools that read it: the stub, the page and the notebook."""

import importlib.util
import json
import re
from pathlib import Path

import asid
from asid import _native


def test_the_stub_is_that_of_the_compiled_module(repository):
    spec = importlib.util.spec_from_file_location("stubs", repository / "python/stubs.py")
    stubs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(stubs)
    installed = Path(asid.__file__).parent
    found = (installed / "_native.pyi").read_text(encoding="utf-8")
    again = "python python/stubs.py > python/asid/_native.pyi"
    assert found == stubs.stub(_native), f"asid/_native.pyi is not of this module: {again}"
    assert (installed / "py.typed").exists()


def test_every_name_of_the_package_is_there():
    for name in asid.__all__:
        assert getattr(asid, name) is not None


def test_the_notebook_runs(repository, tmp_path, monkeypatch):
    """Its cells of code, one after the other in one scope, as a notebook runs them."""
    notebook = json.loads((repository / "docs/python.ipynb").read_text(encoding="utf-8"))
    monkeypatch.chdir(repository / "docs")
    scope: dict = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "docs/python.ipynb", "exec"), scope)
            assert cell["outputs"] == [], "a notebook is kept without its output"
    assert scope["found"].verdict.kind


def test_the_page_s_examples_are_python(repository):
    text = (repository / "docs/python.md").read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(examples) >= 4
    for example in examples:
        compile(example, "docs/python.md", "exec")

"""The package: its notebooks run, it installs without a network, and its version is that of the program."""

import json
import os
import re
import subprocess
import sys

import pytest

import talus

from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "apps/python/notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_from_top_to_bottom_and_ship_without_outputs(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(path.read_text())
    assert notebook["nbformat"] == 4
    names = {"__name__": "__main__"}
    for number, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [] and cell["execution_count"] is None
        exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), names)


def test_there_are_notebooks():
    assert len(NOTEBOOKS) == 2


def test_versions_agree():
    program = subprocess.run([talus.find_program(), "--version"], capture_output=True, text=True, check=True).stdout
    project = (ROOT / "apps/python/pyproject.toml").read_text()
    assert re.search(r'^version = "([^"]+)"', project, re.M)[1] == talus.__version__
    assert program.split()[:2] == ["talus", talus.__version__]


def test_it_installs_without_a_network(tmp_path):
    try:
        import ensurepip, setuptools, venv  # noqa: F401
    except ImportError as missing:
        pytest.skip(f"no {missing.name} here (Debian: python3-venv, python3-setuptools)")
    tree = tmp_path / "tree"  # setuptools writes beside what it builds
    subprocess.run(["cp", "-r", str(ROOT / "apps/python"), str(tree)], check=True)
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", str(tmp_path / "venv")], check=True)
    python = tmp_path / "venv/bin/python"
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    subprocess.run([python, "-m", "pip", "install", "-q", "--no-index", "--no-build-isolation", "--no-deps", str(tree)],
                   check=True, env=environment)
    where = subprocess.run([python, "-c", "import talus, pathlib; print(talus.__file__, "
                                          "(pathlib.Path(talus.__file__).parent / 'py.typed').exists())"],
                           check=True, env=environment, cwd=tmp_path, capture_output=True, text=True).stdout.split()
    assert where[0].startswith(str(tmp_path / "venv")) and where[1] == "True"


def test_everything_public_is_documented_and_annotated():
    import inspect

    for name in talus.__all__:
        thing = getattr(talus, name)
        assert inspect.getdoc(thing), name
        members = [thing] if inspect.isfunction(thing) else \
            [m for n, m in vars(thing).items() if inspect.isfunction(m) and not n.startswith("_")]
        for member in members:
            assert member.__doc__, f"{name}.{member.__name__}"
            assert "return" in member.__annotations__, f"{name}.{member.__name__}"

"""The wheel, installed elsewhere, is the complete tool: commands, plans, completion, a sweep."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sphero_probe import __version__

ROOT = Path(__file__).resolve().parent.parent
PLANS = {path.stem for path in (ROOT / "probe_plans").glob("*.py")}
DEPENDENCIES = "import bleak, click, platformdirs, rich"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel and install it, without its dependencies, into an empty folder."""
    pytest.importorskip("hatchling", reason="hatchling, which builds the wheel, comes with .[test]")
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    (wheel,) = folder.glob("*.whl")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet")
    run(*pip, "--no-deps", "--no-index", "--no-compile", "--target", folder / "site", wheel, cwd=folder)
    return folder / "site"


def run(*words: str | Path, cwd: Path, site: Path | None = None) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    if site:
        environment["PYTHONPATH"] = str(site)
    ran = subprocess.run(words, capture_output=True, text=True, check=False, cwd=cwd, env=environment)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def pythons() -> list[str]:
    """Return this interpreter and the others on the machine that can run the tool."""
    found = [shutil.which(f"python3.{minor}") for minor in range(11, 15) if minor != sys.version_info[1]]
    return [sys.executable, *filter(None, found)]


@pytest.mark.parametrize("python", pythons(), ids=lambda path: Path(path).name)
def test_the_installed_tool_is_whole(request: pytest.FixtureRequest, tmp_path: Path, python: str) -> None:
    if python != sys.executable:
        asked = subprocess.run([python, "-c", DEPENDENCIES], capture_output=True, check=False)
        if asked.returncode:
            pytest.skip(f"{python} lacks bleak, click, platformdirs or rich")
    site = request.getfixturevalue("installed")

    def probe(*words: str) -> str:
        return run(python, "-m", "sphero_probe", *words, cwd=tmp_path, site=site)

    listed = {row["name"]: Path(row["file"]) for row in json.loads(probe("plan", "list", "--json"))}
    assert set(listed) == PLANS
    assert all(file.is_relative_to(site) for file in listed.values())
    assert "complete -o nosort -F" in probe("completion", "bash")
    swept = probe("sweep", "--did", "0x13", "--device", "fake:bolt-plus", "--no-journal", "--format", "jsonl")
    findings = [row for row in map(json.loads, swept.splitlines()) if row["type"] == "finding"]
    assert len(findings) == 256
    assert "power.get_battery_percentage" in {row["name"] for row in findings if row["outcome"] == "exists"}
    assert "</script>" in probe("catalog", "battery", "--format", "html")
    (script,) = (site / "bin").iterdir()
    assert script.stem == "sphero-probe"
    said = run(python, script, "--version", cwd=tmp_path, site=site)
    assert said == f"sphero-probe {__version__}\n"


def test_the_installed_tool_brings_its_pytest_plugin(installed: Path, tmp_path: Path) -> None:
    (metadata,) = installed.glob("sphero_probe-*.dist-info/entry_points.txt")
    assert "[pytest11]\nsphero_probe = sphero_probe.pytest_plugin" in metadata.read_text(encoding="utf-8")
    (tmp_path / "test_it.py").write_text("def test_it(sphero): assert sphero.send('power.wake').ok\n")
    said = run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", cwd=tmp_path, site=installed)
    assert "1 passed" in said

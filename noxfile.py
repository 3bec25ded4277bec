"""The checks of this project, one nox session each. They run in the environment that nox is installed in.

``.ci/run`` and contributors use the same sessions: ``.venv/bin/nox -s lint``, or ``.venv/bin/nox`` for all.
Arguments after ``--`` go to the tool: ``.venv/bin/nox -s tests -- tests/protocol``.
"""

import sys
from pathlib import Path

import nox

nox.needs_version = ">=2024.10.9"
nox.options.default_venv_backend = "none"
nox.options.sessions = ["lint", "types", "architecture", "tests", "proofs", "bench", "docs"]


def python(session: nox.Session, *words: str) -> None:
    """Run the interpreter of this environment, with the arguments after ``--`` at the end."""
    session.run(sys.executable, *words, *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style and formatting with ruff."""
    python(session, "-m", "ruff", "check", ".")
    session.run(sys.executable, "-m", "ruff", "format", "--check", ".")


@nox.session
def types(session: nox.Session) -> None:
    """Check types with mypy."""
    python(session, "-m", "mypy")


@nox.session
def architecture(session: nox.Session) -> None:
    """Check that imports run one way with import-linter."""
    lint_imports = Path(sys.executable).with_name("lint-imports")
    session.run(str(lint_imports), *session.posargs)


@nox.session
def tests(session: nox.Session) -> None:
    """Run the test suite."""
    python(session, "-m", "pytest")


@nox.session
def coverage(session: nox.Session) -> None:
    """Run the test suite with coverage, which takes half as long again; below 95 % it fails."""
    python(session, "-m", "pytest", "--cov", "--cov-report=term-missing:skip-covered", "--cov-fail-under=95")


@nox.session
def proofs(session: nox.Session) -> None:
    """Run the long proofs that the suite leaves out: the oracle, the strangers, the judgement of tshark."""
    python(session, "-m", "pytest", "-m", "slow", "-rs")


@nox.session
def bench(session: nox.Session) -> None:
    """Run the quick benchmark; its results are printed, but never fail the session."""
    python(session, "-m", "benchmarks", "--quick")


@nox.session
def docs(session: nox.Session) -> None:
    """Build the documentation into site/; a warning is an error."""
    python(session, "-m", "mkdocs", "build", "--strict")

"""Plan files: what a good one gives, and that a bad one raises one error that names the line."""

import itertools
import signal
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plan import Plan, Probe, Stage, sweep
from sphero_probe.probing.plans import loader as plan_module
from sphero_probe.probing.plans.loader import MAX_FILE, MAX_PROBES, MAX_STAGES, load_plan, probes_of
from sphero_probe.probing.plans.shipped import find_plan, plan_files, plans_folder
from sphero_probe.protocol.packets import Command

BATTERY = Command(0x13, 0x10)
IMPORTS = (
    "from sphero_probe.probing.plan import Plan, Probe, sweep;"
    "from sphero_probe.protocol.packets import Command"
)
PLANS = plan_files()
Write = Callable[..., Path]


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_module, "MAX_SECONDS", 0.05)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a plan file; its first line imports what a plan needs."""

    def written(source: bytes | str, name: str = "mine.py") -> Path:
        path = tmp_path / name
        path.write_bytes(source if isinstance(source, bytes) else f"{IMPORTS}\n{source}".encode())
        return path

    return written


def plan_of(*stages: Stage) -> Plan:
    return Plan("made", "in memory", stages)


def line_of(source: str) -> int | None:
    """The number of the line that is marked ``# here``, None where none is."""
    return next((at for at, line in enumerate(source.splitlines(), 2) if line.endswith("# here")), None)


def assert_says(error: BadInputFileError, path: Path, line: int | None, said: str) -> None:
    where = f"{path}:{line}: " if line else f"{path}: "
    assert str(error).startswith(where)
    assert said in str(error)
    assert "\n" not in str(error)
    assert error.exit_code == 8


def test_a_plan_file(write: Write) -> None:
    path = write('PLAN = Plan("mine", "my own", [[Probe(Command(0x13, 0x10))]], robots=("bolt", "mini"))')
    plan = load_plan(path)
    assert plan == Plan("mine", "my own", [[Probe(BATTERY)]], ("bolt", "mini"), path)
    assert list(probes_of(plan, plan.stages[0], ())) == [Probe(BATTERY)]


def test_a_plan_file_is_ordinary_python(write: Write) -> None:
    path = write(
        "import math\n"
        "ids = [0x10 + step for step in range(3)]\n"
        "def later(findings):\n"
        "    for cid in ids:\n"
        "        yield Probe(Command(0x13, cid, bytes([len(findings), math.ceil(0.5)])), exact=True)\n"
        "PLAN = Plan(__name__, __file__, (sweep([0x13], ids), later))\n"
    )
    plan = load_plan(path)
    assert (plan.name, plan.summary) == ("probe_plan_mine", str(path))
    reads, rest = plan.stages
    assert [probe.command.cid for probe in probes_of(plan, reads, ())] == [0x10, 0x11, 0x12]
    findings: Any = (object(), object())
    assert list(probes_of(plan, rest, findings)) == [
        Probe(Command(0x13, cid, b"\x02\x01"), exact=True) for cid in (0x10, 0x11, 0x12)
    ]


LEAVES_WHEN_SHOWN = """
class Shy:
    shown = 0
    def __repr__(self):
        Shy.shown += 1
        if Shy.shown == 1:
            raise SystemExit
        return "shy"
"""
BROKEN = [
    pytest.param("raise ValueError('no good')  # here", "ValueError: no good", id="raises"),
    pytest.param("\n\nraise ValueError  # here", "ValueError", id="raises without a word"),
    pytest.param("raise ValueError('one\\ntwo')  # here", "ValueError: one", id="raises in two lines"),
    pytest.param("x = 1\ny = x / 0  # here", "ZeroDivisionError", id="divides by zero"),
    pytest.param("PLAN = Plam()  # here", "NameError", id="misspelt"),
    pytest.param("import no_such_module_anywhere  # here", "ModuleNotFoundError", id="imports in vain"),
    pytest.param("Plan()  # here", "TypeError", id="plan without anything"),
    pytest.param("def f():\n    return 1 + 'a'  # here\nPLAN = f()", "TypeError", id="raises in a function"),
    pytest.param("import json\njson.loads('{')  # here", "JSONDecodeError", id="raises in a library"),
    pytest.param("def f():\n    f()  # here\nf()", "RecursionError", id="calls itself"),
    pytest.param("raise SystemExit  # here", "SystemExit", id="exits"),
    pytest.param("import sys\nsys.exit('bye')  # here", "SystemExit: bye", id="exits with a word"),
    pytest.param("raise SystemExit(0)  # here", "SystemExit", id="exits well"),
    pytest.param("raise GeneratorExit  # here", "GeneratorExit", id="raises what no Exception is"),
    pytest.param(
        "class Odd(BaseException): pass\nraise Odd  # here", "Odd", id="raises its own kind of exception"
    ),
    pytest.param(
        "class Mute(Exception):\n    def __str__(self): raise ValueError\nraise Mute  # here",
        "Mute",
        id="raises what cannot be told",
    ),
    pytest.param("x = 1\nif x\n    y = 2", "expected ':'", id="no Python"),
    pytest.param("  x = 1  # here", "unexpected indent", id="indented"),
    pytest.param("\nPLAN = (  # here", "never closed", id="not closed"),
    pytest.param("exec('x y')  # here", "invalid syntax", id="runs what is no Python"),
    pytest.param("x = 1", "defines no PLAN", id="no plan"),
    pytest.param("PLAN = None", "defines no PLAN", id="None"),
    pytest.param("plan = Plan('a', 'b', [])", "defines no PLAN", id="small letters"),
    pytest.param("PLAN = 3", "PLAN is 3, not a Plan", id="number"),
    pytest.param("PLAN = [Probe(Command(1, 2))]", "not a Plan", id="list of probes"),
    pytest.param("PLAN = Plan", "not a Plan", id="class"),
    pytest.param("PLAN = 'x' * 100", "...", id="long text"),
    pytest.param(
        "class Shy:\n    def __repr__(self): raise ValueError\nPLAN = Shy()",
        "a Shy, not a Plan",
        id="cannot be shown",
    ),
    pytest.param(f"{LEAVES_WHEN_SHOWN}PLAN = Shy()", "not a Plan", id="exits when shown"),
    pytest.param("PLAN = Plan(1, 'b', [])", "must be texts", id="name is a number"),
    pytest.param("PLAN = Plan('a', None, [])", "must be texts", id="no summary"),
    pytest.param("PLAN = Plan('a', 'b', 3)", "stages must be a list", id="stages are a number"),
    pytest.param("PLAN = Plan('a', 'b', None)", "stages must be a list", id="no stages"),
    pytest.param("PLAN = Plan('a', 'b', 'cd')", "stages must be a list", id="stages are a text"),
    pytest.param("PLAN = Plan('a', 'b', {1: 2})", "stages must be a list", id="stages are a mapping"),
    pytest.param(
        "PLAN = Plan('a', 'b', sweep([1], [2]))", "stages must be a list", id="stages are an iterator"
    ),
    pytest.param(f"PLAN = Plan('a', 'b', [[]] * {MAX_STAGES + 1})", "at most", id="too many stages"),
    pytest.param("PLAN = Plan('a', 'b', [3])", "a stage is 3", id="a stage is a number"),
    pytest.param("PLAN = Plan('a', 'b', [None])", "a stage is None", id="a stage is None"),
    pytest.param("PLAN = Plan('a', 'b', [], stage_names='ab')", "stage_names", id="names are a text"),
    pytest.param("PLAN = Plan('a', 'b', [[]], stage_names=[5])", "stage_names", id="a name is a number"),
    pytest.param("PLAN = Plan('a', 'b', [], robots=5)", "robots", id="robots are a number"),
    pytest.param("PLAN = Plan('a', 'b', [], robots=('bolt', 5))", "robots", id="a robot is a number"),
    pytest.param("PLAN = Plan('a', 'b', [], robots='bolt')", "robots", id="robots are a text"),
    pytest.param("PLAN = Plan('a', 'b', [], robots=None)", "robots", id="robots are None"),
    pytest.param(
        "class Odd(list):\n    def __len__(self): raise ValueError\nPLAN = Plan('a', 'b', Odd())",
        "",
        id="odd list",
    ),
]


@pytest.mark.parametrize(("source", "said"), BROKEN)
def test_a_broken_plan_file(write: Write, source: str, said: str) -> None:
    path = write(source)
    with pytest.raises(BadInputFileError) as caught:
        load_plan(path)
    line = 3 if said == "expected ':'" else line_of(source)
    if said:
        assert_says(caught.value, path, line, said)
    else:
        assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    "source",
    [
        pytest.param("while True:  # here\n    pass", id="loop"),
        pytest.param("import itertools\nfor x in itertools.count():\n    pass  # here", id="counts"),
        pytest.param(
            "while True:\n    try:\n        pass\n    except Exception:\n        pass", id="swallows"
        ),
        pytest.param("def f():\n    while True:\n        pass  # here\nf()", id="loop in a function"),
        pytest.param("import time\ntime.sleep(100)  # here", id="sleeps"),
        pytest.param("import threading\nthreading.Event().wait()", id="waits"),
    ],
)
@pytest.mark.usefixtures("impatient")
def test_a_plan_file_that_does_not_end(write: Write, source: str) -> None:
    path = write(source)
    with pytest.raises(BadInputFileError, match=r"still running after 0\.05 s") as caught:
        load_plan(path)
    assert str(caught.value).startswith(f"{path}:")
    if (line := line_of(source)) and "while" not in source:
        assert str(caught.value).startswith(f"{path}:{line}: ")
    assert "end by itself" in caught.value.hint


@pytest.mark.usefixtures("impatient")
def test_an_object_that_takes_for_ever_to_show_itself(write: Write) -> None:
    path = write(
        "import time\n"
        "class Slow:\n"
        "    def __repr__(self):\n"
        "        end = time.monotonic() + 1.0\n"
        "        while time.monotonic() < end:\n"
        "            pass\n"
        "        return 'shown at last'\n"
        "PLAN = Slow()\n"
    )
    with pytest.raises(BadInputFileError, match=r"mine\.py") as caught:
        load_plan(path)
    assert "shown at last" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        pytest.param(b"", "defines no PLAN", id="empty"),
        pytest.param(b"\x00\x01\x02", "null bytes", id="zeros"),
        pytest.param(b"PLAN = 1\x00", "null bytes", id="zero at the end"),
        pytest.param(b"\xff\xfe\x8d\xd8", "utf-8", id="no text"),
        pytest.param(b"# coding: no-such-coding\n", "no-such-coding", id="unknown encoding"),
        pytest.param(b"\x7fELF\x02\x01\x01", "", id="program"),
        pytest.param(b"\x89PNG\r\n\x1a\n", "", id="picture"),
        pytest.param(b"PK\x03\x04", "", id="archive"),
        pytest.param(b"(" * 10_000, "", id="nested too deeply"),
        pytest.param(b"#" * (MAX_FILE + 1), f"larger than {MAX_FILE} bytes", id="huge"),
    ],
)
def test_a_file_that_is_no_plan(write: Write, content: bytes, said: str) -> None:
    path = write(content)
    with pytest.raises(BadInputFileError) as caught:
        load_plan(path)
    assert str(caught.value).startswith(f"{path}:")
    assert not str(caught.value).startswith(f"{path}:0")
    assert said in str(caught.value)


def test_the_largest_plan_file(write: Write) -> None:
    source = IMPORTS.encode() + b"\nPLAN = Plan('a', 'b', [])\n"
    assert load_plan(write(source + b"#" * (MAX_FILE - len(source)))).name == "a"


@given(st.binary(max_size=80))
def test_rubbish_is_no_plan(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "rubbish.py"
    path.write_bytes(content)
    with pytest.raises(BadInputFileError, match=r"rubbish\.py"):
        load_plan(path)


def test_a_missing_file(tmp_path: Path) -> None:
    path = tmp_path / "missing.py"
    with pytest.raises(BadInputFileError, match="No such file") as caught:
        load_plan(path)
    assert_says(caught.value, path, None, "No such file")
    assert "plan list" in caught.value.hint


def test_a_directory(tmp_path: Path) -> None:
    with pytest.raises(BadInputFileError, match="directory") as caught:
        load_plan(tmp_path)
    assert_says(caught.value, tmp_path, None, "directory")


def test_a_plan_that_loads_another_plan(write: Write) -> None:
    imports = "from sphero_probe.probing.plans.shipped import find_plan\n"
    assert load_plan(write(f"{imports}PLAN = find_plan('power')")).name == "power"
    with pytest.raises(BadInputFileError, match=r"^no_such_plan: no such plan$"):
        load_plan(write(f"{imports}PLAN = find_plan('no_such_plan')"))


def test_ctrl_c_in_a_plan_is_ctrl_c(write: Write) -> None:
    with pytest.raises(KeyboardInterrupt):
        load_plan(write("raise KeyboardInterrupt"))


def test_the_alarm_clock_is_left_as_it_was(write: Write) -> None:
    def ring(*_: object) -> None:
        pytest.fail("rang too late")

    before = signal.signal(signal.SIGALRM, ring)
    try:
        load_plan(write("PLAN = Plan('a', 'b', [])"))
        with pytest.raises(BadInputFileError):
            load_plan(write("raise ValueError"))
        assert signal.getsignal(signal.SIGALRM) is ring
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    finally:
        signal.signal(signal.SIGALRM, before)


def test_loading_in_a_thread(write: Write) -> None:
    good, bad = write("PLAN = Plan('a', 'b', [])"), write("raise ValueError('no good')", "bad.py")
    ends = []

    def load() -> None:
        ends.append(load_plan(good).name)
        try:
            load_plan(bad)
        except BadInputFileError as error:
            ends.append(str(error))

    thread = threading.Thread(target=load)
    thread.start()
    thread.join()
    assert ends == ["a", f"{bad}:2: ValueError: no good"]


def test_without_an_alarm_clock(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(signal, "setitimer")
    assert load_plan(write("PLAN = Plan('a', 'b', [])")).name == "a"


@pytest.mark.parametrize(
    ("stage", "said"),
    [
        pytest.param(
            "def stage(findings): raise ValueError('no good')  # here", "ValueError: no good", id="raises"
        ),
        pytest.param(
            "def stage(findings):\n    yield 1 / 0  # here", "ZeroDivisionError", id="raises on the way"
        ),
        pytest.param("def stage(): return []", "TypeError", id="takes no findings"),
        pytest.param("def stage(findings): return findings[0]  # here", "IndexError", id="wants a finding"),
        pytest.param("def stage(findings): pass", "TypeError", id="returns nothing"),
        pytest.param("def stage(findings): return 3", "TypeError", id="returns a number"),
        pytest.param("def stage(findings): raise SystemExit  # here", "SystemExit", id="exits"),
        pytest.param("def stage(findings): return 'ab'", "holds 'a', not a Probe", id="returns a text"),
        pytest.param(
            "def stage(findings): return [None]", "holds None, not a Probe", id="returns None in a list"
        ),
        pytest.param("def stage(findings): return [Command(1, 2)]", "not a Probe", id="returns commands"),
        pytest.param(
            "def stage(findings): return [(Command(1, 2), False)]", "not a Probe", id="returns tuples"
        ),
        pytest.param("def stage(findings): return [Probe((1, 2))]", "not a Command", id="probe of a tuple"),
        pytest.param("def stage(findings): return [Probe(3)]", "not a Command", id="probe of a number"),
        pytest.param("stage = [Probe(Command(256, 0))]", "did is 256", id="DID too large"),
        pytest.param("stage = [Probe(Command(-1, 0))]", "did is -1", id="DID negative"),
        pytest.param("stage = [Probe(Command('0x13', 0))]", "did is '0x13'", id="DID a text"),
        pytest.param("stage = [Probe(Command(None, 0))]", "did is None", id="DID None"),
        pytest.param("stage = [Probe(Command(1.0, 0))]", "did is 1.0", id="DID a float"),
        pytest.param("stage = [Probe(Command(0, 256))]", "cid is 256", id="CID too large"),
        pytest.param("stage = [Probe(Command(0, None))]", "cid is None", id="CID None"),
        pytest.param("stage = [Probe(Command(0, 0, b'', 256))]", "target is 256", id="target too large"),
        pytest.param("stage = [Probe(Command(0, 0, b'', '0x11'))]", "target is '0x11'", id="target a text"),
        pytest.param("stage = [Probe(Command(0, 0, 'abc'))]", "payload is 'abc'", id="payload a text"),
        pytest.param("stage = [Probe(Command(0, 0, [1, 2]))]", "payload is [1, 2]", id="payload a list"),
        pytest.param("stage = [Probe(Command(0, 0, None))]", "payload is None", id="payload None"),
        pytest.param(
            "stage = [Probe(Command(0, 0, bytearray(2)))]", "payload is bytearray", id="payload mutable"
        ),
        pytest.param("stage = [Probe(Command(0, 0, bytes(5000)))]", "payload", id="payload in no frame"),
        pytest.param(
            "import itertools\nstage = itertools.count()", "holds 0, not a Probe", id="counts for ever"
        ),
        pytest.param(
            "import itertools\ndef stage(findings): return itertools.repeat(Probe(Command(0, 0)))",
            f"more than {MAX_PROBES}",
            id="repeats for ever",
        ),
        pytest.param(f"{LEAVES_WHEN_SHOWN}stage = [Shy()]", "not a Probe", id="exits when shown"),
    ],
)
def test_a_broken_stage(write: Write, stage: str, said: str) -> None:
    source = f"{stage}\nPLAN = Plan('a', 'b', [[Probe(Command(0x13, 0x10))], stage])"
    path = write(source)
    plan = load_plan(path)
    assert list(probes_of(plan, plan.stages[0], ())) == [Probe(BATTERY)]
    with pytest.raises(BadInputFileError) as caught:
        probes_of(plan, plan.stages[1], ())
    assert_says(caught.value, path, line_of(source), said)


@pytest.mark.parametrize(
    "stage",
    [
        pytest.param("def stage(findings):\n    while True: pass", id="loop"),
        pytest.param(
            "def stage(findings):\n    while True:\n        yield from ()", id="generator that yields nothing"
        ),
        pytest.param(
            "def stage(findings):\n    yield Probe(Command(0, 0))\n    while True: pass",
            id="generator that stops yielding",
        ),
    ],
)
@pytest.mark.usefixtures("impatient")
def test_a_stage_that_does_not_end(write: Write, stage: str) -> None:
    path = write(f"{stage}\nPLAN = Plan('a', 'b', [stage])")
    plan = load_plan(path)
    with pytest.raises(BadInputFileError, match=r"still running after 0\.05 s") as caught:
        probes_of(plan, plan.stages[0], ())
    assert str(caught.value).startswith(f"{path}:")


def test_a_plan_built_in_memory_names_itself() -> None:
    no_probes: Any = [3]

    def broken(_: Sequence[Finding]) -> list[Probe]:
        raise ValueError("no good")

    with pytest.raises(BadInputFileError, match=r"^plan: ValueError: no good$"):
        probes_of(plan_of(broken), broken, ())
    with pytest.raises(BadInputFileError, match=r"^made: a stage holds 3, not a Probe$"):
        probes_of(plan_of(no_probes), no_probes, ())


@pytest.mark.unmeasured
def test_the_largest_stage() -> None:
    stage = list(sweep(range(256), range(256))) * 4
    assert len(stage) == MAX_PROBES
    assert list(probes_of(plan_of(stage), stage, ())) == stage
    with pytest.raises(BadInputFileError, match="more than"):
        probes_of(plan_of(stage), [*stage, stage[0]], ())


def test_what_stands_in_a_probe_may_be_anything_that_fits() -> None:
    stage = [
        Probe(Command(0x00, 0xFF, b"", None)),
        Probe(Command(0xFF, 0x00, bytes(40), 0x00), exact=True),
        Probe(Command(0x13, 0x10, b"", 0xFF)),
    ]
    assert list(probes_of(plan_of(stage), stage, ())) == stage
    assert list(probes_of(plan_of(), iter(stage), ())) == stage
    assert list(probes_of(plan_of(), lambda findings: tuple(stage), ())) == stage
    assert list(probes_of(plan_of(), (), ())) == []


def test_sweeping() -> None:
    assert list(sweep([0x13, 0x1A], [0x00, 0x10])) == [
        Probe(Command(did, cid)) for did, cid in itertools.product([0x13, 0x1A], [0x00, 0x10])
    ]
    assert list(sweep(iter([0x13, 0x1A]), iter([0x00]))) == [Probe(Command(0x13, 0)), Probe(Command(0x1A, 0))]
    assert list(sweep([0x13], [0x10], target=0x12)) == [Probe(Command(0x13, 0x10, b"", 0x12))]
    assert list(sweep([0x13], [0x10], payload=b"\x01")) == [Probe(Command(0x13, 0x10, b"\x01"), exact=True)]
    assert list(sweep([0x13], [0x10], payload=b"")) == [Probe(Command(0x13, 0x10), exact=True)]
    assert list(sweep([], [0x10])) == list(sweep([0x13], [])) == []


EACH_SHIPPED = pytest.mark.parametrize("path", [pytest.param(path, id=path.stem) for path in PLANS])


def test_shipped_plans_are_listed() -> None:
    assert plans_folder().is_dir()
    assert len(PLANS) >= 3
    assert sorted(PLANS) == PLANS
    assert all(path.parent == plans_folder() and path.suffix == ".py" for path in PLANS)


def test_the_plans_folder_of_an_installed_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from sphero_probe.probing.plans import shipped as shipped_module

    monkeypatch.setattr(shipped_module, "_PACKAGE", tmp_path / "sphero_probe")
    assert plans_folder() == tmp_path / "probe_plans"
    assert plan_files() == []
    installed = tmp_path / "sphero_probe" / "probe_plans"
    installed.mkdir(parents=True)
    for name in ("b.py", "a.py", "_hidden.py", "notes.txt"):
        (installed / name).write_text("")
    assert plans_folder() == installed
    assert [path.name for path in plan_files()] == ["a.py", "b.py"]


@EACH_SHIPPED
def test_a_shipped_plan_loads(path: Path) -> None:
    plan = load_plan(path)
    assert plan.name == path.stem
    assert plan.summary
    assert "\n" not in plan.summary
    assert plan.file == path
    assert set(plan.robots) <= set(ROBOTS)
    assert plan.stages
    for stage in plan.stages:
        probes = probes_of(plan, stage, ())
        assert callable(stage) or probes


@EACH_SHIPPED
@pytest.mark.parametrize(
    "form", ["{stem}", "{stem}.py", "probe_plans/{stem}.py", "probe_plans/{stem}", "{path}"]
)
def test_a_shipped_plan_is_found(
    path: Path, form: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_plan(form.format(stem=path.stem, path=path)).file == path


def test_a_file_comes_before_a_plan_of_the_same_name(
    write: Write, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    write("PLAN = Plan('mine', 'b', [])", "power.py")
    monkeypatch.chdir(tmp_path)
    assert find_plan("power.py").name == "mine"
    assert find_plan("power").name == "power"


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("no_such_plan", id="unknown name"),
        pytest.param("no_such_plan.py", id="unknown file"),
        pytest.param("power.txt", id="another ending"),
        pytest.param("elsewhere/power.py", id="another folder"),
        pytest.param("_hidden", id="hidden"),
        pytest.param("", id="empty"),
        pytest.param(".", id="this folder"),
        pytest.param("/", id="the root"),
        pytest.param("x" * 5000, id="very long"),
        pytest.param("pow\0er", id="zero"),
        pytest.param("\x1b[31mpower", id="escape sequence"),
    ],
)
def test_a_plan_that_is_not_there(text: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInputFileError) as caught:
        find_plan(text)
    assert "no such plan" in str(caught.value)
    assert "power" in caught.value.hint


def test_a_broken_plan_is_found_broken(write: Write) -> None:
    path = write("raise ValueError('no good')")
    with pytest.raises(BadInputFileError, match=":2: ValueError: no good"):
        find_plan(str(path))
    assert Path(path).is_file()

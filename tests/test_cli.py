"""The command line: exit status, what stands on which stream, and what is written where."""

import importlib
import importlib.metadata
import json
import os
import platform
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import cvxupdate
from cvxupdate import cli
from cvxupdate.commands.shared import display

CHAIN = """
title = "Two masses"

[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }]

[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 4.0e5 }, { id = 2, nodes = [1, 2], k = 3.0e5 }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 6.5, group = "floor" },
        { id = 12, nodes = [2], m = 5.0, group = "floor" }]

[[recordings]]
kind = "modes"
rows = [{ frequency = 26.1 }, { frequency = 60.9 }]

[update]
method = "frequencies"
parameters = [
  { elements = [1, 2], of = "k", each = "element", lower = -0.3, upper = 0.3 },
  { group = "floor", of = "m", lower = -0.02, upper = 0.02 },
]
"""
RAN = ["chain/run/report.html", "chain/run/result.json", "chain/run/updated/problem.toml"]
IMPOSSIBLE = CHAIN + "\n[constraints.total_mass]\nvalue = 20.0\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to work in, with a problem file in chain/."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "chain").mkdir()
    (tmp_path / "chain" / "problem.toml").write_text(CHAIN, encoding="utf-8")
    return tmp_path


@pytest.fixture
def call(here, monkeypatch, capsys):
    """Call the command line in this process: (exit status, standard output, standard error)."""

    def go(*arguments):
        monkeypatch.setattr(sys, "argv", ["cvxupdate", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return go


def command(*arguments, **keywords):
    """The installed command in a process of its own."""
    return subprocess.run(
        [Path(sys.executable).parent / "cvxupdate", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        **keywords,
    )


def test_the_module_is_the_command():
    """`python -m cvxupdate`, for those whose path does not hold the script."""
    done = subprocess.run(
        [sys.executable, "-m", "cvxupdate", "--version"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout == command("--version").stdout


def files(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def one_line(text):
    assert (
        text.startswith("cvxupdate: ")
        and text.endswith("\n")
        and text.count("\n") == 1
        and "Traceback" not in text
    )
    return text


# ── an error of its own: 1
# ───────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("verb", ["run", "diagnose", "correlate"])
def test_an_error_of_its_own_is_one_line_without_a_traceback(call, here, monkeypatch, verb):
    """It says what and where, writes nothing, and lets the whole traceback through where that is
    asked for."""
    import cvxupdate.study

    def stumble(*args, **keywords):
        return [][3]

    monkeypatch.setattr(cvxupdate.study, "spec_of", stumble)
    code, out, err = call(verb, "chain/problem.toml")
    assert code == 1 and out == "" and files(here / "out") == []
    said = one_line(err)
    assert (
        "IndexError: list index out of range (cvxupdate/study.py, line " in said
        and "not of your files" in said
    )
    monkeypatch.setenv("CVXUPDATE_DEBUG", "1")
    monkeypatch.setattr(sys, "argv", ["cvxupdate", verb, "chain/problem.toml"])
    with pytest.raises(IndexError):
        cli.main()


# ── done: 0
# ──────────────────────────────────────────────────────────────────────────────────────────────────


def test_run_writes_both_files_and_a_summary(call, here):
    code, out, err = call("run", "chain/problem.toml")
    assert (code, err) == (0, "")
    assert files(here / "out") == RAN
    assert "e1.k" in out and "out/chain/run/report.html" in out and "mean frequency error" in out


@pytest.mark.parametrize("verb", ["run", "correlate", "solvers", "view", "check"])
def test_nothing_that_is_written_tells_whose_machine_it_was(call, here, verb):
    """No absolute path, no user, no host: in no file, and not on the terminal."""
    code, out, err = call(verb, here / "chain" / "problem.toml")
    assert code == 0
    written = [p.read_text(encoding="utf-8") for p in (here / "out").rglob("*.*") if p.is_file()]
    assert bool(written) == (verb != "check")
    private = {str(here), str(Path.home()), platform.node()} - {"", "/"}
    if verb == "check":  # it says which file it means as it was told
        out = out.replace(str(here / "chain" / "problem.toml"), "")
    assert not [p for p in private for text in (*written, out, err) if len(p) > 3 and p in text]


def test_json_is_all_there_is_on_standard_output(call, here):
    code, out, err = call("run", "chain/problem.toml", "--json", "--out", "here/and there")
    assert (code, err) == (0, "")
    data = json.loads(out)
    assert data["status"] == "converged" and data["problem"] == "chain"
    assert (
        json.loads((here / "here" / "and there" / "result.json").read_text(encoding="utf-8"))
        == data
    )
    assert not (here / "out").exists()


def test_solvers(call, here):
    code, out, _ = call("solvers", "chain/problem.toml")
    assert (
        code == 0
        and "CLARABEL" in out
        and "agree" in out
        and files(here / "out") == ["chain/solvers/report.html", "chain/solvers/result.json"]
    )
    code, out, err = call("solvers", "chain/problem.toml", "--json")
    data = json.loads(out)
    assert (
        (code, err) == (0, "")
        and data["status"] == "optimal"
        and data["spread"] < 1e-6
        and len(data["solvers"]) >= 4
    )
    done = command("solvers", "chain/problem.toml", "--json")  # solvers print at C level
    assert json.loads(done.stdout)["status"] == "optimal"


def test_check_and_schema(call, here):
    code, out, err = call("check", "chain/problem.toml")
    assert (code, err) == (
        0,
        "",
    ) and "in order. 2 nodes, 4 elements, 2 free DOFs, 1 recording, 3 parameters." in out
    code, out, _ = call("check", "chain/problem.toml", "--json")
    assert code == 0 and json.loads(out)["faults"] == [] and json.loads(out)["parameters"] == 3
    code, out, err = call("schema")
    assert (code, err) == (0, "") and json.loads(out) == cvxupdate.schema()
    assert files(here) == ["chain/problem.toml"], "check and schema write nothing"


@pytest.mark.parametrize("verb", ["check", "diagnose"])
def test_an_effect_that_is_not_implemented_is_refused(call, here, verb):
    from cvxupdate.physics import effect_names
    from cvxupdate.physics.effect import MOTION
    from cvxupdate.spec.update import PHYSICS

    known = (*effect_names(), *effect_names(MOTION))
    missing = [word for word in PHYSICS if word not in known]
    (here / "chain/problem.toml").write_text(
        CHAIN + f'[diagnose]\nphysics = ["added_mass", {", ".join(map(json.dumps, missing))}]\n'
    )
    code, out, err = call(verb, "chain/problem.toml")
    if not missing:  # every effect of the contract is there
        assert code == 0
        return
    assert (code, out) == (2, "") and "Traceback" not in err
    for i, word in enumerate(missing, 1):
        assert f"diagnose.physics[{i}]: '{word}' is not implemented yet" in err
    assert "Implemented: added_mass" in err and "'added_mass'" not in err
    assert files(here) == ["chain/problem.toml"], "nothing is written"


@pytest.mark.parametrize("thorough", [False, True])
def test_thorough_and_jobs_reach_the_diagnosis(call, here, monkeypatch, thorough):
    """Its time is not limited then; what a diagnosis says otherwise is not at stake here."""
    from cvxupdate.errors import InputError

    def noted(spec, model, recordings, progress, without_limit, jobs):
        raise InputError(f"without limit: {without_limit}, processes: {jobs}")

    package = importlib.import_module("cvxupdate.diagnose")  # the name is also a function's
    monkeypatch.setattr(package, "diagnose_problem", noted)
    option = ["--thorough", "--jobs", "3"] if thorough else []
    status, _, err = call("diagnose", "chain/problem.toml", *option)
    assert status == 2 and f"without limit: {thorough}" in err
    assert f"processes: {3 if thorough else None}" in err
    assert call("diagnose", "chain/problem.toml", "--jobs", "0")[0] == 2


def test_run_does_not_ask_what_diagnose_may_consider(call, here):
    (here / "chain/problem.toml").write_text(CHAIN + '[diagnose]\nphysics = ["clearance"]\n')
    assert call("run", "chain/problem.toml")[0] == 0


def test_help_names_every_command(call):
    code, out, err = call("--help")
    assert (code, err) == (0, "")
    assert all(
        word in out for word in ("run", "correlate", "inspect", "solvers", "check", "schema")
    )
    code, out, _ = call("run", "--help")
    assert code == 0 and "--out" in out and "--json" in out and "PROBLEM" in out


# ── bad input: 2, nothing written
# ────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("verb", ["run", "correlate", "solvers", "check"])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("dofs", "dof_s"), "model.dof_s: unknown key"),
        (("k = 4.0e5", "k = nan"), "not a finite number"),
        (("nodes = [1, 2], k", "nodes = [1, 7], k"), "7"),
        ((CHAIN, "this is no TOML"), "is not valid TOML"),
    ],
)
def test_bad_input(call, here, verb, change, words):
    path = here / "chain" / "problem.toml"
    path.write_text(CHAIN.replace(*change, 1), encoding="utf-8")
    code, out, err = call(verb, path)
    assert code == 2 and out == "" and words in err and "Traceback" not in err
    assert files(here) == ["chain/problem.toml"]


def test_every_fault_at_once(call, here):
    path = here / "chain" / "problem.toml"
    path.write_text(
        CHAIN.replace("k = 4.0e5", 'k = "stiff"').replace("m = 6.5", "m = -6.5"), encoding="utf-8"
    )
    code, _, err = call("check", path)
    assert code == 2 and err.count("problem.toml: ") == 2
    code, out, err = call("check", path, "--json")
    faults = json.loads(out)["faults"]
    assert (
        code == 2
        and err == ""
        and len(faults) == 2
        and all(set(f) == {"file", "key", "problem", "remedy"} for f in faults)
    )


def test_bad_input_with_json_leaves_standard_output_empty(call):
    code, out, err = call("run", "nowhere.toml", "--json")
    assert (code, out) == (2, "") and "there is no such file" in one_line(err)


def test_run_without_an_update_table(call, here):
    path = here / "chain" / "problem.toml"
    path.write_text(CHAIN[: CHAIN.index("[update]")], encoding="utf-8")
    code, _, err = call("run", path)
    assert code == 2 and "[update]" in one_line(err) and not (here / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("walk",), "No such command 'walk'"),
        (("run",), "Missing argument 'PROBLEM'"),
        (("run", "a", "b"), "unexpected extra argument"),
        (("run", "a", "--jsn"), "No such option"),
        (("run", "a", "--out"), "--out"),
    ],
)
def test_usage_errors_are_one_line(call, here, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "") and words in one_line(err)
    known = "cvxupdate run --help" if arguments[0] == "run" else "cvxupdate --help"
    assert known in err
    assert files(here) == ["chain/problem.toml"]


def test_a_notebook_s_own_settings_do_no_harm(call, monkeypatch):
    """Its kernel names a backend of figures that only it has, and passes for a terminal that would
    keep every frame of a line that moves."""
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    assert call("--version")[0] == 0 and "MPLBACKEND" not in os.environ
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    for name, shown in (("", True), ("JPY_PARENT_PID", False)):
        monkeypatch.delenv("JPY_PARENT_PID", raising=False)
        if name:
            monkeypatch.setenv(name, "12")
        with display(False) as line:
            assert (line is not None) == shown


def test_version_and_completion(call):
    assert call("--version") == (0, f"cvxupdate {cvxupdate.__version__}\n", "")
    code, out, _ = call("--help")
    assert code == 0 and "--install-completion" in out
    code, out, _ = call("inspect", "--help")
    assert code == 0 and "[[recordings]]" in out  # brackets are no markup


def test_no_command_shows_the_help(call):
    code, out, err = call()
    assert code == 2 and "Usage" in out + err and "Traceback" not in err


def test_out_that_cannot_be_a_folder(call, here, monkeypatch):
    (here / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setattr(
        "cvxupdate.study.run",
        lambda *_: pytest.fail("the work was done before --out was looked at"),
    )
    for out in ("file", "file/below/it"):
        code, said, err = call("run", "chain/problem.toml", "--out", out, "--json")
        assert (code, said) == (2, "") and "not a folder" in one_line(err) and "--out" in err
    assert (
        files(here) == ["chain/problem.toml", "file"]
        and (here / "file").read_text(encoding="utf-8") == "in the way"
    )


def test_write_that_fails_leaves_what_was_there(call, here, monkeypatch):
    call("run", "chain/problem.toml")
    before = {p: (here / "out" / p).read_bytes() for p in files(here / "out")}
    written = Path.write_text

    def full(self, text, **keywords):
        if "report.html" in self.name:
            raise OSError(28, "No space left on device")
        return written(self, text, **keywords)

    monkeypatch.setattr(Path, "write_text", full)
    code, _, err = call("run", "chain/problem.toml")
    assert code == 2 and "No space left on device" in one_line(err)
    assert {p: (here / "out" / p).read_bytes() for p in files(here / "out")} == before


# ── infeasible, not converged: 3
# ─────────────────────────────────────────────────────────────────────────────────


def test_infeasible_writes_why(call, here):
    (here / "chain" / "problem.toml").write_text(IMPOSSIBLE, encoding="utf-8")
    code, out, err = call("run", "chain/problem.toml", "--json")
    data = json.loads(out)
    assert (code, err) == (3, "") and data["status"] == "infeasible"
    assert [
        any(word in clause for clause in data["certificate"]["conflict"])
        for word in ("total mass", "floor.m")
    ] == [True, True]
    assert files(here / "out") == RAN[:2]
    code, out, _ = call("run", "chain/problem.toml")
    assert code == 3 and "contradict" in out and "total mass set to 20 kg" in out
    code, out, _ = call("solvers", "chain/problem.toml", "--json")
    assert code == 3 and json.loads(out)["status"] == "infeasible"


def test_stopped_short_is_3(call, here):
    (here / "chain" / "problem.toml").write_text(
        CHAIN.replace('"frequencies"', '"frequencies"\nmax_iterations = 1\ntolerance = 1e-14'),
        encoding="utf-8",
    )
    code, out, _ = call("run", "chain/problem.toml", "--json")
    data = json.loads(out)
    assert (
        code == 3
        and data["status"] == "stopped"
        and "limit of 1 iterations" in data["reason"]
        and data["iterations"] == 1
    )


# ── interrupted: 130
# ─────────────────────────────────────────────────────────────────────────────────────────────


def test_interrupted_keeps_what_was_finished(call, here, monkeypatch):
    call("run", "chain/problem.toml")
    before = (here / "out" / "chain" / "run" / "result.json").read_bytes()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("cvxupdate.study.run", stop)
    code, out, err = call("run", "chain/problem.toml")
    assert (code, out) == (130, "") and "interrupted" in one_line(err)
    assert (
        files(here / "out") == RAN
        and (here / "out" / "chain" / "run" / "result.json").read_bytes() == before
    )


@pytest.mark.slow
def test_control_c_in_the_middle_of_a_run(here):
    """The signal itself, sent while the work runs; no half-written file stays."""
    script = (
        "import cvxupdate.study as s, cvxupdate.cli as c, sys, time\n"
        "def run(*_):\n    print('started', flush=True)\n    time.sleep(60)\n"
        "s.run = run\nsys.argv = ['cvxupdate', 'run', 'chain/problem.toml']\nc.main()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=here,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # a background job inherits "ignored"
    assert process.stdout.readline() == "started\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (
        process.returncode == 130
        and "interrupted" in one_line(err)
        and files(here) == ["chain/problem.toml"]
    )


# ── the installed command
# ────────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.slow
def test_installed_command(here):
    done = command(
        "run",
        "chain/problem.toml",
        "--json",
        cwd=here,
        env={**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    )
    assert (
        done.returncode == 0
        and done.stderr == ""
        and json.loads(done.stdout)["status"] == "converged"
    )
    done = command(
        "run",
        "chain/problem.toml",
        cwd=here,
        env={**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0 and done.stderr == "" and "±" in done.stdout
    done = command("run", "missing.toml", cwd=here)
    assert (
        done.returncode == 2
        and done.stdout == ""
        and "there is no such file" in one_line(done.stderr)
    )
    assert command("--help", cwd=here).returncode == 0


@pytest.mark.slow
def test_progress_on_a_terminal_only_and_never_with_json(here):
    """Standard error is a terminal: the run tells how far it is, and stays silent with --json."""
    pty = pytest.importorskip("pty", reason="no pseudo-terminals on this system")
    said = {}
    for option in ((), ("--json",)):
        leader, follower = pty.openpty()
        with subprocess.Popen(
            [Path(sys.executable).parent / "cvxupdate", "run", "chain/problem.toml", *option],
            cwd=here,
            stdout=subprocess.PIPE,
            stderr=follower,
            env={**os.environ, "TERM": "xterm"},
        ) as process:
            os.close(follower)
            chunks = []
            while True:
                try:
                    chunk = os.read(leader, 4096)
                except OSError:
                    break
                if not chunk:
                    break
                chunks.append(chunk)
            process.communicate(timeout=60)
            said[option] = b"".join(chunks).decode()
        os.close(leader)
        assert process.returncode == 0
    assert "setting up" in said[()] or "iteration" in said[()]
    assert said["--json",] == ""


# ── the public names
# ─────────────────────────────────────────────────────────────────────────────────────────────


def test_public_names_are_these():
    assert set(cvxupdate.__all__) == {
        "ConvergenceError",
        "CorrelateResult",
        "CvxupdateError",
        "DiagnoseResult",
        "Fault",
        "Frf",
        "IdentifyResult",
        "PlanResult",
        "identify",
        "plan",
        "InfeasibleError",
        "InputError",
        "ModeResult",
        "Model",
        "ModelError",
        "Modes",
        "ParameterResult",
        "Problem",
        "ProblemFileError",
        "ProblemWarning",
        "RecordingError",
        "Spec",
        "TimeHistory",
        "UpdateResult",
        "Updated",
        "__version__",
        "check",
        "check_problem",
        "correlate",
        "diagnose",
        "inspect",
        "load_problem",
        "open_problem",
        "run",
        "run_files",
        "schema",
        "solvers",
        "solvers_files",
        "update",
    }
    assert sorted(cvxupdate.__all__, key=str) == list(cvxupdate.__all__) == dir(cvxupdate)
    for name in cvxupdate.__all__:
        assert getattr(cvxupdate, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'updat'"):
        _ = cvxupdate.updat


def test_version_is_that_of_the_package():
    assert cvxupdate.__version__ == importlib.metadata.version("cvxupdate")


def test_import_is_light():
    code = (
        "import numpy, sys, time; t = time.perf_counter(); import cvxupdate; took = "
        "time.perf_counter() - t\nheavy = {'scipy', 'cvxpy', 'matplotlib', 'pydantic', "
        "'rich', 'jinja2', 'h5py', 'pyuff', 'typer'} & set(sys.modules)\nprint(took, "
        "sorted(heavy))"
    )
    took, heavy = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split(maxsplit=1)
    assert heavy.strip() == "[]" and float(took) < 0.3


def test_reading_a_problem_loads_no_solver_and_no_figures(here):
    code = (
        "import sys, cvxupdate; cvxupdate.load_problem('chain/problem.toml'); import "
        "cvxupdate.cli\nprint(sorted({'cvxpy', 'matplotlib', 'scipy.optimize', 'h5py', "
        "'pyuff'} & set(sys.modules)))"
    )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=here
        ).stdout.strip()
        == "[]"
    )

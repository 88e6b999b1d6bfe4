"""The commands as functions: a diagnosis by the README's lines, what is written, and what goes wrong."""

import dataclasses
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import asid
from asid.program import arguments, call
from asid.results import Diagnosis, Run, StudyIdentification

#: The smallest searches: the way through the program is that of long ones.
FIT = {f"gauss_newton.{name}": n for name, n in [("iterations", 1), ("screened", 4), ("starts", 1), ("rounds", 1)]}
SEARCH = {f"{part}.{name}": n for part in ("identifier", "solver") for name, n in [("iterations", 1), ("population", 8)]}


@pytest.fixture(scope="session")
def readme(repository: Path) -> dict:
    """What the README's lines of Python leave, run where the README lies."""
    text = (repository / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 5
    names: dict = {}
    code = code.replace('"studies/', f'"{repository}/studies/')
    exec(compile(code, "README.md", "exec"), names)
    return names


def test_the_readme_diagnoses_a_study(readme):
    found = next(value for value in readme.values() if isinstance(value, Diagnosis))
    assert found.verdict.kind in ("effects", "unknown", "none")
    total = sum(h.probability for h in found.hypotheses)
    assert abs(total - 1.0) < 1e-6, "probabilities are of exact sets"
    assert isinstance(found.parameters[0].interval95, np.ndarray)
    table = found.frame("hypotheses")
    assert isinstance(table, pandas.DataFrame) and list(table.columns) == ["effects", "probability"]
    assert found.report.exists()
    log = found.log("train-1")
    assert (log["time"].diff().dropna() > 0).all()


def test_a_result_is_read_from_its_folder_and_goes_with_a_temporary_one(repository, tmp_path):
    study = repository / "studies/servo-pendulum"
    out = tmp_path / "out"
    found = asid.identify(study, out=out, set=FIT)
    assert isinstance(found, StudyIdentification) and found.folder == out
    again = StudyIdentification.read(out)
    assert [p.name for p in again.parameters] == [p.name for p in found.parameters]
    np.testing.assert_array_equal(again.parameters[0].interval95, found.parameters[0].interval95)
    assert again.gap.identified == found.gap.identified
    fleeting = asid.identify(study, set=FIT)
    folder = fleeting.folder
    assert (folder / "posterior.json").exists()
    del fleeting
    assert not folder.exists()


def test_a_run_keeps_its_dictionaries_of_options(tmp_path):
    found = asid.run(
        "sphere-striking",
        out=tmp_path / "out",
        backend="mujoco",
        explorer="random",
        seed=1,
        truth={"rolling_friction": 0.005},
        set=SEARCH,
    )
    assert isinstance(found, Run)
    (unknown,) = found.parameters
    assert unknown.name == "rolling_friction" and unknown.truth == 0.005
    assert unknown.interval95[0] <= unknown.estimate <= unknown.interval95[1]
    assert {f.name for f in dataclasses.fields(found)} >= {"exploration", "downstream", "cost"}
    assert len(found.log("real")) > 1


def test_errors_are_the_program_s_one_line(repository):
    with pytest.raises(asid.UsageError) as wrong:
        asid.run("rod-balancin")
    line = str(wrong.value)
    assert "`rod-balancing`" in line and "\n" not in line
    said = subprocess.run([asid.program(), "run", "rod-balancin"], capture_output=True, text=True)
    assert said.returncode == 2 and said.stderr.strip() == f"asid: {line}"
    with pytest.raises(ValueError, match="no_such_option|no-such-option"):
        asid.run("rod-balancing", no_such_option=1)


def test_a_number_of_numpy_is_one_value():
    options = {"seeds": np.int64(3), "limit": np.float32(0.5), "set": {"seed": np.int32(7)}}
    assert arguments(options) == ["--seeds=3", "--limit=0.5", "--set=seed=7"]
    assert arguments({"seed": np.array([1, 2])}) == ["--seed=1", "--seed=2"]


def test_a_list_of_texts_is_one_of_toml():
    """Symptom: UsageError of ``set={"without": ["gravity-tilt"]}``. Cause: the texts had no quotes."""
    options = {"set": {"a.b": ["x", 1, [True, 'say "x"']], "c": Path("d/e"), "f": np.bool_(True), "g": np.array([0.5, 1])}}
    expected = ['a.b=["x",1,[true,"say \\"x\\""]]', "c=d/e", "f=true", "g=[0.5,1.0]"]
    assert arguments(options) == ["--set=" + text for text in expected]


@pytest.mark.skipif(os.name == "nt", reason="signals of Windows end no call")
def test_an_exception_leaves_no_program_behind(tmp_path, monkeypatch):
    sleeper = tmp_path / "asid"
    sleeper.write_text("#!/bin/sh\nexec sleep 60\n")
    sleeper.chmod(0o755)
    monkeypatch.setenv("ASID", str(sleeper))
    started = []
    open_process = subprocess.Popen

    def open_and_remember(*words, **options):
        started.append(open_process(*words, **options))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", open_and_remember)

    def late(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, late)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(TimeoutError):
            call([])
    finally:
        signal.signal(signal.SIGALRM, before)
    assert started[0].returncode == -signal.SIGKILL, "it was killed, and its end was waited for"


def test_ctrl_c_ends_a_diagnosis_with_what_is_known(repository, tmp_path):
    study, out = repository / "studies/servo-pendulum", tmp_path / "out"
    code = (
        "import asid\n"
        f"found = asid.diagnose({str(study)!r}, minutes=10, out={str(out)!r}, progress=True)\n"
        "print(found.verdict.kind, found.sentence)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    # The first ranking of explanations is there: from here on an interruption has an answer.
    while not re.match(r"\d+\.\d s, ", child.stderr.readline()):
        assert child.poll() is None
    child.send_signal(signal.SIGINT)
    output, said = child.communicate(timeout=120)
    assert child.returncode == 0 and output.split()[0] in ("effects", "unknown", "none"), said
    assert (out / "result.json").exists() and "Traceback" not in said


def test_the_program_is_a_command_of_the_environment():
    program = Path(sys.executable).parent / "asid"
    said = subprocess.run([program, "list", "--json"], capture_output=True, text=True, check=True)
    for engine in ("mujoco", "rapier"):
        assert engine in said.stdout and engine in asid.backends()

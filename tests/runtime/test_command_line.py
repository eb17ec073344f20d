"""Options, and how scripts end: one line for what a user can do something about."""

import errno
import re
import sys
from pathlib import Path

import pytest

from slurrycast.runtime.command_line import EXIT_UNFINISHED, Parser, input_file, named_file, parse, run_main
from slurrycast.runtime.files import InputError, RunError, Unfinished, write_text


@pytest.fixture(autouse=True)
def no_options(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["script"])


def ends_with(error: BaseException):
    def main(args):
        raise error

    with pytest.raises(SystemExit) as exit_:
        run_main(main, lambda parser: None, "what it does")
    return exit_.value.code


@pytest.mark.parametrize("error", [InputError, RunError])
def test_bad_input_and_failed_runs_end_with_one_line(error):
    # a text as code: printed, exit code 1
    assert ends_with(error("a.h5: frame 9 is not in the file")) == "error: a.h5: frame 9 is not in the file"


def test_run_that_stopped_on_purpose_has_a_code_of_its_own(capsys):
    assert ends_with(Unfinished("[6] stopped at step 50")) == EXIT_UNFINISHED == 75
    assert capsys.readouterr().err == "[6] stopped at step 50\n"


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "a.csv"), "a.csv: No space left on device"),
        (FileNotFoundError(errno.ENOENT, "No such file", "a", None, "b"), "a to b: No such file"),
    ],
)
def test_errors_of_the_file_system_are_one_line(error, line):
    assert ends_with(error) == f"error: {line}; what was finished before is kept"


@pytest.mark.parametrize("error", [ZeroDivisionError(), OSError("of a library")])
def test_other_errors_keep_their_traceback(error):
    with pytest.raises(type(error)):
        ends_with(error)


def parsed(*words: str):
    parser = Parser("what it does")
    parser.add_argument("--data", type=input_file)
    parser.add_argument("--tables", type=named_file)
    return parser.parse_args(words)


def test_damaged_or_missing_input_is_refused_before_any_work(tmp_path, capsys):
    data = tmp_path / "initial.data"
    for what in ("no such file", "not what was written there"):
        with pytest.raises(SystemExit) as exit_:
            parsed("--data", str(data))
        assert exit_.value.code == 2
        assert re.fullmatch(rf"error: argument --data: {data}: {what}.*\n", capsys.readouterr().err)
        write_text(data, "whole")
        data.write_text("edited")
    write_text(data, "whole")
    assert parsed("--data", str(data)).data == data


def test_named_inputs(tmp_path, capsys):
    write_text(tmp_path / "a.csv", "")
    assert parsed("--tables", f"affine={tmp_path / 'a.csv'}").tables == ("affine", tmp_path / "a.csv")
    for text in ("a.csv", "=a.csv", "affine="):
        with pytest.raises(SystemExit):
            parsed("--tables", text)
        assert capsys.readouterr().err == f"error: argument --tables: {text!r} is not name=path\n"


def test_outputs_and_inputs_are_required_unless_there_may_be_none(tmp_path):
    parser = Parser("what it does")
    parser.add_input("--frames", "frames", nargs="*")
    parser.add_input("--noise", "noise", required=False)
    parser.add_output("--table", "table")
    parser.add_lammps()
    args = parser.parse_args(["--table", "a.csv"])
    assert (args.frames, args.noise, args.table) == ([], None, Path("a.csv"))
    assert (args.executable, args.launcher, args.ranks) == ("lmp", "mpiexec", 1)
    with pytest.raises(SystemExit):
        parser.parse_args([])
    with pytest.raises(SystemExit):
        parser.parse_args(["--table", "a.csv", "--noise", str(tmp_path / "missing.csv")])


def options_of_a_script(parser: Parser):
    parser.add_value("--surrogate", "label")
    parser.add_value("--frame", "number", type=int, default=None)
    parser.add_value("--model-epochs", "number", type=int, default=None)
    parser.add_tables("cost_scaling")
    for name in ("runs", "thermo", "rdf"):
        parser.add_value(f"--{name}", "names", nargs="*", default=[])
    parser.as_many_of_each("runs", "thermo")
    parser.one_each("thermo", "rdf")
    parser.needs(lambda args: ["model_epochs"] if args.surrogate == "network" else [])
    parser.add_check(lambda args: "not this frame" if args.frame == 7 else None)


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ("--surrogate affine --runs a --thermo a --rdf b --frame 6", None),
        ("--runs a --thermo a --rdf b", "the following arguments are required: --surrogate"),
        ("--surrogate affine --runs a b --thermo a", "--runs and --thermo: as many of each are needed"),
        ("--surrogate affine --rdf a", "0 --thermo but 1 --rdf: one each is needed"),
        ("--surrogate network", "network needs --model-epochs"),
        ("--surrogate affine --frame 7", "not this frame"),
    ],
)
def test_options_that_do_not_fit_together_are_one_line(tmp_path, capsys, words, problem):
    table = tmp_path / "cost_scaling.csv"
    table.touch()
    words = ["--cost-scaling", str(table), *words.split()]
    if problem is None:
        args = parse(options_of_a_script, "what it does", words)
        assert (args.cost_scaling, args.frame, args.rdf) == (table, 6, ["b"])
        return
    with pytest.raises(SystemExit) as exit_:
        parse(options_of_a_script, "what it does", words)
    assert (exit_.value.code, capsys.readouterr().err) == (2, f"error: {problem}\n")


def test_every_script_checks_its_inputs(root):
    """Whatever an option is said to read is declared as such."""
    option = re.compile(r"add_argument\((?:[^()]|\([^()]*\))*\)")
    for script in (root / "scripts").glob("*/*.py"):
        for call in option.findall(Path(script).read_text(encoding="utf-8")):
            if 'help="in: ' in call:
                assert "type=input_file" in call or "type=named_file" in call or "**" in call, f"{script}: {call}"

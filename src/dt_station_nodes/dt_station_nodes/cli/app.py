"""The frame of the command line: finds the verb, runs it, turns mistakes into sentences and exit statuses.

Exit status: 0 done, 1 failed, 2 bad input (one sentence on standard error), 130 interrupted.
"""

import functools
import importlib
import sys
from collections.abc import Callable, Sequence
from typing import Any

from ..core.errors import StationError
from .common import Failure, console

PROGRAM = "dt-station"


class _InterruptError(Exception):
    """Ctrl-C inside a verb, kept apart from typer's own handling of it."""


# verb -> one line for the overview; the code is cli/<verb>.py, a function of the verb's name
VERBS: dict[str, str] = {
    "demo": "the paper's experiment on the virtual rig, with table and report",
    "test": "run the tests",
    "run": "start a scenario: all nodes, watched and stopped cleanly",
    "node": "start one node, as ros2 run does",
    "set": "change a set-point waveform or a controller of the running station",
    "shadow": "feed measured data through the live graph and show the gap",
    "record": "record the running station into a bag",
    "replay": "play a bag back into the graph",
    "verify": "recompute a bag's outputs and compare them bit for bit",
    "recover": "save what can be read of a torn bag",
    "compare": "ISE, RMS and fit of a run, or of two",
    "export": "write a bag as CSV or Parquet",
    "experiment": "run an identification experiment on the station",
    "identify": "estimate a model from a run",
    "tune": "tune a controller on a model or on the station",
    "simulate": "simulate a model without the graph",
    "paper": "every figure of the paper beside ours",
    "discover": "find, name and add the effect a model lacks",
    "improve": "experiment and discover until the gap is named, then update the twin",
    "doctor": "check this installation and say what to mend",
}


def overview() -> str:
    """The text of `dt-station --help`."""
    width = max(map(len, VERBS))
    lines = [f"  {verb.ljust(width)}  {text}" for verb, text in VERBS.items()]
    return "\n".join(
        [
            f"Usage: {PROGRAM} VERB [OPTIONS]",
            "",
            "A station for tuning and testing digital twins of hydraulic actuators.",
            "",
            *lines,
            "",
            f"{PROGRAM} VERB --help explains a verb, with an example. Start with: {PROGRAM} demo",
        ]
    )


def _sentence(text: str) -> str:
    return " ".join(text.split())


def _complain(text: str) -> None:
    print(f"{PROGRAM}: {_sentence(text)}", file=sys.stderr)


def _interruptible(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def run(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except KeyboardInterrupt as interrupt:
            raise _InterruptError from interrupt

    return run


def _run_verb(verb: str, arguments: Sequence[str]) -> int:
    try:
        module = importlib.import_module(f"{__package__}.{verb}")
    except ModuleNotFoundError as error:
        if error.name == f"{__package__}.{verb}":
            raise Failure(f"the verb {verb} is not part of this installation") from None
        raise
    import typer

    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    settings = getattr(module, "CONTEXT_SETTINGS", {})
    app.command(verb, context_settings={"help_option_names": ["-h", "--help"], **settings})(
        _interruptible(getattr(module, verb))
    )
    status = typer.main.get_command(app).main(
        args=list(arguments), prog_name=f"{PROGRAM} {verb}", standalone_mode=False
    )
    return status if isinstance(status, int) else 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status. Errors that are not the user's keep their traceback."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(overview())
        return 0 if arguments else 2
    if arguments[0] == "--version":
        from .common import version

        print(f"{PROGRAM} {version()}")
        return 0
    verb = arguments[0]
    if verb not in VERBS:
        import difflib

        near = difflib.get_close_matches(verb, VERBS, 1)
        hint = f"did you mean {near[0]}?" if near else f"{PROGRAM} --help lists them all."
        _complain(f"there is no verb {verb!r}; {hint}")
        return 2
    try:
        return _run_verb(verb, arguments[1:])
    except StationError as error:
        _complain(str(error))
        return 2
    except Failure as error:
        _complain(str(error))
        return 1
    except (_InterruptError, KeyboardInterrupt):
        _complain("interrupted")
        return 130
    except BrokenPipeError:
        # whoever read our output has gone; keep the interpreter's own flush from complaining about it
        sys.stdout = None
        return 1
    except OSError as error:
        if error.filename is None:
            raise
        _complain(f"{error.filename}: {error.strerror or error}")
        return 2
    except Exception as error:
        message = getattr(error, "format_message", None)
        if message is not None:
            _complain(f"{message()} Try: {PROGRAM} {verb} --help")
            return int(getattr(error, "exit_code", 2))
        if type(error).__name__ == "Abort":
            _complain("interrupted")
            return 130
        raise
    finally:
        console.show_cursor(True)

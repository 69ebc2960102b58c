"""``deadwood-tool TOOL OPTIONS``, ``list`` and ``describe``: the commands are built from the tools' declarations.

Exit status: 0 done; 2 an error in the user's input, reported in one line; 130 interrupted; 1 a bug, whose traceback is
saved to a file. Nothing slow is imported here: ``--help`` answers at once, and the variables by which another program's
GDAL would interfere are removed before anything can read them.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import json
import logging
import os
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.manifest import manifest
from deadwood_algorithms.params.renamed import why_removed
from deadwood_algorithms.params.tool import VERSION, Cancelled, Outcome, Tool, UserError
from deadwood_toolbox import collector, parameters, shelf
from deadwood_toolbox.commands import Answer, Job, build
from deadwood_toolbox.environment import (
    drop_foreign_paths,
    keep_cache_small,
    refuse_no_threads,
    refuse_shared_cache,
    refuse_small_address_space,
    stay_offline,
)
from deadwood_toolbox.feedback import Speaker, clock, printable
from deadwood_toolbox.interrupt import INTERRUPTED, LATE, MESSAGE, deaf, interruptible
from deadwood_toolbox.pipes import read_streams

DONE, FAULT, USER_ERROR = 0, 1, 2
# Errors that the user can fix; every other OSError that no tool expects is a bug.
USERS_OSERRORS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file is larger than the disk or quota allows",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.EMFILE: "too many files are open at once; raise the limit, for example with ulimit -n 1024",
    errno.ENFILE: "too many files are open at once on this machine; close other programs",
    errno.ELOOP: "a link that points to itself",
    errno.EPIPE: "a program that was written to has closed its end",
}


def main() -> None:
    """The ``deadwood-tool`` script."""
    collector.put_off()
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    with contextlib.suppress(AttributeError, ValueError):
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # until the tool runs, same as Ctrl-C
    try:
        status = run(sys.argv[1:])
        deaf()
    except KeyboardInterrupt:  # between the two handlers
        status = INTERRUPTED
    if status == INTERRUPTED:
        os._exit(status)  # does not wait for the threads of the interrupted run, which write nothing
    collector.begin()
    sys.exit(status)


def _open_closed_streams() -> None:
    """Open a standard stream that the caller has closed (``2>&-``): otherwise the first file that a library opens takes
    its number, and is written to by everything that prints.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
            setattr(sys, name, os.fdopen(number, "r" if number == 0 else "w", encoding="utf-8", closefd=False))


def _refuse_lost_folder() -> None:
    try:
        os.getcwd()
    except OSError as error:
        raise UserError("the current folder no longer exists; change to another one (cd) and run again") from error


def run(arguments: Sequence[str], tools: Sequence[Tool] | None = None) -> int:
    """Carry out one command line and return its exit status; for tests, ``tools`` replaces the registered tools."""
    dropped = drop_foreign_paths(os.environ)
    stay_offline(os.environ)
    keep_cache_small(os.environ)
    speaker = Speaker("json" if _wants_json(arguments) else "auto")
    verbose = "--verbose" in arguments
    try:
        _refuse_lost_folder()
        wanted = _understand(arguments, tools)
        if isinstance(wanted, Job):
            speaker = Speaker(wanted.progress, quiet=wanted.quiet, verbose=wanted.verbose)
            if dropped:
                speaker.detail(f"dropped from the environment: {', '.join(f'{k}={v}' for k, v in dropped.items())}")
            return _carry_out(wanted, speaker)
        if isinstance(wanted, Answer):
            _say(wanted.text)
        return DONE
    except (Exception, KeyboardInterrupt) as error:
        message, status = _verdict(error, speaker, verbose)
        return _fail(speaker, message, status)


def _carry_out(job: Job, speaker: Speaker) -> int:
    """Run the tool of a job under the signal handlers, and report its outputs."""
    config = {}
    if job.config is not None:
        changed = speaker.warn if job.changed_inputs else None
        config = parameters.read_config(job.config, job.tool, speaker.note, changed=changed, given=job.values)
    ask = parameters.ask_from(job.tool, {**config, **job.values})
    refuse_small_address_space()
    refuse_no_threads(os.environ)
    refuse_shared_cache(os.environ)
    with read_streams(job.tool, ask) as ask:
        return _work(job, ask, speaker)


def _work(job: Job, ask: Any, speaker: Speaker) -> int:
    began, before = time.perf_counter(), _standing(job.tool, ask)
    try:
        with interruptible(speaker.stop), warnings.catch_warnings():
            if not job.verbose:  # libraries warn in many lines; what concerns the user comes through the feedback
                warnings.simplefilter("ignore")
                logging.lastResort = None  # rasterio and GDAL log to any handler; here there is none
            speaker.detail(f"{job.tool.name} {VERSION}: {json.dumps(manifest(job.tool, ask)['parameters'])}")
            outcome = job.tool(ask, speaker)
        speaker.close()
        _report(outcome, _following(job.tool, ask, outcome), speaker, time.perf_counter() - began)
        return outcome.status
    except KeyboardInterrupt:
        raise Cancelled(LATE if _standing(job.tool, ask) != before else MESSAGE) from None


def _standing(tool: Tool, ask: Any) -> list[tuple[int, int] | None]:
    """Stamps of a tool's outputs (for a folder, of its manifest), which differ once the tool has written them."""
    found: list[tuple[int, int] | None] = []
    for parameter in tool.parameters():
        place = getattr(ask, parameter.name)
        if parameter.is_output and place:
            place = Path(place, "manifest.json") if Path(place).is_dir() else Path(place)
            try:
                stat = place.stat()
                found.append((stat.st_ino, stat.st_mtime_ns))
            except (OSError, ValueError):
                found.append(None)
    return found


def _understand(arguments: Sequence[str], tools: Sequence[Tool] | None) -> Job | Answer | None:
    """What a command line requests; None if click has answered itself (``--help``)."""
    if tools is None and (list(arguments) == ["list"] or all(each.startswith("-") for each in arguments)):
        command = build((), shelf.declared())
    else:
        if tools is None:
            one = shelf.find(arguments[0]) if arguments else None
            tools = shelf.TOOLS if one is None else (one,)
        command = build(tools, tools)
    wanted = command.main(list(arguments), prog_name="deadwood-tool", standalone_mode=False)
    return wanted if isinstance(wanted, Job | Answer) else None


def _following(tool: Tool, ask: Any, outcome: Outcome) -> str:
    """The command that usually follows, with the actual inputs and outputs; none after a plan."""
    if outcome.then or not tool.then or not outcome.outputs:
        return outcome.then
    given = {each.name: getattr(ask, each.name) for each in tool.parameters()}
    known = {name: quoted(value) if value else name.upper() for name, value in given.items()}
    then = tool.then.format(**known | {name: quoted(path) for name, path in outcome.outputs.items()})
    after = shelf.find(then.split()[1])
    takes = after is not None and any(each.name == "crs" for each in after.parameters())
    return f"{then} --crs {quoted(given['crs'])}" if given.get("crs") and takes and "--crs" not in then else then


def _report(outcome: Outcome, then: str, speaker: Speaker, seconds: float) -> None:
    """The last lines, the same for every tool: the answer, the scenario, the outputs, the next command."""
    if not speaker.quiet:
        facts = [f"{name.replace('_', ' ')}: {value}" for name, value in outcome.facts.items()]
        lines = list(outcome.lines) or facts
        if lines:
            _say("\n".join(lines))
    folders = {Path(path) for path in outcome.outputs.values()}
    for name, path in outcome.outputs.items():
        if not speaker.as_json and not folders & set(Path(path).parents):  # files in a named folder are not listed
            speaker.note(f"{name.replace('_', ' ')}: {path}")
    if then and not speaker.as_json:
        speaker.note(f"next: {then}")
    speaker.detail(f"took {clock(seconds)} ({seconds:.2f} s)")
    outputs = {name: str(path) for name, path in outcome.outputs.items()}
    speaker.done(outputs=outputs, facts=dict(outcome.facts), seconds=round(seconds, 3))


def _say(text: str) -> None:
    """Print; if the reader has closed the pipe (`| head`) it has read enough, which is not an error."""
    try:
        print(printable(text), flush=True)
    except BrokenPipeError:
        _let_go(sys.stdout)


def _wants_json(arguments: Sequence[str]) -> bool:
    """Whether errors of the command line itself are to be JSON, too, before it has been parsed."""
    return "--progress=json" in arguments or ("--progress", "json") in itertools.pairwise(arguments)


def _verdict(error: BaseException, speaker: Speaker, verbose: bool) -> tuple[str, int]:
    """The message for an error, and the exit status."""
    if isinstance(error, KeyboardInterrupt | Cancelled | click.Abort) or speaker.stop.is_set():
        return str(error) if isinstance(error, Cancelled) and error.args else MESSAGE, INTERRUPTED
    if isinstance(error, click.NoSuchOption):
        tool, name = error.ctx.info_name if error.ctx else None, error.option_name.lstrip("-").replace("-", "_")
        if gone := why_removed(tool or "", name):
            return gone, USER_ERROR
        near = error.possibilities or ()
        return f"no such option: {error.option_name}" + (f"; did you mean {near[0]}?" if near else ""), USER_ERROR
    if isinstance(error, click.ClickException):
        return error.format_message(), USER_ERROR
    if isinstance(error, UserError):
        return str(error), USER_ERROR
    if isinstance(error, MemoryError):
        return f"out of memory ({error or 'no details'}); crop the DEM or run fewer logs", USER_ERROR
    known = _users_oserror(error)
    return (known, USER_ERROR) if known is not None else (_fault_of_ours(error, verbose), FAULT)


def _users_oserror(error: BaseException) -> str | None:
    """A line about a full disk and similar errors, also if a library has wrapped them; None for any other error."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, OSError) and seen.errno in USERS_OSERRORS:
            where = f"{seen.filename}: " if seen.filename is not None else ""
            return f"{where}{USERS_OSERRORS[seen.errno]}"
        if isinstance(seen, RuntimeError) and str(seen).startswith("Symlink loop"):  # pathlib's own, up to Python 3.12
            return f"{USERS_OSERRORS[errno.ELOOP]} ({seen})"
        if "No space left on device" in str(seen):  # GDAL's own error, which has no errno
            return f"{USERS_OSERRORS[errno.ENOSPC]} ({str(seen).splitlines()[0]})"
        seen = seen.__cause__ or seen.__context__
    return None


def _fail(speaker: Speaker, message: str, status: int) -> int:
    try:
        speaker.error(message, status)
        sys.stdout.flush()
    except OSError:
        _let_go(sys.stdout)
    return status


def _let_go(stream: Any) -> None:
    """The reader is gone: discard what is still buffered, so that Python reports no error at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _fault_of_ours(error: BaseException, verbose: bool) -> str:
    """One line about an unexpected error; its traceback goes to a file, with ``--verbose`` also to stderr."""
    trace = "".join(traceback.format_exception(error))
    saved = "could not be saved"
    with contextlib.suppress(OSError):
        handle, path = tempfile.mkstemp(prefix="deadwood-tool-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(f"deadwood-tool {VERSION}: {sys.argv}\n{trace}")
        saved = f"is in {path}"
    if verbose:
        print(trace, file=sys.stderr, end="")
    what = str(error).splitlines()[0] if str(error) else "no message"
    return f"a bug in the toolbox, please report it: {type(error).__name__}: {what} (traceback {saved})"

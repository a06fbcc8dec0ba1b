"""What every command has in common: groups of options taken apart for the command line, and wrong input answered.

Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input.
"""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import fields, is_dataclass, replace
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer.exceptions import Abort, TyperException
from typer.models import OptionInfo

from planning.errors import DescribedError
from server.cli.shared.output import end_progress, print_json, say
from server.errors import StationError
from telemetry.errors import AddressError, RecordingError, StationsError, TelemetryError

DONE, FAILED, WRONG_INPUT = 0, 1, 2


class Without:
    """Beside a group in ``Annotated``: its fields that this command does not offer; they keep their defaults."""

    def __init__(self, *names: str) -> None:
        self.names = names


def command(body: Callable[..., None]) -> Callable[..., None]:
    """What typer is given for a command: each parameter that is a dataclass becomes the options that its fields are,
    in its place, and is filled from them. Raises no error but typer's own: the others are answered.

    Typer knows no groups; it reads the signature, so the groups are taken apart in there. A group's ``PANEL`` is its
    options' heading in the help; a parameter's default, a whole group, gives its fields other defaults.
    """
    hints = get_type_hints(body, include_extras=True)
    options: list[inspect.Parameter] = []
    fillings: dict[str, tuple[Any, list[str]]] = {}
    for parameter in inspect.signature(body).parameters.values():
        hint = hints[parameter.name]
        kind, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if not (isinstance(kind, type) and is_dataclass(kind)):
            options.append(parameter.replace(kind=parameter.KEYWORD_ONLY, annotation=hint))
            continue
        group: Any = kind() if parameter.default is parameter.empty else parameter.default
        left_out = {name for note in notes if isinstance(note, Without) for name in note.names}
        offered = [option for option in _options(group) if option.name not in left_out]
        fillings[parameter.name] = group, [option.name for option in offered]
        options += offered

    def run(**given: Any) -> None:
        with refusing(as_json=given.get("as_json", False)):
            filled = {
                name: _filled(group, {option: given[option] for option in offered})
                for name, (group, offered) in fillings.items()
            }
            body(**{name: value for name, value in given.items() if name in hints}, **filled)

    run.__name__, run.__doc__, run.__module__ = body.__name__, body.__doc__, body.__module__
    run.__annotations__ = {option.name: option.annotation for option in options} | {"return": None}
    run.__signature__ = inspect.Signature(options)  # pyright: ignore[reportFunctionMemberAccess]
    return run


def _options(group: Any) -> Iterator[inspect.Parameter]:
    """One keyword for each field, of groups within it as well, with the group's own value as its default."""
    hints = get_type_hints(type(group), include_extras=True)
    for field in fields(group):
        value = getattr(group, field.name)
        if is_dataclass(value):
            yield from _options(value)
            continue
        kind, option = get_args(hints[field.name])
        if isinstance(option, OptionInfo) and hasattr(group, "PANEL"):
            option = copy(option)
            option.rich_help_panel = group.PANEL
        yield inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=value, annotation=Annotated[kind, option]
        )


def _filled(group: Any, given: dict[str, Any]) -> Any:
    """The group with the values that were given."""
    values = {field.name: getattr(group, field.name) for field in fields(group)}
    inner = {name: _filled(value, given) for name, value in values.items() if is_dataclass(value)}
    return replace(group, **inner, **{name: given[name] for name in values if name in given and name not in inner})


@contextmanager
def refusing(*, as_json: bool) -> Iterator[None]:
    """Wrong input ends the command with exit code 2, a message on stderr and, if asked, as JSON on stdout.

    What a vehicle, a link, a running station or nobody foresaw ends it with 1; in the last case the message says where
    it happened.
    """
    try:
        yield
    except (typer.Exit, typer.Abort, BrokenPipeError):
        raise
    except DescribedError as error:
        _answer_error(error.code, error.what, error.where, error.advice, as_json=as_json)
        in_flight = isinstance(error, TelemetryError) and not isinstance(
            error, AddressError | RecordingError | StationsError
        )
        raise typer.Exit(FAILED if in_flight or isinstance(error, StationError) else WRONG_INPUT) from None
    except OSError as error:
        what = f"{error.strerror or error}."
        advice = "Check the path, its permissions and the free space."
        _answer_error("file", what, str(error.filename or ""), advice, as_json=as_json)
        raise typer.Exit(WRONG_INPUT) from None
    except MemoryError:
        advice = "Use a coarser model, a smaller area or a larger sampling step."
        _answer_error("memory", "There is not enough memory.", "", advice, as_json=as_json)
        raise typer.Exit(FAILED) from None
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = f"Something in Hedgehop itself went wrong: {type(error).__name__}: {error}."
        advice = "Please report it with the command and its files."
        _answer_error("internal", what, f"{place.filename}:{place.lineno}", advice, as_json=as_json)
        raise typer.Exit(FAILED) from None


def _answer_error(code: str, what: str, where: str, advice: str, *, as_json: bool) -> None:
    end_progress()
    if as_json:
        print_json({"error": {"code": code, "what": what, "where": where, "advice": advice}})
    head = f"{where}: {what}" if where else what
    say(f"Error: {head} {advice}".rstrip())


def run_command(app: typer.Typer, arguments: Sequence[str] | None = None) -> int:
    """The exit code of ``hedgehop`` with these arguments (the process's own by default). A wrong command line is
    answered as any other wrong input is."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        return int(app(given, prog_name="hedgehop", standalone_mode=False) or 0)
    except TyperException as error:
        _refuse_usage(error, as_json="--json" in given)
        return WRONG_INPUT
    except Abort:
        say("Stopped.")
        return FAILED


def _refuse_usage(error: TyperException, *, as_json: bool) -> None:
    what = " ".join(error.format_message().replace("Value error, ", "").split())
    if not what:  # no arguments at all: the help was the answer
        return
    what += "" if what.endswith((".", "?")) else "."
    context = getattr(error, "ctx", None)
    command = "hedgehop" if context is None else context.command_path
    advice = f"Try: {command} --help"
    if as_json:
        print_json({"error": {"code": "usage", "what": what, "where": command, "advice": advice}})
    say(f"Error: {what} {advice}")

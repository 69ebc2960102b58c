"""The command line built from the tools' declarations: click commands whose callbacks return what to do.

Nothing runs in here. A callback returns a ``Job`` (run this tool with these values) or an ``Answer`` (print this), so
that click's own handling of interrupts and errors never intervenes between a tool and ``cli.py``.
"""

from __future__ import annotations

import json
import os
import re
import textwrap
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import click

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import VERSION, Parameter, Tool, UserError
from deadwood_toolbox import json_schema, parameters
from deadwood_toolbox.feedback import PROGRESS, plain
from deadwood_toolbox.plugin_zip import TOOL as QGIS_PLUGIN
from deadwood_toolbox.shelf import Declared

GOES_ON = " `" if os.name == "nt" else " \\"  # the shell's continuation mark at the end of a line
WIDE = {"max_content_width": 110}  # as wide as the terminal, but not too wide to read


@dataclass(frozen=True)
class Job:
    """A request of a command line: a tool, its values, and how to report while it runs."""

    tool: Tool
    values: dict[str, Any]
    config: str | None = None
    changed_inputs: bool = False
    progress: str = "auto"
    quiet: bool = False
    verbose: bool = False


@dataclass(frozen=True)
class Answer:
    """A command line that needs no tool: text for standard output."""

    text: str


class _Shelf(click.Group):
    """The main command: the tools by group, and a suggestion for a misspelt one."""

    def __init__(self, listed: Sequence[Tool | Declared], **known: Any) -> None:
        super().__init__(**known)
        self.listed = listed

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if not args[0].startswith("-") and args[0] not in self.commands:
            known = ", ".join(tool.name for tool in self.listed)
            hint = parameters.closest(args[0], self.commands) or f"; the tools are {known}"
            raise UserError(f"no tool is called '{args[0]}'{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for group in dict.fromkeys(tool.group for tool in self.listed):
            with formatter.section(group):
                formatter.write_dl([(tool.name, tool.summary) for tool in self.listed if tool.group == group])
        with formatter.section("About the tools"):
            known = [(name, self.commands[name]) for name in ("list", "describe", QGIS_PLUGIN.name)]
            formatter.write_dl([(name, command.short_help or command.help or "") for name, command in known])


class _ToolCommand(click.Command):
    """One tool: its options, and the help grouped into inputs, parameters, outputs and others."""

    def __init__(self, tool: Tool) -> None:
        self.tool = tool
        options: list[click.Parameter] = [_option(parameter) for parameter in tool.parameters()]
        self.bare = next((parameter for parameter in tool.parameters() if parameter.positional), None)
        if self.bare:
            shown = self.bare.name.removesuffix("s").upper()
            many = self.bare.name.endswith("s")
            options.append(click.Argument(["bare"], nargs=-1, metavar=f"[{shown}]..." if many else f"[{shown}]"))
        super().__init__(
            tool.name,
            params=[*options, *_common_options()],
            short_help=tool.summary,
            callback=self._job,
            context_settings={**WIDE, "allow_extra_args": True},
        )

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Words without an option are named together with the first input that is missing; nothing is given twice."""
        _, _, order = self.make_parser(ctx).parse_args(list(args))
        super().parse_args(ctx, args)
        for option, times in Counter(order).items():
            if times > 1 and isinstance(option, click.Option) and (option.secondary_opts or not option.is_flag):
                self._refuse_twice(option, ctx)
        if ctx.args:
            words = " ".join(quoted(each) for each in ctx.args)
            missing = (
                each for each in self.tool.parameters() if not each.is_output and ctx.params.get(each.name) is None
            )
            first = next((each for each in missing if not each.optional and each.default is None), None)
            meant = f"; did you mean {first.flag} {words}?" if first and len(ctx.args) == 1 else ""
            raise UserError(f"{words} has no option before it{meant}")
        return ctx.args

    def _refuse_twice(self, option: click.Option, ctx: click.Context) -> None:
        """The last of several values would count, without a word about the others."""
        declared = next((each for each in self.tool.parameters() if each.name == option.name), None)
        several = declared is not None and (declared.of_kind.several or declared.path_like)
        how = "give it once, with commas between the values" if several else "give it once"
        raise UserError(f"{option.opts[0]} is given more than once; {how}")

    def _job(self, **given: Any) -> Job:
        common = {name: given.pop(name) for name in ("config", "changed_inputs", "progress", "quiet", "verbose")}
        if self.bare and (words := given.pop("bare")):
            if given[self.bare.name] is not None:
                raise UserError(
                    f"{self.bare.flag} is given twice: with its flag, and as '{' '.join(words)}' without it"
                )
            given[self.bare.name] = ",".join(words)
        return Job(self.tool, {name: value for name, value in given.items() if value is not None}, **common)

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(laid_out(self.tool.description, formatter.width - formatter.current_indent))

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for title, declared in parameters.by_section(self.tool).items():
            with formatter.section(title):
                formatter.write_dl([parameters.help_line(each) for each in declared], col_max=28)
        rows = [
            row
            for option in self.get_params(ctx)[-6:]
            if not isinstance(option, click.Argument) and (row := option.get_help_record(ctx)) is not None
        ]
        with formatter.section("On every tool"):
            formatter.write_dl(rows, col_max=28)


def laid_out(description: str, width: int) -> str:
    """The description for click, which joins the lines of a paragraph unless there is a ``\b``: lists with hanging
    items, commands broken at the shell's continuation, no line wider than the terminal.
    """
    return "\n\n".join(_paragraph(each, width) for each in description.split("\n\n"))


def _paragraph(text: str, width: int) -> str:
    if text.startswith("    "):
        commands = re.sub(r"\s*\\\n\s*", " ", text).split("\n")
        return "\n".join(["\b", *(line for each in commands for line in _command(each.strip(), width))])
    if text.startswith("- "):
        items = [" ".join(each.split()) for each in re.split(r"^- ", text, flags=re.MULTILINE)[1:]]
        lines = [textwrap.fill(each, width, initial_indent="- ", subsequent_indent="  ") for each in items]
        return "\n".join(["\b", *lines])
    return text


def _command(command: str, width: int) -> list[str]:
    """A command on as many lines as needed, each option on the same line as its value."""
    lines, line = [], ""
    for part in re.split(r" (?=--)", command):
        longer = f"{line} {part}" if line else f"    {part}"
        if line and len(longer) + len(GOES_ON) > width:
            lines.append(line + GOES_ON)
            longer = f"        {part}"
        line = longer
    return [*lines, line]


class _Value(click.ParamType):
    """Convert text to a value by the declaration; the error has the same form as all others."""

    def __init__(self, parameter: Parameter) -> None:
        self.parameter = parameter
        self.name = parameter.kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return parameters.value_from_text(self.parameter, value) if isinstance(value, str) else value

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:
        from click.shell_completion import CompletionItem

        if self.parameter.choices:
            return [CompletionItem(word) for word in self.parameter.choices if word.startswith(incomplete)]
        files = self.parameter.is_input or self.parameter.is_output
        return [CompletionItem(incomplete, type="file")] if files else []


def _option(parameter: Parameter) -> click.Option:
    """An option without default: given values are distinguished from absent ones, so that flags override
    ``--config``.
    """
    if parameter.is_switch:
        words = [f"{each}/{parameters.off(each)}" for each in (parameter.flag, *parameter.old_flags)]
        return click.Option([*words, parameter.name], default=None)
    return click.Option([parameter.flag, *parameter.old_flags, parameter.name], type=_Value(parameter), default=None)


def _common_options() -> list[click.Parameter]:
    config = "Parameters from a JSON file, an earlier run's manifest.json, or a result itself; flags override it."
    changed = "Continue although an input of --config has changed."
    how = (
        "How progress is shown on standard error [default auto: a bar on a terminal, otherwise a line from time to "
        "time]."
    )
    return [
        click.Option(["--config"], metavar="FILE", help=config),
        click.Option(["--changed-inputs"], is_flag=True, help=changed),
        click.Option(["--progress"], type=click.Choice(PROGRESS), default="auto", metavar="|".join(PROGRESS), help=how),
        click.Option(["--quiet"], is_flag=True, help="Show warnings and errors only."),
        click.Option(["--verbose"], is_flag=True, help="Also show settings, times, warnings of libraries, tracebacks."),
    ]


def build(tools: Sequence[Tool], listed: Sequence[Tool | Declared]) -> click.Group:
    """Build the command line of these tools; the main help, and ``list``, show the listed ones."""
    shelf = _Shelf(
        listed,
        name="deadwood-tool",
        help="Where deadwood that starts to slide goes, what it reaches, and how much a standing forest holds back.",
        epilog="deadwood-tool TOOL --help explains one tool.",
        invoke_without_command=True,
        context_settings=WIDE,
        subcommand_metavar="TOOL [FLAGS]",
        callback=_top,
        params=[
            click.Option(["--version"], is_flag=True, help="Show the version and exit."),
            click.Option(["--versions"], is_flag=True, help="Also show the Python and the libraries that it uses."),
        ],
    )
    for tool in tools:
        shelf.add_command(_ToolCommand(tool))
    as_json = click.Option(["--json", "as_json"], is_flag=True, help="As JSON, for programs.")
    as_schema = click.Option(["--json-schema", "as_schema"], is_flag=True, help="The parameters as JSON Schema.")
    listing = _answering(lambda **given: _list(listed, **given))
    telling = _answering(lambda **given: _describe(tools, shelf, **given))
    presets = click.Option(
        ["--presets"], is_flag=True, help="In their place what can be picked by name: values, sources, what to mind."
    )
    events = click.Option(["--events"], is_flag=True, help="In their place slides of trunks that were reported.")
    shelf.add_command(
        click.Command("list", params=[presets, events, as_json], help="List the tools.", callback=listing)
    )
    which = click.Argument(["tool"], required=False)
    shelf.add_command(
        click.Command(
            "describe",
            params=[which, as_json, as_schema],
            help="Explain one tool, or all of them; with --json its whole declaration, with --json-schema what a "
            "--config file may hold.",
            callback=telling,
        )
    )
    shelf.add_command(_ToolCommand(QGIS_PLUGIN))
    return shelf


def _answering(text_of: Callable[..., str]) -> Callable[..., Answer]:
    return lambda **given: Answer(text_of(**given))


@click.pass_context
def _top(ctx: click.Context, version: bool, versions: bool) -> Answer | None:
    if versions:
        from deadwood_algorithms.files.versions import lines

        return Answer("\n".join([f"deadwood-tool {VERSION}", *lines()]))
    if version:
        return Answer(f"deadwood-tool {VERSION}")
    return None if ctx.invoked_subcommand else Answer(ctx.get_help())


def _list(tools: Sequence[Tool | Declared], *, presets: bool, events: bool, as_json: bool) -> str:
    if presets and events:
        raise UserError("--presets and --events are two lists; ask for one at a time")
    if events:
        from deadwood_algorithms.params.events import EVENTS, event_lines

        record = {"version": VERSION, "events": [asdict(each) for each in EVENTS]}
        return json.dumps(record, indent=2, ensure_ascii=False) if as_json else "\n".join(event_lines())
    if presets:
        from deadwood_algorithms.tools.list_presets import preset_lines, preset_rows

        rows = preset_rows()
        record = {"version": VERSION, "presets": [asdict(each) for each in rows]}
        return json.dumps(record, indent=2) if as_json else "\n".join(preset_lines(rows))
    if as_json:
        keys = ("name", "label", "group", "qgis_id", "summary")
        listed = [{key: getattr(tool, key) for key in keys} for tool in tools]
        return json.dumps({"version": VERSION, "tools": listed}, indent=2)
    width = max((len(tool.name) for tool in tools), default=0)
    return "\n".join(f"{tool.name:<{width}}  {tool.summary}" for tool in tools)


def _describe(tools: Sequence[Tool], shelf: click.Group, *, tool: str | None, as_json: bool, as_schema: bool) -> str:
    known = {each.name: each for each in tools}
    if tool is not None and tool not in known:
        raise UserError(f"no tool is called '{tool}'{parameters.closest(tool, known) or '; see deadwood-tool list'}")
    if as_schema:
        schema = json_schema.schemas_of(tools) if tool is None else json_schema.schema_of(known[tool])
        return json.dumps(schema, indent=2)
    if as_json:
        one = parameters.describe(known[tool]) if tool is not None else None
        record = one or {"version": VERSION, "tools": [parameters.describe(each) for each in tools]}
        return json.dumps(plain(record), indent=2)
    context = click.Context(shelf, info_name="deadwood-tool")
    names = [tool] if tool is not None else list(known)
    helps = (shelf.commands[name].get_help(click.Context(shelf.commands[name], context, name)) for name in names)
    return "\n\n".join(helps)

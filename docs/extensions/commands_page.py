"""Writes the page of commands from the program's own help."""

import re
from collections.abc import Iterator
from pathlib import Path

from sightfield.diagrams.commands.app import COMMANDS, import_command


def write_commands_page(file: Path) -> None:
    """Write it, if it has changed."""
    text = "\n".join(_page())
    if not file.is_file() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")


def setup(app) -> dict[str, bool]:
    """Have Sphinx call it before it looks for pages."""
    app.connect(
        "builder-inited", lambda app: write_commands_page(Path(app.srcdir) / "commands.rst")
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _page() -> Iterator[str]:
    yield "Commands\n========\n"
    yield "From ``sightfield --help`` and the help of each command.\n"
    yield from _commands({name: import_command(name) for name in COMMANDS}, "sightfield")


def _commands(commands, path: str) -> Iterator[str]:
    for name, command in commands.items():
        title = f"{path} {name}"
        inner = hasattr(command, "commands")
        if not inner or command.invoke_without_command:
            yield f"{title}\n{'-' * len(title)}\n"
            yield _plain(command.help or "") + "\n"
            yield from _options(command)
        if inner:
            yield from _commands(command.commands, title)


def _options(command) -> Iterator[str]:
    if not command.params:
        return
    yield ".. list-table::\n   :widths: 30 15 55\n"
    for each in command.params:
        is_option = each.param_type_name == "option"
        names = "/".join([*each.opts, *each.secondary_opts]) if is_option else each.name.upper()
        says = each.default is not None and not isinstance(each.default, bool)
        default = str(each.default) if says and not callable(each.default) else ""
        help_ = getattr(each, "help", None) or ""
        yield f"   * - ``{names}``\n     - {_plain(default) or '|'}\n     - {_plain(help_) or '|'}"
    yield ""


def _plain(text: str) -> str:
    """Signs that stand for themselves; a bar alone is an empty line."""
    plain = re.sub(r"([*`|\\]|(?<=\w)_(?!\w))", r"\\\1", " ".join(text.split("\f")[0].split()))
    return re.sub(r"--[a-z][a-z-]*", r"``\g<0>``", plain)

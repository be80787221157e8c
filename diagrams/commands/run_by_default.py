"""Commands with subcommands, one of which is meant where none is named."""

from typing import Any

from typer.core import TyperGroup


class RunByDefault(TyperGroup):
    """A group whose subcommand `run` is meant where none is named."""

    # Any: Typer has a copy of Click of its own, or not, from version to version.
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words, with `run` before them where no subcommand stands.

        Args:
            ctx: Click's.
            args: The words.
        """
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)

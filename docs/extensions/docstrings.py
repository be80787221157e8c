"""Docstrings as reStructuredText: Google's sections, our comments on fields, plain equations."""

import re
from collections.abc import Iterator
from textwrap import dedent, indent

from sources import Thing
from sphinx.ext.napoleon import Config, GoogleDocstring

# Names of parameters as text: several may share an entry, "r_p, phi_p: ...".
_CONFIG = Config(napoleon_use_param=False, napoleon_use_rtype=False, napoleon_use_ivar=False)
_RULER = re.compile(r"^ *=+(?: +=+)+ *$", re.MULTILINE)
# What a function returns or yields, and one of several results, each on a line by its name.
_RESULTS = re.compile(r"^(Returns|Yields):\n((?:(?: {4}.*)?\n)+)", re.MULTILINE)
_RESULT = re.compile(r"^(\w+(?:, \w+)*): ")
_QUOTED = re.compile(r"(``.+?``|`[^`]+`)", re.DOTALL)


def as_restructured_text(doc: str, thing: Thing | None = None) -> str:
    """A docstring for Sphinx.

    Args:
        doc: As in the source, cleaned.
        thing: Whose it is; the comments on its fields stand in for a missing `Attributes:`.
    """
    if thing and thing.fields and "Attributes:" not in doc:
        notes = "\n".join(f"{each.name}: {each.note}" for each in thing.fields)
        doc = f"{doc}\n\nAttributes:\n{indent(notes, '    ')}"
    text = "\n\n".join(_blocks(_with_results(doc)))
    text = re.sub(r"^Source: ", "**Source:** ", text, flags=re.MULTILINE)
    what = "class" if thing and thing.fields else "object"
    return str(GoogleDocstring(text, _CONFIG, what=what))


def _with_results(doc: str) -> str:
    """A docstring whose `Returns:` is a field of Sphinx, with an entry for each result.

    Napoleon takes what stands before the first colon for a type.
    """

    def told(found: re.Match[str]) -> str:
        lines = dedent(found[2]).strip("\n").splitlines()
        named = [bool(_RESULT.match(line)) for line in lines if not line.startswith(" ")]
        if len(named) > 1 and all(named):
            lines = [_RESULT.sub(r"- ``\1``: ", line) for line in lines]
            return f":{found[1].lower()}:\n{indent(chr(10).join(lines), '    ')}\n\n"
        return f":{found[1].lower()}: {indent(chr(10).join(lines), '    ').lstrip()}\n\n"

    return _RESULTS.sub(told, f"{doc}\n").rstrip("\n")


def _blocks(doc: str) -> Iterator[str]:
    """Paragraphs, indented ones as they stand, unless they belong to a section or a directive."""
    above = ""
    for block in re.split(r"\n\s*\n", doc):
        if not block.startswith("    "):
            above = block
            yield _escaped(block)
        elif re.match(r"\.\. |\w+:\n", above) or above.endswith("::"):
            yield block if above.endswith("::") else _escaped(block)
        else:
            yield f"::\n\n{block}"


def _escaped(block: str) -> str:
    """A paragraph whose signs stand for themselves: |x|, a * b, a template's last underscore."""
    if _RULER.search(block):
        # Alone in its cell, a hyphen would begin a list.
        return re.sub(r"(?<= )-(?= |$)", "–", block, flags=re.MULTILINE)  # noqa: RUF001  # a dash
    if block.lstrip().startswith(".. "):
        return block
    parts = _QUOTED.split(block)
    parts[::2] = [re.sub(r"([*|]|(?<=\w)_(?![\w:]))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)

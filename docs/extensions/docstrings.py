"""Docstrings as reStructuredText: Google's sections, our comments on fields, plain equations."""

import re
from collections.abc import Iterator
from textwrap import indent

from sources import Thing
from sphinx.ext.napoleon import Config, GoogleDocstring

# Names of parameters as text: several may share an entry, "r_p, phi_p: ...".
_CONFIG = Config(napoleon_use_param=False, napoleon_use_rtype=False, napoleon_use_ivar=False)
_RULER = re.compile(r"^ *=+(?: +=+)+ *$", re.MULTILINE)
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
    text = "\n\n".join(_blocks(doc))
    text = re.sub(r"^Source: ", "**Source:** ", text, flags=re.MULTILINE)
    what = "class" if thing and thing.fields else "object"
    return str(GoogleDocstring(text, _CONFIG, what=what))


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

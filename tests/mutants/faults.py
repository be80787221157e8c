"""Which small faults can be made in a source: one token, one number or one statement each.

After the usual operators of mutation testing: another comparison, another arithmetic operation,
`and` for `or`, a condition turned round, a number changed, a call left out.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass

# What each operation is taken for.
_COMPARISONS = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
_OPERATIONS = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
}
_JUNCTIONS = {ast.And: ("and", "or"), ast.Or: ("or", "and")}


@dataclass(frozen=True)
class Fault:
    """A piece of a source, and what stands there by mistake.

    Attributes:
        start, end: Where the piece begins and ends, in characters of the source.
        line: Its first line, from 1.
        new: What stands there instead.
    """

    start: int
    end: int
    line: int
    new: str

    def made_in(self, source: str) -> str:
        """The source with the fault in it."""
        return source[: self.start] + self.new + source[self.end :]


def faults_of(source: str) -> list[Fault]:
    """All faults that can be made in a source, in its order; each leaves it Python."""
    text = _Text(source)
    found = [fault for node in _acting(ast.parse(source)) for fault in _of_node(node, text)]
    return sorted(found, key=lambda fault: (fault.start, fault.end, fault.new))


class _Text:
    """A source by line and column, as `ast` counts them: in bytes of UTF-8."""

    def __init__(self, source: str) -> None:
        self.source = source
        self._lines = source.splitlines(keepends=True)
        self._begins = [0]
        for line in self._lines:
            self._begins.append(self._begins[-1] + len(line))

    def place(self, line: int, column: int) -> int:
        before = self._lines[line - 1].encode()[:column].decode()
        return self._begins[line - 1] + len(before)

    def start(self, node: ast.expr | ast.stmt) -> int:
        return self.place(node.lineno, node.col_offset)

    def end(self, node: ast.expr | ast.stmt) -> int:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self.place(node.end_lineno, node.end_col_offset)

    def fault(self, node: ast.expr | ast.stmt, new: str) -> Fault:
        return Fault(self.start(node), self.end(node), node.lineno, new)

    def between(
        self, left: ast.expr, right: ast.expr, old: str, new: str, after: int | None = None
    ) -> Iterator[Fault]:
        """A token between two expressions taken for another one."""
        begin = self.end(left) if after is None else after
        gap = self.source[begin : self.start(right)]
        # Comments may say the word as well, and are passed over by leaving such places out.
        if "#" in gap or gap.count(old) != 1:
            return
        start = begin + gap.index(old)
        yield Fault(start, start + len(old), self.source.count("\n", 0, start) + 1, new)


def _acting(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that do something when they run: no annotations, decorators or formatted texts.

    Nor whether a `zip` is strict, which asserts what is true wherever it holds.
    """
    yield node
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "type_params", "decorator_list"}:
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, ast.JoinedStr):
                continue
            if isinstance(child, ast.keyword) and child.arg == "strict" and _is_zip(node):
                continue
            if not _is_shape(node, child):
                yield from _acting(child)
                continue
            for length in child.elts if isinstance(child, ast.Tuple) else [child]:
                if not _is_left(length):
                    yield from _acting(length)


def _is_zip(node: ast.AST) -> bool:
    match node:
        case ast.Call(func=ast.Name(id="zip")):
            return True
        case _:
            return False


def _is_left(length: ast.AST) -> bool:
    """Whether this is the -1 of a shape, for which NumPy takes any negative number."""
    match length:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant()):
            return True
        case _:
            return False


def _is_shape(node: ast.AST, child: ast.AST) -> bool:
    """Whether this is what a `reshape` is asked for."""
    match node:
        case ast.Call(func=ast.Attribute(attr="reshape"), args=arguments):
            return child in arguments
        case _:
            return False


def _of_node(node: ast.AST, text: _Text) -> Iterator[Fault]:
    match node:
        case ast.Compare():
            sides = [node.left, *node.comparators]
            for left, operator, right in zip(sides, node.ops, sides[1:], strict=False):
                old, new = _COMPARISONS[type(operator)]
                yield from text.between(left, right, old, new)
        case ast.BinOp(op=operator) if type(operator) in _OPERATIONS:
            if not any(map(_is_text, (node.left, node.right))):
                yield from text.between(node.left, node.right, *_OPERATIONS[type(operator)])
        case ast.AugAssign(op=operator) if type(operator) in _OPERATIONS:
            old, new = _OPERATIONS[type(operator)]
            yield from text.between(node.target, node.value, f"{old}=", f"{new}=")
        case ast.BoolOp():
            for left, right in zip(node.values, node.values[1:], strict=False):
                yield from text.between(left, right, *_JUNCTIONS[type(node.op)])
        case ast.UnaryOp(op=ast.Not() | ast.USub()) if not isinstance(node.operand, ast.Constant):
            inner = text.source[text.start(node.operand) : text.end(node.operand)]
            yield text.fault(node, f"({inner})")
        case ast.If() | ast.While() | ast.IfExp():
            condition = text.source[text.start(node.test) : text.end(node.test)]
            if not isinstance(node.test, ast.Constant) and "TYPE_CHECKING" not in condition:
                yield text.fault(node.test, f"(not ({condition}))")
        case ast.Constant(value=bool()):
            yield text.fault(node, str(not node.value))
        case ast.Constant(value=int() | float() as value):
            yield text.fault(node, repr(_other(value)))
        case ast.Expr(value=ast.Call()):
            yield text.fault(node, "pass")
        case _:
            pass


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr | ast.List | ast.Tuple) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _other(value: float) -> float:
    """A number unlike the one that stands there: whole ones by one, others by half."""
    if isinstance(value, int):
        return value + 1
    return 1.5 * value if value != 0.0 else 1.0

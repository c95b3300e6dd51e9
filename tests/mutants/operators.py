"""All one-line mutants of a source file: operators exchanged, constants changed, statements deleted.

Python is read by its syntax tree, C and Verilog by tokens: the formatter puts blanks around every binary operator, which
tells it from a pointer or a sign.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

EXCHANGED = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "%": "*",
    "&&": "||",
    "||": "&&",
    "and": "or",
    "or": "and",
    "&": "|",
    "|": "&",
    "^": "&",
    "<<": ">>",
    ">>": "<<",
    "+=": "-=",
    "-=": "+=",
    "|=": "&=",
    "&=": "|=",
    "is": "is not",
    "is not": "is",
    "in": "not in",
    "not in": "in",
    "True": "False",
    "False": "True",
    "true": "false",
    "false": "true",
}


@dataclass(frozen=True)
class Mutant:
    """In `file`, at offset `start` of its text, `before` becomes `after`. `line` counts from 1."""

    file: str
    line: int
    start: int
    before: str
    after: str

    def apply(self, text: str) -> str:
        """The mutated text of the file."""
        return text[: self.start] + self.after + text[self.start + len(self.before) :]


def mutants_of(file: str, text: str) -> list[Mutant]:
    """Every mutant of a file whose name ends in .py, .c, .h or .v, in the order of its text."""
    changes = _python(text) if file.endswith(".py") else _tokens(text, _VERILOG if file.endswith(".v") else _C)
    return [
        Mutant(file, text.count("\n", 0, start) + 1, start, text[start : start + len(before)], after)
        for start, before, after in changes
    ]


Change = tuple[int, str, str]  # start, before, after

# ------------------------------------------------------------------------------------------------------ C and Verilog

_HIDDEN = re.compile(
    r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|^\s*#\s*(?!define)[^\n]*', re.S | re.M
)
_C = (
    re.compile(r"(?<= )(?:<=|>=|==|!=|&&|\|\||<<|>>|\+=|-=|\|=|&=|[-+*/%&|^<>])(?= )|\b(?:true|false)\b"),
    re.compile(r"(?<![\w.'])(?:0|[1-9]\d*)(?=[uUlL]*\b(?![.'\w]))"),
    re.compile(r"(?<=\n)[ ]+(?:[\w>.\[\]-]+ [-+|&]?= [^;\n]*;|\w+\([^;\n]*\);|\w[\w>.-]*(?:\+\+|--);)(?=\n)"),
    re.compile(r"(?<=[( ])!(?=[\w(])"),
)
_VERILOG = (
    re.compile(r"(?<= )(?:>=|==|!=|&&|\|\||<<|>>|[-+*&|^<>])(?= )"),
    re.compile(r"(?<=\d'd)\d+\b"),
    re.compile(r"(?<=\n)[ ]+[\w\[\]:]+ <= [^;\n]*;(?=\n)"),
    re.compile(r"(?<=[( ])[!~](?=[\w(])"),
)


def _tokens(text: str, patterns) -> Iterator[Change]:
    code = _HIDDEN.sub(lambda found: re.sub(r"[^\n]", "\0", found[0]), text)
    operators, numbers, statements, negations = patterns
    found = [(m.start(), m[0], EXCHANGED[m[0]]) for m in operators.finditer(code)]
    found += [(m.start(), m[0], _other(m[0])) for m in numbers.finditer(code)]
    for m in statements.finditer(code):
        blanks = len(m[0]) - len(m[0].lstrip())
        found.append((m.start() + blanks, m[0].lstrip(), ";"))
    found += [(m.start(), m[0], "") for m in negations.finditer(code)]
    return iter(sorted(found))


def _other(number: str) -> str:
    return str(int(number) + 1) if number != "1" else "0"


# ------------------------------------------------------------------------------------------------------------- Python

_WORDS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Is: "is",
    ast.IsNot: "is not",
    ast.In: "in",
    ast.NotIn: "not in",
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Mod: "%",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.And: "and",
    ast.Or: "or",
}


class _Walk(ast.NodeVisitor):
    """Collects changes; annotations, which do not run, are passed over."""

    def __init__(self, text: str):
        self.text, self.changes = text, []
        self._lines = [0]
        for line in text.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))

    def _at(self, line: int, column: int) -> int:
        """Offset in characters; the tree counts columns in bytes of UTF-8."""
        begin = self._lines[line - 1]
        whole = self.text[begin : self._lines[line]].encode()
        return begin + len(whole[:column].decode())

    def _begin(self, node) -> int:
        return self._at(node.lineno, node.col_offset)

    def _end(self, node) -> int:
        return self._at(node.end_lineno, node.end_col_offset)

    def _between(self, left, right, operator) -> None:
        word = _WORDS.get(type(operator))
        begin, end = self._end(left), self._begin(right)
        at = self.text.find(word, begin, end) if word else -1
        if at >= 0:
            self.changes.append((at, word, EXCHANGED[word]))

    def visit_AnnAssign(self, node):
        if node.value:
            self.visit(node.value)

    def visit_arg(self, node):
        """Its annotation is no code that runs."""

    def visit_FunctionDef(self, node):
        self.visit(node.args)
        for statement in node.body:
            self.visit(statement)

    def visit_Compare(self, node):
        for left, operator, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            self._between(left, right, operator)
        self.generic_visit(node)

    def visit_BinOp(self, node):
        self._between(node.left, node.right, node.op)
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._between(left, right, node.op)
        self.generic_visit(node)

    def visit_UnaryOp(self, node):
        if isinstance(node.op, ast.Not):
            self.changes.append((self._begin(node), "not ", ""))
        self.generic_visit(node)

    def visit_JoinedStr(self, node):
        """Text that is shown."""

    def visit_Constant(self, node):
        if isinstance(node.value, bool):
            self.changes.append((self._begin(node), str(node.value), str(not node.value)))
        elif isinstance(node.value, int):
            word = self.text[self._begin(node) : self._end(node)]
            if word.isdigit():
                self.changes.append((self._begin(node), word, _other(word)))

    def _delete(self, node) -> None:
        if node.lineno == node.end_lineno:
            self.changes.append((self._begin(node), self.text[self._begin(node) : self._end(node)], "pass"))

    def visit_Expr(self, node):
        if isinstance(node.value, ast.Call):
            self._delete(node)
            self.generic_visit(node)

    def visit_AugAssign(self, node):
        self._delete(node)
        self.generic_visit(node)

    def visit_Assign(self, node):
        if isinstance(node.targets[0], (ast.Attribute, ast.Subscript)):
            self._delete(node)
        self.generic_visit(node)


def _python(text: str) -> list[Change]:
    walk = _Walk(text)
    walk.visit(ast.parse(text))
    return sorted(walk.changes)

"""Finds the mutants of a Python file."""

from collections.abc import Iterator

import tree_sitter_python
from mutant import Form, Mutant
from rust import short
from tree_sitter import Language, Node, Parser

PARSER = Parser(Language(tree_sitter_python.language()))

OPERATORS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "is": "is not", "is not": "is", "in": "not in",
    "not in": "in", "and": "or", "or": "and", "+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "&": "|", "|": "&",
}  # fmt: skip

# Types, words for people and what is computed once, before a mutant could be chosen.
FOREIGN = {"type", "decorator", "import_statement", "import_from_statement", "parameters", "string", "comment"}


def find(path: str, source: bytes) -> list[Mutant]:
    return list(walk(path, PARSER.parse(source).root_node, False))


def walk(path: str, node: Node, inside: bool) -> Iterator[Mutant]:
    """`inside` a function a mutant is chosen while the program runs."""
    if node.type in FOREIGN:
        return
    for text, form, what in changes(node) if inside else ():
        yield Mutant(path, node.start_byte, node.end_byte, text, form, node.start_point[0] + 1, what)
    for child in node.named_children:
        yield from walk(path, child, inside or node.type == "function_definition")


def changes(node: Node) -> Iterator[tuple[bytes, Form, str]]:
    text = node.text
    match node.type:
        case "comparison_operator" | "boolean_operator" | "binary_operator":
            operators = [child for child in node.children if not child.is_named]
            other = OPERATORS.get(operators[0].type) if len(operators) == 1 else None
            if other is not None:
                start, end = operators[0].start_byte - node.start_byte, operators[0].end_byte - node.start_byte
                what = f"`{short(text)}`: {operators[0].type} becomes {other}"
                yield text[:start] + other.encode() + text[end:], Form.EXPRESSION, what
        case "not_operator":
            yield text[3:], Form.EXPRESSION, f"`{short(text)}` without its not"
        case "integer" | "float":
            yield b"(" + text + b" + 1)", Form.EXPRESSION, f"`{short(node.parent.text)}`: {text.decode()} becomes one more"
        case "true" | "false" | "none" if node.parent.type != "comparison_operator":
            other = b"False" if text == b"True" else b"True"
            yield other, Form.EXPRESSION, f"`{short(node.parent.text)}`: {other.decode()}"
        case "expression_statement" if node.parent.type == "block":
            first = node.named_child(0)
            # Not the docstring, nor the declaration of a type.
            if first.type in ("call", "augmented_assignment", "assignment") and b"\n" not in text:
                yield b"pass", Form.STATEMENT, f"without `{short(text)}`"
        case "return_statement" | "raise_statement" if b"\n" not in text:
            yield b"pass", Form.STATEMENT, f"without `{short(text)}`"


def chosen(mutant: Mutant, number: int, text: bytes) -> bytes:
    """`text`, the original, where the change is one of what the program chooses from."""
    choice = b'__import__("os").environ.get("MUTANT") == "%d"' % number
    if mutant.form is Form.STATEMENT:
        return b"if not (" + choice + b"): " + text
    return b"(" + mutant.text + b" if " + choice + b" else " + text + b")"

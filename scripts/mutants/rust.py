"""Finds the mutants of a Rust file."""

from collections.abc import Iterator

import tree_sitter_rust
from mutant import Form, Mutant
from tree_sitter import Language, Node, Parser

PARSER = Parser(Language(tree_sitter_rust.language()))

OPERATORS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==",
    "+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "<<": ">>", ">>": "<<",
    "&": "|", "|": "&", "^": "&", "&&": "||", "||": "&&",
}  # fmt: skip
COMPOUND = {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "|=": "&=", "&=": "|=", "^=": "|=", "<<=": ">>=", ">>=": "<<="}
# A method that limits, becomes its counterpart.
METHODS = {"min": "max", "max": "min", "is_some": "is_none", "is_none": "is_some", "any": "all", "all": "any"}

# What is computed when the crate is compiled.
CONSTANT = {"const_item", "static_item", "const_block", "enum_variant", "type_arguments", "const_parameter"}
# Where no expression stands, or none of the program.
FOREIGN = {"array_type", "attribute_item", "inner_attribute_item", "token_tree", "macro_invocation", "macro_definition", "line_comment"}


def is_test(node: Node) -> bool:
    """Whether an item is there for tests alone, as its attribute says."""
    before = node.prev_named_sibling
    while before is not None and before.type in ("attribute_item", "line_comment"):
        if b"cfg(test)" in before.text:
            return True
        before = before.prev_named_sibling
    return False


def find(path: str, source: bytes) -> list[Mutant]:
    return list(walk(path, source, PARSER.parse(source).root_node, False))


def walk(path: str, source: bytes, node: Node, constant: bool) -> Iterator[Mutant]:
    if node.type in FOREIGN or is_test(node):
        return
    if node.type in CONSTANT or node.type == "function_item" and is_const_function(node):
        constant = True
    for start, end, text, form, what in changes(node):
        form = Form.ALONE if constant else form
        yield Mutant(path, start, end, text, form, node.start_point[0] + 1, what)
    for child in node.named_children:
        # Patterns have no expressions; the guard of an arm has.
        if child.type == "match_pattern":
            guard = child.child_by_field_name("condition")
            if guard is not None:
                yield from walk(path, source, guard, constant)
        elif node.child_by_field_name("pattern") != child:
            yield from walk(path, source, child, constant)


def is_const_function(node: Node) -> bool:
    return any(child.type == "function_modifiers" and b"const" in child.text.split() for child in node.children)


def changes(node: Node) -> Iterator[tuple[int, int, bytes, Form, str]]:
    """The changes of a node: start and end of what is replaced, by what, its form, and words."""
    whole = node.start_byte, node.end_byte
    text = node.text

    def swapped(operator: Node, other: str) -> bytes:
        return text[: operator.start_byte - whole[0]] + other.encode() + text[operator.end_byte - whole[0] :]

    match node.type:
        case "binary_expression":
            operator = node.child_by_field_name("operator")
            other = OPERATORS.get(operator.type)
            if other is not None:
                yield *whole, swapped(operator, other), Form.EXPRESSION, f"`{short(text)}`: {operator.type} becomes {other}"
        case "unary_expression" if text[:1] in (b"!", b"-"):
            yield *whole, text[1:], Form.EXPRESSION, f"`{short(text)}` without its {text[:1].decode()}"
        case "integer_literal" if node.parent.type not in ("field_expression", "match_pattern", "shorthand_field_initializer"):
            yield *whole, b"(" + text + b" + 1)", Form.EXPRESSION, f"`{short(node.parent.text)}`: {text.decode()} becomes one more"
        case "float_literal":
            yield *whole, b"(" + text + b" * 1.5)", Form.EXPRESSION, f"`{short(node.parent.text)}`: {text.decode()} becomes half as much again"
        case "boolean_literal":
            other = "false" if text == b"true" else "true"
            yield *whole, other.encode(), Form.EXPRESSION, f"`{short(node.parent.text)}`: {other}"
        case "call_expression":
            function = node.child_by_field_name("function")
            name = function.child_by_field_name("field") if function.type == "field_expression" else None
            other = METHODS.get(name.text.decode()) if name is not None else None
            if other is not None:
                yield *whole, swapped(name, other), Form.EXPRESSION, f"`{short(text)}`: {name.text.decode()} becomes {other}"
        case "if_expression" | "while_expression":
            condition = node.child_by_field_name("condition")
            if condition.type not in ("let_condition", "let_chain", "binary_expression", "unary_expression"):
                place = condition.start_byte, condition.end_byte
                yield *place, b"!(" + condition.text + b")", Form.EXPRESSION, f"if not `{short(condition.text)}`"
        case "expression_statement" if node.named_child_count == 1:
            if is_effect(node.named_child(0)) and text.endswith(b";"):
                yield *whole, b"{}", Form.STATEMENT, f"without `{short(text)}`"
        case "compound_assignment_expr":
            operator = node.child_by_field_name("operator")
            other = COMPOUND.get(operator.type)
            if other is not None:
                yield *whole, swapped(operator, other), Form.EXPRESSION, f"`{short(text)}`: {operator.type} becomes {other}"
        case "match_arm" if node.next_named_sibling is not None and has_else(node.parent):
            pattern = node.child_by_field_name("pattern")
            yield pattern.start_byte, pattern.end_byte, b"", Form.ARM, f"never the arm `{short(text)}`"


def is_effect(node: Node) -> bool:
    if node.type == "try_expression":
        node = node.named_child(0)
    return node.type in ("call_expression", "assignment_expression", "compound_assignment_expr", "return_expression", "await_expression")


def has_else(block: Node) -> bool:
    """Whether the last arm of a match takes what no other has taken."""
    arms = [child for child in block.named_children if child.type == "match_arm"]
    last = arms[-1].child_by_field_name("pattern")
    # The compiler wants both of these, and does not count one that has a condition.
    if last.text in (b"true", b"false"):
        return False
    return last.named_child_count <= 1 and last.child_by_field_name("condition") is None and last.text[:1] in b"_abcdefghijklmnopqrstuvwxyz"


def short(text: bytes) -> str:
    line = " ".join(text.decode().split())
    return line if len(line) <= 90 else line[:87] + "..."


def chosen(mutant: Mutant, number: int, text: bytes) -> bytes:
    """`text`, the original, where the change is one of what the program chooses from."""
    choice = b"crate::mutant(%d)" % number
    match mutant.form:
        case Form.STATEMENT:
            return b"if !%s { %s }" % (choice, text)
        case Form.ARM:
            pattern, guard, condition = text.partition(b" if ")
            return pattern + b" if !" + choice + (b" && (" + condition + b")" if guard else b"")
        case _:
            return b"(if %s { %s } else { %s })" % (choice, mutant.text, text)


# What the root of the crate gets; the number comes from the environment. Flash images, which tests build as well, have none:
# their programs stay what they were.
CHOICE = b"""
#[doc(hidden)]
#[allow(missing_docs)]
#[cfg(not(target_os = "none"))]
pub fn mutant(number: u32) -> bool {
    extern crate std;
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("MUTANT").map_or(0, |it| it.parse().unwrap_or(0))) == number
}

#[doc(hidden)]
#[allow(missing_docs)]
#[cfg(target_os = "none")]
pub const fn mutant(_: u32) -> bool {
    false
}
"""

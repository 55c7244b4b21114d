"""Signatures and docstrings as Markdown."""

import ast
import html
import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence

import docstring_parser
from docstring_parser.common import DocstringStyle


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; bars in its cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    cells = [[barless(flowing(cell)) for cell in row] for row in lines]
    return "".join(f"| {' | '.join(row)} |\n" for row in cells) + "\n"


def barless(cell: str) -> str:
    """Return a cell without bars: within code, GitHub and the site differ on them."""
    code = re.compile(r"`([^`]*\|[^`]*)`")
    coded = code.sub(lambda found: f"<code>{html.escape(found[1])}</code>", cell)
    return coded.replace("|", "&#124;")


def entry(name: str, thing: object) -> str:
    """Return a function, or a class with its methods."""
    parts = [f"### `{name}`\n\n", prose(thing), listed(thing)]
    if not inspect.isclass(thing):
        parts.insert(1, f"```text\n{name}{signature(thing)}\n```\n\n")
    else:
        parts += [method(key, call) for key, call in public_methods(thing)]
    return "".join(parts)


def fields(cls: type) -> str:
    """Return a table of the fields of a dataclass or named tuple, then its methods."""
    notes = {p.arg_name: p.description for p in parsed(cls).params}
    rows = (
        (
            f"`{name}`",
            f"`{kind} = {value}`" if value else f"`{kind}`",
            notes[name] or "",
        )
        for name, kind, value in declared(cls)
    )
    parts = [prose(cls), table(("field", "type", "meaning"), rows)]
    return "".join([*parts, *(method(key, call) for key, call in public_methods(cls))])


def declared(cls: type) -> Iterator[tuple[str, str, str]]:
    """Yield name, type and default of each field, as they stand in the source."""
    for line in definition(cls).body:
        if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name):
            value = ast.unparse(line.value) if line.value else ""
            if value.startswith("field(default_factory="):
                made = value.removeprefix("field(default_factory=")[:-1]
                plain = made.removeprefix("lambda: ")
                value = f"{made}()" if plain == made else plain
            yield line.target.id, ast.unparse(line.annotation), value


def method(name: str, call: Callable[..., object]) -> str:
    """Return one method, or property, of a class."""
    return f"**`{name}{signature(call)}`**\n\n{prose(call)}{listed(call)}"


def public_methods(cls: type) -> Iterator[tuple[str, Callable[..., object]]]:
    """Yield the class's own methods that are public and have words about them."""
    for name, member in vars(cls).items():
        call = getattr(member, "fget", None) or getattr(member, "__func__", member)
        if inspect.isfunction(call) and not name.startswith("_"):
            if inspect.getdoc(call):
                yield name, call


def definition(thing: object) -> ast.ClassDef | ast.FunctionDef:
    """Return the source of a class or function, parsed."""
    source = textwrap.dedent(inspect.getsource(thing))  # type: ignore[arg-type]
    return ast.parse(source).body[0]  # type: ignore[return-value]


def signature(call: object) -> str:
    """Return a signature as it stands in the source, a line a parameter if long."""
    source = definition(call)
    assert isinstance(source, ast.FunctionDef)
    result = ast.unparse(source.returns) if source.returns else ""
    if any(ast.unparse(each) == "property" for each in source.decorator_list):
        return f": {result}"
    arguments = [*written(source.args)]
    arrow = f" -> {result}" if result else ""
    text = f"({', '.join(arguments)}){arrow}"
    lines = "".join(f"    {each},\n" for each in arguments)
    return text if len(text) < 70 else f"(\n{lines}){arrow}"


def written(found: ast.arguments) -> Iterator[str]:
    """Yield the parameters of a function, but for `self` and `cls`."""
    plain = [*found.posonlyargs, *found.args]
    before = [None] * (len(plain) - len(found.defaults))
    for each, value in zip(plain, [*before, *found.defaults], strict=True):
        if each.arg not in ("self", "cls"):
            yield parameter(each, value)
    if found.vararg:
        yield f"*{parameter(found.vararg, None)}"
    elif found.kwonlyargs:
        yield "*"
    for each, value in zip(found.kwonlyargs, found.kw_defaults, strict=True):
        yield parameter(each, value)


def parameter(found: ast.arg, value: ast.expr | None) -> str:
    """Return one parameter with its type and default."""
    kind = f": {ast.unparse(found.annotation)}" if found.annotation else ""
    default = f" = {ast.unparse(value)}" if value else ""
    return f"{found.arg}{kind}{default}"


def parsed(thing: object) -> docstring_parser.Docstring:
    """Return the parts of a docstring."""
    return docstring_parser.parse(inspect.getdoc(thing) or "", DocstringStyle.GOOGLE)


def prose(thing: object) -> str:
    """Return what a docstring says before its lists."""
    found = parsed(thing)
    texts = [found.short_description, found.long_description]
    return "".join(f"{text.rstrip()}\n\n" for text in texts if text)


def listed(thing: object) -> str:
    """Return what a docstring lists: arguments, attributes, result, errors."""
    found = parsed(thing)
    lines = [f"* `{p.arg_name}`: {flowing(p.description)}\n" for p in found.params]
    if found.returns and found.returns.description:
        lines.append(f"* *returns* {flowing(found.returns.description)}\n")
    for error in found.raises:
        lines.append(f"* *raises* `{error.type_name}`: {flowing(error.description)}\n")
    return "".join(lines) + "\n" if lines else ""


def meanings(thing: object) -> dict[str, str]:
    """Return what a docstring says of each argument or attribute."""
    return {p.arg_name: flowing(p.description) for p in parsed(thing).params}


def flowing(text: str | None) -> str:
    """Return a text on one line."""
    return " ".join((text or "").split())

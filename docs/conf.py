"""Configuration of Sphinx, and two directives of our own: `public-names` and `gallery`.

`python -m sphinx -W docs site` builds the pages of this folder, the reference and the gallery.
A page of the reference names modules. Which public names live there is looked up, and none is left out.
"""

import ast
import re
from importlib import metadata
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import taskopt

project = "taskopt"
copyright = "the authors of taskopt"  # noqa: A001 (the name is Sphinx's)
release = metadata.version("taskopt")
html_theme = "furo"
html_title = f"taskopt {release}"
html_show_copyright = False
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
myst_heading_anchors = 3  # links such as robots.md#xacro work as they do where the files are read alone
default_role = "code"  # single backquotes mark code in our docstrings
napoleon_use_ivar = True  # attributes of a class are listed in its own entry
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "show-inheritance": True, "member-order": "bysource"}

SCENARIOS = Path(__file__).parents[1] / "tasks"
_PLAIN = re.compile(r"``.+?``|`[^`]*`|[|*\\]|(?<=\w)_(?!\w)")  # code, and marks outside it


class Generated(SphinxDirective):
    """A directive whose content is written by a program, in the markup of the page that holds it."""

    def written(self) -> list[str]:
        """Return the lines of the content."""
        raise NotImplementedError

    def run(self) -> list[nodes.Node]:
        """Read the content as if it stood in the page."""
        return self.parse_text_to_nodes("\n".join(self.written()), allow_section_headings=True)


class PublicNames(Generated):
    """The public names of taskopt that live in the module or package of the argument; for `eval-rst`."""

    required_arguments = 1

    def written(self) -> list[str]:
        """Return an `autodoc` directive for each name."""
        home = self.arguments[0]
        names = [
            name
            for name in sorted(taskopt.__all__, key=str.lower)
            if f"{taskopt._HOME[name]}.".startswith(f"{home}.")
        ]
        if not names:
            raise self.error(f"no public name lives in {home}")
        return [line for name in names for line in (f".. {_documenter(name)}:: taskopt.{name}", "")]


class Gallery(Generated):
    """The scenarios of the folder `tasks`: name, first sentence of the docstring, file and picture."""

    def written(self) -> list[str]:
        """Return a section for each scenario."""
        lines: list[str] = []
        for file in sorted(SCENARIOS.glob("*.py")):
            self.env.note_dependency(str(file))
            sentence = _first_sentence(ast.get_docstring(ast.parse(file.read_text("utf-8"))) or "")
            lines += [f"## {file.stem}", "", f"{sentence} [`tasks/{file.name}`](../tasks/{file.name})", ""]
            if (Path(self.env.srcdir) / "pictures" / f"{file.stem}.png").exists():
                lines += [f"![{sentence}](pictures/{file.stem}.png)", ""]
        return lines


def _documenter(name: str) -> str:
    """Return the name of the `autodoc` directive for a public name."""
    thing = getattr(taskopt, name)
    if isinstance(thing, type):
        return "autoexception" if issubclass(thing, Exception) else "autoclass"
    return "autofunction" if callable(thing) else "autodata"


def _first_sentence(text: str) -> str:
    """Return a text up to its first full stop."""
    return re.split(r"(?<=\.)\s", " ".join(text.split()), maxsplit=1)[0]


def _escaped(line: str) -> str:
    """Escape what is no code: reStructuredText would read more into plain text than we write."""
    return _PLAIN.sub(lambda m: m[0] if m[0][0] == "`" else f"\\{m[0]}", line)


def _literal(lines: list[str]) -> list[str]:
    """Mark indented paragraphs, which hold formulas and drawings, as text whose line breaks count."""
    out, inside = [], False
    for before, line in zip(["x", *lines], lines, strict=False):
        indented = line.startswith("    ")
        if indented and not before.strip() and not inside and _may_begin_literal(out):
            out += ["::", ""]
            inside = True
        elif line.strip() and not indented:
            inside = False
        out.append(line if inside else _escaped(line))
    return out


def _may_begin_literal(lines: list[str]) -> bool:
    """Return True if the last line at the margin is a sentence, and no heading such as `Args:`."""
    margin = [line for line in lines if line.strip() and not line.startswith(" ")]
    return not margin or not re.fullmatch(r"[A-Z]\w+:", margin[-1])


def _plain(_app: Sphinx, _what: str, _name: str, _thing: object, _options: object, lines: list[str]) -> None:
    """Turn the plain text of a docstring into reStructuredText, before its sections are converted."""
    lines[:] = _literal(lines)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register both directives, and the handling of docstrings as plain text."""
    app.add_directive("public-names", PublicNames)
    app.add_directive("gallery", Gallery)
    app.connect("autodoc-process-docstring", _plain, priority=400)
    return {"parallel_read_safe": True}

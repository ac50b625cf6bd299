"""Changes that the site makes to a page: roles of docstrings become code, formulas MathML, which browsers draw."""

import re

import latex2mathml.converter

#: a role of a docstring, such as :class:`Body`, once the page is HTML
ROLE = re.compile(r":(?:class|func|meth|data|attr|mod|exc):(?=<code>)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.S)


def on_page_content(html: str, **_: object) -> str:
    """Page of the site as it is shown."""
    return FORMULA.sub(_formula, ROLE.sub("", html))


def _formula(match: re.Match[str]) -> str:
    from html import unescape

    display = "block" if match[2] == "[" else "inline"
    return latex2mathml.converter.convert(unescape(match[3]), display=display)

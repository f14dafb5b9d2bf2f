"""What makes the documentation a site without a network: the hooks that ``mkdocs.yml`` names.

Formulas are drawn when the site is built, so that no script has to be fetched for them; the one script that
the theme fetches (search in pages opened from a folder) comes with the pages.
"""

import html
import re
from functools import cache
from typing import Any

SHIM, OWN = "https://unpkg.com/iframe-worker/shim", "assets/iframe-worker.js"
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
EM = 100.0  # units of a drawing per em of its letters
SIZE = 1.15  # of its letters, which are lower than those of the text around it
STEPS = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}  # codes of a matplotlib path


def on_page_content(content: str, **_: Any) -> str:
    """Draw the formulas of a page."""
    return FORMULA.sub(lambda found: drawn(html.unescape(found[2]), found[1] == "div"), content)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Take the theme's script from the site itself."""
    return output.replace(SHIM, "../" * page.url.count("/") + OWN)


def on_post_template(output: str, template_name: str, **_: Any) -> str:
    """Do the same in the pages of the theme, all of which stand at the top."""
    return output.replace(SHIM, OWN) if template_name.endswith(".html") else output


@cache
def drawn(formula: str, displayed: bool) -> str:
    """Return a formula as SVG in the colour of the text; LaTeX as far as matplotlib has it, else an error."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import MathTextParser
    from matplotlib.textpath import TextPath

    source = " ".join(formula.split())
    font = FontProperties(family="STIXGeneral", size=EM, math_fontfamily="stix")
    width, height, depth, *_ = MathTextParser("path").parse(f"${source}$", dpi=72, prop=font)
    scale = SIZE / EM
    outline = TextPath((0, 0), f"${source}$", prop=font)
    path = " ".join(
        STEPS[int(code)] + ("" if code == 79 else " ".join(f"{number:.0f}" for number in points))
        for points, code in outline.iter_segments()
    )
    svg = (
        f'<svg role="img" aria-label="{html.escape(source)}" fill="currentColor" '
        f'viewBox="0 {depth - height:.0f} {width:.0f} {height:.0f}" '
        f'style="width:{scale * width:.2f}em;height:{scale * height:.2f}em;max-width:none;'
        f'vertical-align:{-scale * depth:.2f}em">'
        f'<path transform="scale(1 -1)" d="{path}"/></svg>'
    )
    return f'<div class="formula">{svg}</div>' if displayed else svg

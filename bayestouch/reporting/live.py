"""Interactive figures: BokehJS inside the page, drawn only from the numbers of ``report.json``.

Every figure has a picture with the same name, which is shown on paper and if scripts are disabled.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.live_touches import posterior_figure, residual_figure, touch_source


@dataclass(frozen=True)
class Live:
    """Parts of the interactive figures that the page embeds.

    Attributes
    ----------
    library : str
        Code of BokehJS, compressed by gzip, in base64.
    script : str
        Script that starts the figures and shares the selected touch between figures and controls.
    data : str
        JSON with the figures, and with the touches that can be selected; compressed in the same way.
    names : tuple of str
        Names of the figures; each has an element ``live-NAME`` in the page. Without references of touches there is no
        ``estimates``.
    """

    library: str
    script: str
    data: str
    names: tuple[str, ...]


def live_figures(numbers: Mapping[str, Any]) -> Live:
    """Interactive figures of a report, from its numbers."""
    from pathlib import Path

    from bokeh.document import Document
    from bokeh.embed.util import standalone_docs_json_and_render_items
    from bokeh.resources import INLINE

    touches, pages = numbers["touches"], PAGES[numbers["data"]["body"]]
    source = touch_source(touches)
    possible = {
        "sensor": pages.live_sensor(numbers, source),
        "estimates": pages.live_estimates(numbers, source),
        "posterior": posterior_figure(touches),
        "touch_residuals": residual_figure(touches),
    }
    figures = {name: figure for name, figure in possible.items() if figure is not None}
    page = Document()
    for each in figures.values():
        page.add_root(each)
    documents, items = standalone_docs_json_and_render_items(list(figures.values()))
    content: dict[str, Any] = {"documents": documents, "items": [item.to_json() for item in items]}
    names = dict(zip((figure.id for figure in figures.values()), figures, strict=True))
    content["touches"] = touches
    data = _same_every_time(content, names)
    script = (Path(__file__).parent / "templates" / "live.js").read_text("utf-8")
    return Live(_packed("\n".join(INLINE.js_raw[:1])), script, _packed(data), tuple(figures))


def _packed(text: str) -> str:
    """Text compressed by gzip, in base64: a quarter of the size of the library, without the time of compression."""
    return base64.b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")


def _same_every_time(content: dict[str, Any], names: Mapping[str, str]) -> str:
    """JSON that is safe inside a page, always the same: random ids of Bokeh are replaced in order of appearance."""
    (document,) = content["documents"]
    (item,) = content["items"]
    roots = {model: f"live-{names[model]}" for model in item["roots"]}
    content = {
        **content,
        "documents": {"report": content["documents"][document]},
        "items": [{**item, "docid": "report", "roots": roots, "root_ids": list(roots)}],
    }
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    seen: dict[str, str] = {}
    text = re.sub(r'"p\d+"', lambda match: seen.setdefault(match[0], f'"m{len(seen)}"'), text)
    return text.replace("<", "\\u003c")

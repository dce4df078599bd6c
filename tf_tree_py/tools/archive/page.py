# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pages for a browser: the table of all bags, and the report on one. They load no files."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from tf_tree_py.command.endings import needs

_HEAD = """\
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{{ title }}</title>
<meta name="viewport" content="width=device-width">
<style>
body { font: 15px/1.45 sans-serif; margin: 2em auto; max-width: 80em; padding: 0 1em; }
table { border-collapse: collapse; }
th, td { text-align: left; padding: .25em .8em .25em 0; vertical-align: top; }
th { cursor: pointer; border-bottom: 1px solid; white-space: nowrap; }
td { overflow-wrap: anywhere; }
td.bag { min-width: 16em; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
.lost, .broken, .error { color: #b3261e; } .warning { color: #8a5a00; } .fine { color: #1b6e3c; }
.note { color: #555; }
@media (prefers-color-scheme: dark) {
  body { background: #111; color: #ddd; } a { color: #8ab4f8; }
  .lost, .broken, .error { color: #ff8a80; } .warning { color: #ffc46b; } .fine { color: #7ddc9b; }
  .note { color: #aaa; } }
</style></head><body>
"""

_INDEX = _HEAD + """\
<h1>{{ title }}</h1>
<p>{{ rows | length }} bags:{% for outcome, count in outcomes.items() %}
<span class="{{ outcome }}">{{ count }} {{ outcome }}</span>{{ "," if not loop.last }}
{%- endfor %}. Click a heading to sort by it.</p>
<table><thead><tr>{% for column in columns %}<th>{{ column }}</th>{% endfor %}</tr></thead><tbody>
{% for row in rows %}<tr>
{%- for column in columns %}{% set cell = row.get(column, "") %}
{%- if column == "bag" and row.file %}<td class="bag">
<a href="{{ row.file | urlencode }}">{{ cell }}</a></td>
{%- elif column == "outcome" %}<td class="{{ cell }}">{{ cell }}</td>
{%- elif cell is number %}<td class="number">{{ cell }}</td>
{%- else %}<td>{{ cell }}</td>{% endif %}{% endfor %}</tr>
{% endfor %}</tbody></table>
<script>
document.querySelectorAll("th").forEach((heading, column) => {
  let ascending = false;
  heading.addEventListener("click", () => {
    const body = document.querySelector("tbody"), sign = (ascending = !ascending) ? 1 : -1;
    const cell = row => row.cells[column].textContent;
    [...body.rows].sort((a, b) => sign * cell(a).localeCompare(
      cell(b), undefined, {numeric: true})).forEach(row => body.append(row));
  });
});
</script></body></html>
"""

_REPORT = _HEAD + """\
<h1>{{ title }}</h1>
<p>{{ transforms }} transforms of {{ frames }} frames in {{ "%.1f" | format(watched_s) }} s;
{{ errors }} errors, {{ warnings }} warnings, {{ notes }} notes</p>
{% for sentence in damage %}<p class="warning">{{ sentence }}</p>{% endfor %}
{% for finding in findings %}
<h2 class="{{ finding.severity }}">{{ finding.severity }} {{ finding.code }}</h2>
<p><b>{{ finding.frames | join(", ") }}</b></p>
<p>{{ finding.summary }}</p>
<table>{% if finding.publishers %}<tr><td>from</td>
<td>{% if finding.one_of %}one of {% endif %}{{ finding.publishers | join(", ") }}</td>
</tr>{% endif %}{% if finding.cause %}<tr><td>cause</td><td>{{ finding.cause }}</td></tr>
{%- endif %}{% if finding.fix %}<tr><td>fix</td><td>{{ finding.fix }}</td></tr>{% endif %}</table>
{% else %}<p class="fine">no findings</p>{% endfor %}
</body></html>
"""


@cache
def _template(text: str) -> Any:
    jinja2 = needs('jinja2', 'jinja2')
    return jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text)


def index_page(title: str, rows: Sequence[Mapping[str, object]], columns: Sequence[str],
               outcomes: Mapping[str, int]) -> bytes:
    """
    Return the page with the table of all bags, with links to the files of each.

    :param columns: the keys of the rows to show, in order; a row may lack some.
    """
    return _encoded(_INDEX, title=title, rows=rows, columns=columns, outcomes=outcomes)


def report_page(report: Mapping[str, Any]) -> bytes:
    """Return the page with the doctor's report on one bag."""
    return _encoded(_REPORT, title=report['source'], **report)


def _encoded(text: str, **values: object) -> bytes:
    page: str = _template(text).render(values)
    # The name of a file may hold bytes that are not text.
    return page.encode(errors='replace')

# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Tells mkdocs which documents make the site.

Files keep their paths in the repository, so links hold on the site as they do there. A source or
a folder that a page links to becomes a page.
"""

from pathlib import Path
import posixpath
import re
from xml.etree import ElementTree

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

REPOSITORY = Path(__file__).resolve().parents[2]
OUTSIDE_DOCS = sorted(path.name for path in REPOSITORY.glob('*.md'))

_LINK = re.compile(r'(?<=\]\()(\s*)([^)#:\s]+)(?=[)#])')


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """
    Let every page lead to the repository, once package.xml has its address.

    From its foot: in its head, pages would ask GitHub how many stars there are.
    """
    address = ElementTree.parse(REPOSITORY / 'package.xml').findtext('url[@type="repository"]')
    if address:
        config.extra['social'] = [
            {'icon': 'fontawesome/brands/git-alt', 'link': address, 'name': 'Repository'}]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Return what the site consists of: the theme, the documents, and the pages made for it."""
    theme = [file for file in files if file.src_dir != config.docs_dir]
    texts = [*OUTSIDE_DOCS, *(f'docs/{file.src_uri}' for file in files if file not in theme
                              and not file.src_uri.endswith(('.py', '.pyc')))]
    return Files([
        *theme,
        *(File.generated(config, path, abs_src_path=str(REPOSITORY / path)) for path in texts),
        *(File.generated(config, f'{path}.md', content=_source_page(path),
                         inclusion=InclusionLevel.NOT_IN_NAV) for path in _sources(texts)),
    ])


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Return the page with links to pages of sources, and with Markdown in what unfolds."""
    def led(link: re.Match[str]) -> str:
        is_source = files.get_file_from_path(f'{_resolved(page.file.src_uri, link[2])}.md')
        return f'{link[0]}.md' if is_source else link[0]
    return _LINK.sub(led, markdown).replace('<details>', '<details markdown>')


def _resolved(page: str, link: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), link))


def _sources(texts: list[str]) -> list[str]:
    """Return the files and folders that pages link to, and what is inside."""
    linked = {_resolved(text, link) for text in texts if text.endswith('.md')
              for _, link in _LINK.findall((REPOSITORY / text).read_text())} - set(texts)
    found = [path for link in sorted(linked) if (path := REPOSITORY / link).exists()]
    for path in found:  # which grows
        found += [inside for inside in _inside(path) if inside not in found]
    return [path.relative_to(REPOSITORY).as_posix() for path in found]


def _inside(path: Path) -> list[Path]:
    """Return the programs in a folder, and the folders with some."""
    return sorted(inside for inside in path.glob('*')
                  if inside.suffix == '.py' or any(inside.glob('*.py')))


def _source_page(path: str) -> str:
    """Return the page of a file, or of a folder with links to what is inside."""
    source = REPOSITORY / path
    top = f'---\nsearch:\n  boost: 0.005\n---\n\n# {path}\n\n'  # found after what explains it
    if source.is_dir():
        return top + ''.join(f'- [{inside.name}]({source.name}/{inside.name})\n'
                             for inside in _inside(source))
    return f'{top}````{source.suffix[1:]}\n{source.read_text()}````\n'

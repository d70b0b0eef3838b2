"""Chapters and links of the book that .ci/book makes.

contents FOLDER   copies README.md and docs/ to FOLDER/src, with SUMMARY.md and book.toml beside
check FOLDER      fails for links between pages that lead nowhere
"""

import pathlib
import re
import shutil
import sys
from html.parser import HTMLParser

LINK = re.compile(r"\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")


def rows(page):
    """Returns (title, target) of the links in the first column of the page's tables."""
    found = []
    for line in page.read_text().splitlines():
        row = re.match(r"\| \[([^\]]+)\]\(([^)]+)\) \| ([^|]*)", line)
        if row:
            found.append(row.groups())
    return found


def chapters(docs):
    """Lists the chapters that docs/README.md names, and below each folder its own."""
    lines = ["# Summary", "", "[Lanecast](index.md)", "[Where things are](contents.md)", ""]
    for title, target, _ in rows(docs / "README.md"):
        if not target.endswith(".md"):
            continue
        page = docs / target
        heading = next(l for l in page.read_text().splitlines() if l.startswith("# "))[2:]
        lines.append(f"- [{heading}]({target})")
        if page.name != "README.md":
            continue
        listed = [name for _, name, _ in rows(page) if name.endswith(".md")]
        others = sorted(p.name for p in page.parent.glob("*.md") if p != page)
        for name in dict.fromkeys([n for n in listed if n in others] + others):
            text = (page.parent / name).read_text()
            heading = next(l for l in text.splitlines() if l.startswith("# "))[2:]
            lines.append(f"  - [{heading}]({page.parent.relative_to(docs)}/{name})")
    return "\n".join(lines) + "\n"


def contents(folder):
    root = pathlib.Path(".").resolve()
    source = folder / "src"
    shutil.copytree(root / "docs", source)
    # The first page is the project's own; its name is taken from the index of docs/.
    front = (root / "README.md").read_text()
    front = front.replace("](docs/README.md", "](contents.md").replace("](docs/", "](")
    (source / "index.md").write_text(front.replace('src="docs/', 'src="'))
    (source / "README.md").rename(source / "contents.md")
    for index in list(source.rglob("README.md")):
        index.rename(index.with_name("index.md"))
    (source / "SUMMARY.md").write_text(chapters(root / "docs").replace("/README.md)", "/index.md)"))
    for page in source.rglob("*.md"):
        def local(link):
            text, target, _ = link.groups()
            if not target or "://" in target:
                return link[0]
            path = (page.parent / target).resolve()
            if path.name == "README.md" and path.parent != source.resolve():
                target = target.removesuffix("README.md") + "index.md"
                path = path.with_name("index.md")
            # What lies outside of the documentation keeps its name alone.
            if not (path.exists() and path.is_relative_to(source.resolve())):
                return text
            return f"[{text}]({target}{link[3] or ''})"
        page.write_text(LINK.sub(local, page.read_text()))
    (folder / "book.toml").write_text(
        '[book]\ntitle = "Lanecast"\nlanguage = "en"\n\n[output.html]\nno-section-label = true\n'
    )


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.links, self.names = [], set()

    def handle_starttag(self, tag, attributes):
        for key, value in attributes:
            if key == "id":
                self.names.add(value)
            if (tag, key) in (("a", "href"), ("img", "src")) and value:
                self.links.append(value)


def check(folder):
    pages = {}
    for path in folder.rglob("*.html"):
        pages[path.resolve()] = page = Page()
        page.feed(path.read_text())
    bad = []
    for path, page in pages.items():
        if path.name in ("print.html", "toc.html", "404.html"):
            continue
        for link in page.links:
            if "://" in link or link.startswith(("mailto:", "data:")):
                continue
            target, _, name = link.partition("#")
            to = (path.parent / target).resolve() if target else path
            if not to.exists():
                bad.append(f"{path.relative_to(folder)}: {link} is not there")
            elif name and to in pages and name not in pages[to].names:
                bad.append(f"{path.relative_to(folder)}: {link} names no heading")
    print(f"{len(pages)} pages, {len(bad)} broken links")
    print("\n".join(bad))
    sys.exit(bool(bad))


if __name__ == "__main__":
    verb, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    {"contents": contents, "check": check}[verb](folder)

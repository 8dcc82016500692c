"""Links of a site that lead nowhere: files that are not there, and anchors that no element has."""
from html.parser import HTMLParser
from urllib.parse import unquote, urldefrag, urlsplit

TARGETS = {"a": "href", "link": "href", "img": "src", "script": "src"}


class Page(HTMLParser):
    """What one page links to, its anchors, and the anchors of signatures among them."""

    def __init__(self, path):
        super().__init__()
        self.path, self.links, self.anchors, self.signatures = path, set(), set(), set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        link = values.get(TARGETS.get(tag))
        if link:
            self.links.add(link)
        if values.get("id"):
            self.anchors.add(values["id"])
        if tag == "dt" and "sig" in values.get("class", "").split():
            self.signatures.add(values.get("id"))


def read_pages(site):
    return {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}


def broken_links(pages):
    """As texts "page: link". Links to other sites are not followed."""
    for page in pages.values():
        for link in sorted(page.links):
            if not urlsplit(link).scheme and not is_right(pages, page, link):
                yield f"{page.path}: {link}"


def is_right(pages, page, link):
    file, anchor = urldefrag(link)
    path = (page.path.parent / unquote(urlsplit(file).path)).resolve() if file else page.path.resolve()
    if not anchor or path not in pages:
        return path.exists()
    return unquote(anchor) in pages[path].anchors

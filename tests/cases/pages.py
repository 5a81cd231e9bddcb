"""What every HTML report must be: one well-formed file that fetches nothing."""

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """Checks that tags are nested, and keeps ids, tags, links and text."""

    def __init__(self, html):
        super().__init__()
        self.open, self.ids, self.tags, self.links, self.words = [], [], [], [], []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append(tag)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [given[k] for k in ("src", "href", "xlink:href", "data") if k in given]
        assert not [k for k in given if k.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, f"</{tag}>"

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style",):
            self.words.append(data)

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.words))


def assert_self_contained(html):
    page = Page(html)
    assert not page.open, page.open
    assert not {"script", "iframe", "link", "object", "img"} & set(page.tags)
    assert all(link.startswith("#") for link in page.links), "something is fetched from outside"
    assert "@import" not in html and not re.search(r"url\((?!#)", html)
    assert len(page.ids) == len(set(page.ids)), "two parts of the page have the same id"
    for target in re.findall(r'(?:href="|url\()#([^")]+)', html):
        assert target in page.ids, target
    return page

"""The menu at the left: its sections fold, and those that the reader is not in are folded."""

from bs4 import BeautifulSoup


def fold(tree):
    """Every caption with its list becomes a ``details``; open is the one with the current page, or else the first."""
    soup = BeautifulSoup(tree, "html.parser")
    sections = [caption for caption in soup.find_all("p", class_="caption") if caption.find_next_sibling("ul")]
    here = [caption for caption in sections if caption.find_next_sibling("ul").select(".current")]
    for caption in sections:
        pages = caption.find_next_sibling("ul")
        section = soup.new_tag("details", attrs={"class": "section"})
        if caption in (here or sections[:1]):
            section["open"] = ""
        caption.wrap(section)
        caption.name = "summary"
        section.append(pages)
    for link in soup.select(".current-page > a"):
        link["aria-current"] = "page"
    return str(soup)


def change(app, pagename, templatename, context, doctree):
    if context.get("furo_navigation_tree"):
        context["furo_navigation_tree"] = fold(context["furo_navigation_tree"])


def setup(app):
    app.connect("html-page-context", change, priority=900)  # after the theme has made the menu
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""The site as a browser shows it: on a phone, offline, in its own font; what a search finds. Needs `make docs`."""

import re

import pytest

SEARCHES = {
    "trees": "docs/trees.html",
    "k": "docs/filters/ring_builder.html#RingBuilder.k",
    "skeletonize": "docs/generated/api/glsk_o3d.skeletonize.html",
}


@pytest.fixture(scope="module")
def site(root):
    if not (root / "build" / "docs" / "docs" / "index.html").exists():
        pytest.skip("needs the site: make docs")
    return root / "build" / "docs"


@pytest.fixture(scope="module")
def visit(launch, site, patience):
    """Open a page of the site offline, in a tab as wide as a phone."""
    tab = launch().new_context(viewport={"width": 390, "height": 900}, offline=True).new_page()
    tab.set_default_timeout(1e3 * patience)

    def go(page):
        path, mark, rest = re.match(r"([^?#]*)([?#]?)(.*)", page).groups()
        tab.goto((site / path).as_uri() + mark + rest)
        return tab

    return go


def test_no_page_is_wider_than_a_phone(site, visit):
    width = "Math.max(document.documentElement.scrollWidth, document.querySelector('article')?.scrollWidth ?? 0)"
    pages = [str(path.relative_to(site)) for path in site.rglob("*.html")]
    pages = [page for page in pages if not re.search(r"_static|api/glsk|^index", page)]
    assert {page: wide for page in pages if (wide := visit(page).evaluate(width)) > 390} == {}


def test_the_site_loads_nothing_from_elsewhere(site):
    """Sphinx checks where its links lead: warnings are errors."""
    for path in site.rglob("*.html"):
        assert not re.search(
            r'\bsrc="https?:|<link [^>]*rel="stylesheet"[^>]*href="https?:', path.read_text("utf-8")
        ), path


def test_equations_are_set_in_the_font_of_the_site(visit):
    tab = visit("docs/filters/contractor.html")
    tab.evaluate("document.fonts.ready")
    session = tab.context.new_cdp_session(tab)
    for domain in ("DOM", "CSS"):
        session.send(f"{domain}.enable")
    top = session.send("DOM.getDocument")["root"]["nodeId"]
    letters = session.send("DOM.querySelectorAll", {"nodeId": top, "selector": "math :is(mi, mn, mo)"})["nodeIds"]
    fonts = [session.send("CSS.getPlatformFontsForNode", {"nodeId": letter})["fonts"] for letter in letters[:100]]
    assert {font["familyName"] for used in fonts for font in used} == {"Glsk Math"}


@pytest.mark.parametrize("query", SEARCHES)
def test_a_search_finds_the_page_first(query, visit):
    tab = visit(f"search.html?q={query}")
    tab.wait_for_function("document.querySelector('.search-summary')?.innerText")
    first = tab.eval_on_selector("ul.search > li > a", "(link) => link.getAttribute('href')")
    assert first.removesuffix("#") == SEARCHES[query]

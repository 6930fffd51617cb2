"""The site, as a browser shows it: on a phone, with its own font, and what a search finds. Needs `make docs`."""

import json
import re

import pytest

BROKEN = """[...document.querySelectorAll("article :is(td, th)")].flatMap((cell) => {
    const broken = [], texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT), range = document.createRange();
    for (let text = texts.nextNode(); text; text = texts.nextNode())
        for (const word of text.data.matchAll(/[\\p{L}\\p{N}_]+/gu)) {
            range.setStart(text, word.index);
            range.setEnd(text, word.index + word[0].length);
            const heights = [...range.getClientRects()].filter((box) => box.width).map((box) => Math.round(box.top));
            if (new Set(heights).size > 1) broken.push(word[0]);
        }
    return broken;
})"""
"""Words in tables that go over more than one line."""
SEARCHES = {
    "ring builder": "docs/filters/ring_builder.html",
    "trees": "docs/trees.html",
    "k": "docs/filters/ring_builder.html#RingBuilder.k",
    "skeletonize": "docs/generated/api/glsk_o3d.skeletonize.html",
    "tree_measures": "docs/generated/api/glsk_o3d.analysis.tree_measures.html",
    "ROS": "docs/robots.html",
}


@pytest.fixture(scope="module")
def site(root):
    place = root / "build" / "docs"
    if not (place / "docs" / "index.html").exists():
        pytest.skip("needs the site: make docs")
    return place


@pytest.fixture(scope="module")
def visit(launch, site, patience):
    """Open a page of the site offline; one tab for each width and each scheme."""
    browser, tabs = launch(), {}

    def go(page, width=1400, scheme="light"):
        if (width, scheme) not in tabs:
            size = {"width": width, "height": 900}
            context = browser.new_context(viewport=size, color_scheme=scheme, offline=True)
            context.set_default_timeout(1e3 * patience)
            tabs[width, scheme] = context.new_page()
        tab = tabs[width, scheme]
        place, mark, rest = re.match(r"([^?#]*)([?#]?)(.*)", page).groups()
        tab.goto((site / place).as_uri() + mark + rest)
        return tab

    return go


def pages(site):
    """Every page that was written by hand, all tasks of the API, the gallery, and where names are longest."""
    written = [path for path in site.rglob("*.html") if not {"generated", "_static"} & {*path.relative_to(site).parts}]
    api = [path for path in site.glob("docs/generated/api/*.html") if not path.stem.startswith("glsk_o3d")]
    long = sorted(site.glob("docs/generated/api/glsk_o3d*.html"), key=lambda path: -len(path.stem))[:8]
    gallery = [site / "docs/generated/gallery" / f"{name}.html" for name in ("index", "plot_03_open3d_pipeline")]
    found = [path.relative_to(site) for path in (*written, *api, *long, *gallery)]
    return [str(path) for path in found if str(path) != "index.html"]  # this one only leads to the first page


def test_no_page_is_wider_than_a_phone_and_no_word_of_a_table_is_broken(site, visit):
    wide, broken = {}, {}
    for page in pages(site):
        tab = visit(page, 390)
        width = tab.evaluate(
            "Math.max(document.documentElement.scrollWidth, document.querySelector('article').scrollWidth)"
        )
        if width > 390:
            wide[page] = width
        if words := tab.evaluate(BROKEN):
            broken[page] = words
    assert wide == {}
    assert broken == {}


def test_equations_are_set_in_the_font_that_comes_with_the_site(visit):
    tab = visit("docs/filters/contractor.html")
    tab.evaluate("document.fonts.ready")
    session = tab.context.new_cdp_session(tab)
    for domain in ("DOM", "CSS"):
        session.send(f"{domain}.enable")
    top = session.send("DOM.getDocument")["root"]["nodeId"]
    letters = session.send("DOM.querySelectorAll", {"nodeId": top, "selector": "math :is(mi, mn, mo)"})["nodeIds"]
    assert len(letters) > 100
    used = set()
    for letter in letters[:100]:
        used |= {it["familyName"] for it in session.send("CSS.getPlatformFontsForNode", {"nodeId": letter})["fonts"]}
    assert used == {"Glsk Math"}
    raised = "[...document.querySelectorAll('math :is(msup, msubsup) > :last-child')].map((part) => part.textContent)"
    assert "′" not in "".join(tab.evaluate(raised))  # fonts have it raised already
    lower = """[...document.querySelectorAll("math msub")].map((sub) => [...sub.children].map((part) =>
        part.getBoundingClientRect().bottom)).map(([letter, index]) => index - letter)"""
    assert min(tab.evaluate(lower)) > 0.5  # pixels


def listed(tab):
    """Where the results of a search lead, in their order."""
    tab.wait_for_function("document.querySelector('.search-summary')?.innerText")
    return tab.eval_on_selector_all("ul.search > li > a", "(links) => links.map((link) => link.getAttribute('href'))")


@pytest.mark.parametrize("query", SEARCHES)
def test_a_search_finds_the_page_first(query, visit):
    found = listed(visit(f"search.html?q={query}"))
    assert found[0] in (SEARCHES[query], SEARCHES[query] + "#")


def test_what_is_internal_cannot_be_searched_for(site):
    text = (site / "searchindex.js").read_text("utf-8")
    index = json.loads(text[text.index("{") : text.rindex("}") + 1])
    names = [each[4] if isinstance(each, list) else each for those in index["objects"].values() for each in those]
    assert len(names) > 100
    assert [name for name in names if re.search(r"(^|\.)_", name)] == []
    assert not any(re.search(r"[(. ]_\w", entry) for entry in index["indexentries"])

/* What a search lists first: pages that explain, then the names that users import, then parts of the package and old news.
   Entries of the index (keywords of pages, options of filters) have up to 100 points by themselves. */
var Scorer = {
  score: ([docname, title, anchor, descr, score, filename, kind]) => {
    const api = "docs/generated/api/";
    if (kind === "index") return score;
    if (docname === "CHANGELOG") return score - 14;
    if (docname === api + "extending" || /api\/glsk_o3d\.\w+\.\w+\./.test(docname)) return score - 12;
    if (docname.startsWith(api)) return kind === "text" ? score - 4 : score;
    if (docname.startsWith("docs/generated/gallery/")) return score - 2;
    if (/^(docs\/(architecture|comparison_tables)|CONTRIBUTING|benchmarks|filters)/.test(docname)) return score - 8;
    return score;
  },
  objNameMatch: 12, // "prune" is glsk_o3d.editing.prune
  objPartialMatch: 3, // and a part of others
  objPrio: { 0: 0, 1: 3, 2: -5 }, // modules are not what is looked for
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};

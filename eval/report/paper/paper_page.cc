
#include <algorithm>
#include <regex>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/latex.h"
#include "sextant/eval/report/paper/paper_layout.h"

namespace sextant {

std::span<const EmbeddedFile> paper_page_files();

namespace {

std::string_view paper_file(std::string_view name) {
  return find_entry(paper_page_files(), name, "file").text;
}

/// Escapes a text and formats E_t as a symbol with an index.
std::string symbols(const std::string& text) {
  static const std::regex symbol(R"(\bE_([tRv])\b)");
  return std::regex_replace(html_escaped(text), symbol, "<i>E</i><sub>$1</sub>");
}

const char* tone_class(const LayoutCell& cell) {
  if (cell.empty() || !cell.front().measured) return "missing";
  const std::string& verdict = cell.front().verdict;
  if (verdict.empty()) return "plain";
  return verdict.starts_with("within") ? "agrees" : verdict.starts_with("outside") ? "differs" : "open";
}

/// Our value, with the published value in small type below it.
std::string cell_html(const LayoutVersion& version, const LayoutRow& row, const LayoutCell& cell) {
  std::string ours = cell_measured(row, cell), sign;
  const std::string published = cell_published(row, cell);
  if (ours.empty() && published.empty()) return "<td></td>";
  const std::string of_verdict = verdict_sign(cell.front().verdict);
  if (!of_verdict.empty() && ours.ends_with(of_verdict)) {
    ours.resize(ours.size() - of_verdict.size());
    sign = fmt::format("<span class=\"sign {}\">{}</span>", tone_class(cell), of_verdict);
  }
  ours = html_escaped(ours);
  if (cell.front().best) ours = "<b>" + ours + "</b>";
  std::string below = html_escaped(published);
  if (cell.front().best_published) below = "<b>" + below + "</b>";
  if (!below.empty()) below = "<small>" + below + "</small>";
  return fmt::format("<td class=\"{}\" tabindex=\"0\" title=\"{}\">{}{}{}</td>", tone_class(cell),
                     html_escaped(cell_details(version, cell)), ours, sign, below);
}

std::string header_html(const PaperLayout& layout) {
  std::string html = "<thead>";
  for (const auto& groups : layout.header) {
    html += "<tr>";
    for (const HeaderGroup& group : groups) {
      const std::string span = group.span > 1 ? fmt::format(" colspan=\"{}\"", group.span) : "";
      html += fmt::format("<th scope=\"{}\"{}>{}</th>", group.span > 1 ? "colgroup" : "col", span,
                          symbols(group.text));
    }
    html += "</tr>\n";
  }
  return html + "</thead>\n";
}

/// Number of rows from i on that have its first label.
size_t label_span(const std::vector<const LayoutRow*>& rows, size_t i) {
  size_t n = 1;
  while (i + n < rows.size() && rows[i + n]->labels.front() == rows[i]->labels.front()) ++n;
  return n;
}

std::string rows_html(const LayoutVersion& version, const std::vector<const LayoutRow*>& rows) {
  std::string html;
  size_t spanned = 0;  // remaining rows that share the first label of a row above
  for (size_t i = 0; i < rows.size(); ++i) {
    const LayoutRow& row = *rows[i];
    const bool rule = i > 0 && row.is_added && !rows[i - 1]->is_added;
    html += rule ? "<tr class=\"rule\">" : "<tr>";
    const bool several = row.labels.size() > 1;
    if (spanned > 0) {
      --spanned;
    } else if (several) {
      const size_t n = label_span(rows, i);
      html += fmt::format("<th scope=\"row\" rowspan=\"{}\">{}</th>", n, html_escaped(row.labels.front()));
      spanned = n - 1;
    }
    html += fmt::format("<th scope=\"row\">{}</th>", symbols(row.labels.back()));
    for (const auto& cell : row.cells) html += cell_html(version, row, cell);
    html += "</tr>\n";
  }
  return html;
}

std::string table_html(const PaperLayout& layout, const LayoutVersion& version,
                       const std::vector<const LayoutRow*>& rows, const std::string& label) {
  return fmt::format(
      "<div class=\"scroll\" role=\"region\" tabindex=\"0\" "
      "aria-label=\"{}\"><table>\n{}<tbody>\n{}</tbody></table></div>\n",
      html_escaped(label), header_html(layout), rows_html(version, rows));
}

std::string version_html(const PaperLayout& layout, const LayoutVersion& version, bool for_print) {
  std::vector<const LayoutRow*> shown, folded;
  for (const LayoutRow& row : version.rows) (row.in_terminal ? shown : folded).push_back(&row);
  std::string html = fmt::format("<div class=\"version\" data-name=\"{}; {}\">\n<p>{}</p>\n",
                                 html_escaped(version.procedure),
                                 html_escaped(version.data.empty() ? "not measured" : version.data),
                                 html_escaped(layout.sentence(version)));
  html += table_html(layout, version, shown, "Table " + layout.number);
  if (!folded.empty() && !for_print)
    html += "<details><summary>Other systems under our harness</summary>\n" +
            table_html(layout, version, folded, "Table " + layout.number + ", other systems") +
            "</details>\n";
  for (const std::string& note : version.notes) html += "<p class=\"note\">" + html_escaped(note) + "</p>\n";
  if (version.is_incomplete && !for_print)
    html += fmt::format("<details><summary>\u2013 not measured here</summary><p>run: {}</p></details>\n",
                        html_escaped(layout.missing));
  return html + "</div>\n";
}

std::string layout_html(const PaperLayout& layout, bool for_print) {
  const char* wide = layout.columns.size() > 6 ? " wide" : "";
  std::string html = fmt::format("<section class=\"paper-table{}\" id=\"paper_{}\">\n<h3>Table {}: {}</h3>\n",
                                 wide, layout.name, layout.number, html_escaped(layout.title));
  for (const LayoutVersion& version : layout.versions) {
    html += version_html(layout, version, for_print);
    if (for_print) break;
  }
  if (!for_print) {
    html += "<p class=\"files\">";
    for (const char* ending : {"txt", "md", "tex", "csv", "json"})
      html += fmt::format("<a href=\"paper/{0}.{1}\">{1}</a> ", layout.name, ending);
    html += "</p>\n";
  }
  return html + "</section>\n";
}

PaperPlace place_of(const PaperLayout& layout) {
  for (const PaperTable& table : paper_tables())
    if (table.number == layout.number) return table.place;
  throw InternalError("no table " + layout.number);
}

}  // namespace

Fragment paper_fragment(const std::vector<PaperLayout>& layouts) {
  Fragment fragment;
  fragment.html = fmt::format(
      "<section id=\"paper\">\n<h2>The paper's tables</h2>\n<p>Our value, and the published one in "
      "parentheses. {}. A cell shows its interval, runs and data when the pointer or the keyboard focus is "
      "on it.</p>\n"
      "<div class=\"paper-tables\">\n",
      verdict_signs);
  fragment.markdown = fmt::format("## The paper's tables\n\n{}\n\n", verdict_signs);
  for (const PaperLayout& layout : layouts) {
    fragment.html += layout_html(layout, false);
    fragment.markdown += to_markdown(layout) + "\n";
  }
  fragment.html += "</div>\n</section>\n";
  fragment.style = paper_file("paper.css");
  fragment.script = paper_file("versions.js");
  return fragment;
}

std::string paper_page(const std::string& title, const std::string& answer,
                       const std::vector<PaperLayout>& layouts, const std::vector<PrintedFigure>& figures,
                       const OutputFiles& drawn) {
  std::vector<std::pair<PaperPlace, std::string>> places;
  for (const PaperLayout& layout : layouts) places.emplace_back(place_of(layout), layout_html(layout, true));
  for (const PrintedFigure& figure : figures) {
    const auto svg = drawn.find("figures/" + figure.name + ".svg");
    SEXTANT_CHECK(svg != drawn.end());
    places.emplace_back(
        figure.place,
        fmt::format("<figure style=\"width:{2:g}cm\"><img alt=\"{0}\" "
                    "src=\"data:image/svg+xml;base64,{1}\">\n<figcaption>{0}</figcaption></figure>\n",
                    html_escaped(figure.caption), base64(svg->second), figure.width_cm));
  }
  std::ranges::stable_sort(places, {}, &std::pair<PaperPlace, std::string>::first);
  const std::string style = std::string(paper_file("paper.css")).append(paper_file("print.css"));
  std::string html = page_head(title, style, /*has_scripts=*/false);
  html += fmt::format("<h1>{}</h1>\n<p>{}</p>\n<p class=\"note\">{}.</p>\n<main>\n", html_escaped(title),
                      html_escaped(answer), verdict_signs);
  for (const auto& [place, part] : places) html += part;
  return html + "</main>\n</body>\n</html>\n";
}

OutputFiles paper_files(const std::vector<PaperLayout>& layouts) {
  OutputFiles files;
  for (const PaperLayout& layout : layouts) {
    const std::string stem = "paper/" + layout.name;
    files[stem + ".txt"] = to_text(layout, true);
    files[stem + ".md"] = to_markdown(layout);
    files[stem + ".tex"] = to_latex(layout);
    files[stem + ".csv"] = to_csv(layout);
    files[stem + ".json"] = json_text(to_json(layout));
  }
  return files;
}

}  // namespace sextant

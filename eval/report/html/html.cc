#include "sextant/eval/report/html/html.h"

#include <openssl/evp.h>

#include <algorithm>
#include <climits>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/names.h"
#include "sextant/base/text.h"
#include "sextant/eval/report/latex.h"
#include "sextant/eval/report/table.h"

namespace sextant {

std::span<const EmbeddedFile> report_page_files();

namespace {

constexpr size_t wide_columns = 12;     // tables with this many columns are printed in landscape
constexpr size_t crowded_columns = 13;  // tables with this many columns have smaller letters

/// Badge with colour and sign; the sign is for readers who do not see the colour.
std::string verdict_badge(const std::string& verdict) {
  const Tone tone = tone_of(verdict);
  const char* sign = tone == Tone::agrees ? "✓" : tone == Tone::differs ? "✗" : "–";
  return fmt::format("<span class=\"verdict {}\"><span aria-hidden=\"true\">{} </span>{}</span>",
                     tone == Tone::agrees    ? "agrees"
                     : tone == Tone::differs ? "differs"
                                             : "open",
                     sign, html_escaped(verdict));
}

/// Escapes a text. Paths of records, "parts/NAME/records.jsonl", which are relative to the folder above the
/// report, become links.
std::string with_links(const std::string& text) {
  const std::string records = "/records.jsonl";
  std::string html = html_escaped(text);
  for (size_t end = html.find(records); end != std::string::npos; end = html.find(records, end)) {
    const size_t begin = html.rfind("parts/", end);
    end += records.size();
    if (begin == std::string::npos || html.find_first_of(" ,<", begin) < end) continue;
    const std::string path = html.substr(begin, end - begin);
    const std::string link = fmt::format("<a href=\"../{0}\">{0}</a>", path);
    html.replace(begin, path.size(), link);
    end = begin + link.size();
  }
  return html;
}

std::string paragraph(const std::string& text, const char* css_class = nullptr) {
  if (text.empty()) return "";
  if (css_class == nullptr) return "<p>" + with_links(text) + "</p>\n";
  return fmt::format("<p class=\"{}\">{}</p>\n", css_class, with_links(text));
}

constexpr const char* details_page = "details.html";

/// The two pages of a document: report.html, and details.html with the sections that are details.
enum class Page { report, details };

bool is_on(const ReportSection& section, Page page) { return section.is_detail == (page == Page::details); }

std::string contents(const ReportDocument& document, Page page) {
  std::string html = "<nav aria-label=\"Contents\">\n<ul>\n";
  if (page == Page::report && !document.verdicts.empty())
    html += "<li><a href=\"#summary\">Summary</a></li>\n";
  for (const ReportSection& section : document.sections) {
    if (page == Page::details && !section.is_detail) continue;
    html += fmt::format("<li><a href=\"{}#{}\">{}</a></li>\n", is_on(section, page) ? "" : details_page,
                        section.name, html_escaped(section.heading));
  }
  if (page == Page::details) return html + "</ul>\n</nav>\n";
  if (!document.provenance.empty()) html += "<li><a href=\"#provenance\">Provenance</a></li>\n";
  if (!document.citation.empty()) html += "<li><a href=\"#citation\">How to cite</a></li>\n";
  return html + "</ul>\n</nav>\n";
}

std::string class_of(const Column& column, size_t length, bool is_first) {
  constexpr size_t long_text = 24;  // characters from which a cell is kept from becoming narrow and high
  std::string classes = column.align == Align::right ? "number" : length > long_text ? "long" : "";
  if (!is_first) classes += classes.empty() ? "second" : " second";
  return classes.empty() ? "" : fmt::format(" class=\"{}\"", classes);
}

bool is_first(const NamedTable& named, const Column& column) {
  return named.first.empty() || std::ranges::find(named.first, column.key) != named.first.end();
}

/// One cell; numbers carry their exact value for sorting. `address` may be null.
std::string table_cell(const Cell& cell, const Column& column, const std::string* address, bool is_first) {
  const std::string text = shown(cell, column);
  std::string attributes = class_of(column, text.size(), is_first);
  if (const double* number = cell.number()) attributes += fmt::format(" data-value=\"{}\"", *number);
  const bool is_verdict = column.key.ends_with("verdict") && text != "-";
  if (address != nullptr && !address->empty() && text != "-") {
    // Addresses of records in a report's tables are relative to the folder above the report.
    const std::string to = (address->starts_with("parts/") ? "../" : "") + *address;
    return fmt::format("<td{}><a href=\"{}\">{}</a></td>", attributes, html_escaped(to),
                       is_verdict ? verdict_badge(text) : html_escaped(text));
  }
  return fmt::format("<td{}>{}</td>", attributes, is_verdict ? verdict_badge(text) : with_links(text));
}

/// Appends rows that share the values stated above them; `id` is the anchor of the part, or empty.
void append_part(const NamedTable& named, const Table& part, const std::string& id, std::string& html) {
  const std::string& label = named.table.title.empty() ? named.name : named.table.title;
  const auto [table, folded] = fold_columns(for_people(part));
  if (!id.empty()) html += fmt::format("<div id=\"{}\"></div>\n", id);
  html += paragraph(folded, "folded");
  html += fmt::format("<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{}\">\n<table>\n",
                      html_escaped(folded.empty() ? label : label + ": " + folded));
  html += "<thead><tr>";
  for (const Column& column : table.columns) {
    html += fmt::format("<th scope=\"col\"{}>{}</th>", class_of(column, 0, is_first(named, column)),
                        html_escaped(column.title));
  }
  html += "</tr></thead>\n<tbody>\n";
  for (size_t i = 0; i < table.rows.size(); ++i) {
    html += "<tr>";
    for (size_t j = 0; j < table.columns.size(); ++j) {
      const std::string& key = table.columns[j].leads_to;
      const Cell* address = key.empty() ? nullptr : &part.rows[i][part.place(key)];
      html += table_cell(table.rows[i][j], table.columns[j], address ? address->text() : nullptr,
                         is_first(named, table.columns[j]));
    }
    html += "</tr>\n";
  }
  html += "</tbody>\n</table>\n</div>\n";
}

size_t n_columns(const NamedTable& named) {
  size_t n = 0;
  for_each_part(named.table, named.split_by, [&](const Table& part) {
    const Table shown = fold_columns(for_people(part)).table;
    n = std::max<size_t>(n, std::ranges::count_if(shown.columns, [&](const Column& column) {
                           return is_first(named, column);
                         }));
  });
  return n;
}

bool is_wide(const NamedTable& named) { return n_columns(named) >= wide_columns; }

/// Appends a table below a heading that may already equal the table's title.
void append_table(const NamedTable& named, const std::string& heading, std::string& html) {
  const Table& table = named.table;
  const size_t n = n_columns(named);
  html += fmt::format("<section class=\"table{}{}\" id=\"{}\">\n", n >= wide_columns ? " wide" : "",
                      n >= crowded_columns ? " crowded" : "", named.name);
  if (!table.title.empty() && table.title != heading)
    html += fmt::format("<h3>{}</h3>\n", html_escaped(table.title));
  html += paragraph(table.caption, "caption");
  if (!named.first.empty())
    html += fmt::format(
        "<input type=\"checkbox\" class=\"more\" id=\"all-{0}\"><label for=\"all-{0}\">all "
        "columns</label>\n",
        named.name);
  size_t i = 0;
  for_each_part(named.table, named.split_by, [&](const Table& part) {
    append_part(named, part, named.split_by.empty() ? "" : part_anchor(named.name, i++), html);
  });
  for (const std::string& note : table.notes) html += paragraph(note, "note");
  if (!table.remarks.empty()) html += "<details>\n<summary>Remarks</summary>\n";
  for (const std::string& remark : table.remarks) html += paragraph(remark, "note");
  if (!table.remarks.empty()) html += "</details>\n";
  html += "</section>\n";
}

struct PageImage {
  std::string id, bytes, alt, caption;
  std::string link{};
  double width_cm = 0;  ///< 0: full width
};

constexpr double broad_cm = 16;  // wider figures are scrolled on a narrow screen to stay legible

std::string image(const PageImage& image) {
  const std::string width =
      image.width_cm > 0 ? fmt::format(" style=\"max-width:{:g}cm\"", image.width_cm) : "";
  const std::string type = image.bytes.starts_with("\xff\xd8") ? "image/jpeg"
                           : image.bytes.starts_with("<")      ? "image/svg+xml"
                                                               : "image/png";
  std::string shown =
      fmt::format("<img alt=\"{}\"{} src=\"data:{};base64,{}\">", html_escaped(image.alt),
                  type == "image/svg+xml" ? " class=\"drawn\"" : "", type, base64(image.bytes));
  if (!image.link.empty()) shown = fmt::format("<a href=\"{}\">{}</a>", html_escaped(image.link), shown);
  const char* broad = image.width_cm > broad_cm ? " class=\"broad\" tabindex=\"0\"" : "";
  return fmt::format("<figure id=\"{}\"{}{}>\n{}\n<figcaption>{}</figcaption>\n</figure>\n", image.id, broad,
                     width, shown, html_escaped(image.caption));
}

std::string figures_html(const std::vector<Figure>& figures, const OutputFiles& drawn) {
  if (figures.empty()) return "";
  std::string html = "<div class=\"figures\">\n";
  for (const Figure& figure : figures) {
    const auto svg = drawn.find(figure.name + ".svg");
    SEXTANT_CHECK(svg != drawn.end());
    // Figures have printed sizes; they are enlarged for the larger distance of a screen.
    html += image({figure.name, svg->second, figure.caption, figure.caption, "", 1.6 * figure.width_cm});
  }
  return html + "</div>\n";
}

std::string pictures_html(const std::vector<Picture>& pictures) {
  std::string html;
  bool in_row = false;
  const auto row = [&](bool begin) {
    if (begin != in_row) html += begin ? "<div class=\"pictures\">\n" : "</div>\n";
    in_row = begin;
  };
  for (const Picture& p : pictures) {
    row(p.small);
    html += image({p.name, p.jpeg.empty() ? p.png : p.jpeg, p.alt, p.caption, p.link});
  }
  row(false);
  return html;
}

/// Badge, subject and evidence of a verdict.
std::string verdict_line(const VerdictLine& line) {
  const std::string subject =
      line.link.empty()
          ? html_escaped(line.subject)
          : fmt::format("<a href=\"{}\">{}</a>", html_escaped(line.link), html_escaped(line.subject));
  return fmt::format("{}<span class=\"subject\">{}</span><span class=\"evidence\">{}</span>",
                     verdict_badge(line.verdict), subject, with_links(line.evidence));
}

std::string summary(const std::vector<VerdictLine>& verdicts) {
  if (verdicts.empty()) return "";
  std::string html = "<section id=\"summary\">\n<h2>Summary</h2>\n<p class=\"counts\">" +
                     html_escaped(count_verdicts(verdicts)) + "</p>\n";
  for (auto begin = verdicts.begin(); begin != verdicts.end();) {
    const auto end = std::find_if(begin, verdicts.end(),
                                  [&](const VerdictLine& line) { return line.group != begin->group; });
    if (!begin->group.empty()) html += fmt::format("<h3>{}</h3>\n", html_escaped(begin->group));
    html += "<ul class=\"verdicts\">\n";
    for (const VerdictLine& line : std::span(begin, end))
      html += fmt::format("<li><div class=\"line\">{}</div></li>\n", verdict_line(line));
    html += "</ul>\n";
    begin = end;
  }
  return html + "</section>\n";
}

bool has_explorer(const ReportDocument& document, Page page) {
  return std::ranges::any_of(document.sections, [&](const ReportSection& section) {
    return is_on(section, page) && !section.explorers.empty();
  });
}

/// Makes the links of the summary to sections and tables that are details point to details.html.
std::vector<VerdictLine> linked_verdicts(const ReportDocument& document) {
  std::set<std::string> details;
  for (const ReportSection& section : document.sections) {
    if (!section.is_detail) continue;
    details.insert("#" + section.name);
    for (const NamedTable& table : section.tables) {
      details.insert("#" + table.name);
      const size_t n = n_parts(table.table, table.split_by);
      for (size_t i = 0; i < n; ++i) details.insert("#" + part_anchor(table.name, i));
    }
  }
  std::vector<VerdictLine> lines = document.verdicts;
  for (VerdictLine& line : lines)
    if (details.contains(line.link)) line.link = details_page + line.link;
  return lines;
}

void append_section(const ReportSection& section, const OutputFiles& drawn, std::string& html) {
  // The heading of a section that consists of wide tables only is printed on the landscape page as well.
  const bool wide = section.figures.empty() && section.pictures.empty() && !section.tables.empty() &&
                    std::ranges::all_of(section.tables, is_wide);
  html += fmt::format("<section{} id=\"{}\">\n<h2>{}</h2>\n", wide ? " class=\"wide\"" : "", section.name,
                      html_escaped(section.heading));
  for (const std::string& text : section.paragraphs) html += paragraph(text);
  for (const std::string& command : section.commands)
    html += fmt::format("<pre tabindex=\"0\">{}</pre>\n", html_escaped(command));
  for (const Explorer& explorer : section.explorers) html += explorer_html(explorer);
  html += pictures_html(section.pictures) + figures_html(section.figures, drawn);
  for (const NamedTable& table : section.tables) append_table(table, section.heading, html);
  html += "</section>\n";
}

std::string provenance(const ReportDocument& document) {
  if (document.provenance.empty()) return "";
  std::string html = "<section id=\"provenance\">\n<h2>Provenance</h2>\n<dl>\n";
  for (const auto& [key, value] : document.provenance)
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", html_escaped(key), html_escaped(value));
  return html + "</dl>\n</section>\n";
}

std::string page_html(const ReportDocument& document, Page page, const OutputFiles& drawn) {
  const bool is_report = page == Page::report, has_explorers = has_explorer(document, page);
  static const Fragment no_lead;
  const Fragment& lead = is_report ? document.lead : no_lead;
  const std::string title = is_report ? document.title : document.title + ": details";
  std::string style(page_file("page.css"));
  if (has_explorers) style += page_file("explorer.css");
  std::string html = page_head(title, style + lead.style, /*has_scripts=*/true);
  html += fmt::format("<header>\n<h1>{}</h1>\n{}</header>\n{}", html_escaped(title),
                      paragraph(is_report ? document.abstract : document.details_abstract, "abstract"),
                      contents(document, page));
  html += "<main>\n" + lead.html;
  if (is_report) html += summary(linked_verdicts(document));
  for (const ReportSection& section : document.sections) {
    if (is_on(section, page)) append_section(section, drawn, html);
  }
  if (is_report) html += provenance(document);
  if (is_report && !document.citation.empty())
    html += fmt::format(
        "<section id=\"citation\">\n<h2>How to cite</h2>\n<pre tabindex=\"0\">{}</pre>\n</section>\n",
        html_escaped(document.citation));
  html += fmt::format("</main>\n<script>\n{}{}</script>\n", page_file("sort.js"), lead.script);
  if (has_explorers)
    html += fmt::format("<script>\n{}{}</script>\n", page_file("canvas.js"), page_file("explorer.js"));
  html += "</body>\n</html>\n";
  return html;
}

}  // namespace

std::string page_head(const std::string& title, const std::string& style, bool has_scripts) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"generator\" content=\"Sextant\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'{}\">\n"
      "<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n",
      has_scripts ? "; script-src 'unsafe-inline'" : "", html_escaped(title), style);
}

std::string_view page_file(std::string_view name) {
  return find_entry(report_page_files(), name, "file").text;
}

std::string script_json(const Json& json) {
  std::string text;
  for (const char c : json_line(json)) c == '<' ? text += "\\u003c" : text += c;
  return text;
}

std::string html_escaped(const std::string& text) {
  using Entity = std::pair<char, const char*>;
  static constexpr Entity entities[] = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
  std::string out;
  for (const char c : page_text(text)) {
    const auto entity = std::ranges::find(entities, c, &Entity::first);
    entity == std::end(entities) ? out.push_back(c) : void(out += entity->second);
  }
  return out;
}

std::string base64(const std::string& bytes) {
  SEXTANT_CHECK(bytes.size() <= INT_MAX);
  std::string out((bytes.size() + 2) / 3 * 4, '\0');  // OpenSSL writes a zero after the last digit as well
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()),
                  reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  return out;
}

namespace {

/// Returns one LaTeX float for each part that pages show as a table; the first has the caption, the last the
/// notes.
std::string latex_of(const NamedTable& named) {
  const size_t n = n_parts(named.table, named.split_by);
  if (n <= 1) return to_latex(named.table, named.name);
  size_t i = 0;
  std::string text;
  for_each_part(named.table, named.split_by, [&](const Table& shown) {
    Table part = shown;
    if (i > 0) part.caption.clear();
    if (i + 1 < n) part.notes.clear();
    if (i + 1 < n) part.remarks.clear();
    text += to_latex(part, i == 0 ? named.name : fmt::format("{}_{}", named.name, i + 1));
    ++i;
  });
  return text;
}

void write_table_files(const NamedTable& named, const FileWriter& write) {
  const std::string stem = "tables/" + named.name;
  write(stem + ".md", to_markdown(named.table));
  write(stem + ".tex", latex_of(named));
  write(stem + ".csv", to_csv(named.table));
  write(stem + ".json", rows_to_json_text(named.table));
}

/// Appends numbers to the names of figures that have equal names, because names of data that differ only in
/// punctuation have the same stem.
void name_figures_apart(ReportDocument& document) {
  std::set<std::string> names;
  const auto rename = [&](std::vector<Figure>& figures) {
    for (Figure& figure : figures) {
      const std::string stem = figure.name;
      for (int i = 2; !names.insert(figure.name).second; ++i) figure.name = fmt::format("{}-{}", stem, i);
    }
  };
  for (ReportSection& section : document.sections) rename(section.figures);
}

}  // namespace

std::string report_page(ReportDocument document, int jobs) {
  name_figures_apart(document);
  check_names(document);
  return page_html(document, Page::report, draw_svg(figures_of(document), jobs));
}

void make_report_folder(ReportDocument& document, const ReportFolderOptions& options,
                        const FileWriter& write) {
  name_figures_apart(document);
  check_names(document);
  for (const ReportSection& section : document.sections) {
    for (const NamedTable& table : section.tables) write_table_files(table, write);
    for (const Picture& picture : section.pictures) write("pictures/" + picture.name + ".png", picture.png);
  }
  if (!options.draw_figures) return;
  const OutputFiles drawn = draw(figures_of(document), options.jobs, options.quiet);
  write("report.html", page_html(document, Page::report, drawn));
  if (std::ranges::any_of(document.sections, &ReportSection::is_detail))
    write("details.html", page_html(document, Page::details, drawn));
  write("report.md", to_markdown(document));
  for (const auto& [name, bytes] : drawn) write("figures/" + name, bytes);
}

OutputFiles report_folder(ReportDocument document, const ReportFolderOptions& options) {
  OutputFiles files;
  make_report_folder(document, options,
                     [&](const std::string& name, const std::string& bytes) { files[name] = bytes; });
  return files;
}

}  // namespace sextant

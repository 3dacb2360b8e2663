#include "sextant/eval/report/paper/paper_layout.h"

#include <algorithm>
#include <numeric>

#include "sextant/eval/report/document.h"
#include "sextant/eval/report/latex.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

using Line = std::vector<std::string>;

constexpr size_t terminal_columns = 100;
constexpr size_t column_characters = 56;  // at 7 pt in one column of a paper

bool is_best(const LayoutCell& cell) { return !cell.empty() && cell.front().best; }
bool is_best_published(const LayoutCell& cell) { return !cell.empty() && cell.front().best_published; }

size_t n_labels(const PaperLayout& layout) { return layout.versions.front().rows.front().labels.size(); }

/// Lines of the header with one text per column; the text of a group is in its first column.
std::vector<Line> header_lines(const PaperLayout& layout) {
  std::vector<Line> lines;
  for (const auto& groups : layout.header) {
    Line& line = lines.emplace_back();
    for (const HeaderGroup& group : groups) {
      line.push_back(group.text);
      line.resize(line.size() + group.span - 1);
    }
  }
  return lines;
}

/// Returns the labels of a row; the first is empty if the row above has the same first label.
Line labels_of(const LayoutRow& row, const LayoutRow* above) {
  Line labels = row.labels;
  if (labels.size() > 1 && above != nullptr && above->labels.front() == labels.front())
    labels.front().clear();
  return labels;
}

std::vector<LayoutRow> shown_rows(const LayoutVersion& version, bool all) {
  std::vector<LayoutRow> rows;
  for (const LayoutRow& row : version.rows)
    if (all || row.in_terminal) rows.push_back(row);
  return rows;
}

/// Title, version and cells as lines with one text per column; an empty line is a rule.
std::vector<Line> body_lines(const std::vector<LayoutRow>& rows, bool one_line) {
  std::vector<Line> lines;
  for (size_t i = 0; i < rows.size(); ++i) {
    const LayoutRow& row = rows[i];
    if (i > 0 && row.is_added && !rows[i - 1].is_added) lines.emplace_back();
    Line line = labels_of(row, i > 0 ? &rows[i - 1] : nullptr), second(line.size());
    bool any_published = false;
    for (const LayoutCell& cell : row.cells) {
      const std::string published = cell_published(row, cell);
      any_published |= !published.empty();
      const std::string measured = cell_measured(row, cell);
      line.push_back(one_line && !published.empty() ? measured + published : measured);
      second.push_back(published.empty() ? "" : published.substr(1, published.size() - 2));
    }
    const size_t unit = line[row.labels.size() - 1].find(" (");
    if (!one_line && any_published && unit != std::string::npos) {  // the unit is moved to the second line
      std::string& label = line[row.labels.size() - 1];
      second[row.labels.size() - 1] = label.substr(unit + 1);
      label.resize(unit);
    }
    lines.push_back(std::move(line));
    if (!one_line && any_published) lines.push_back(std::move(second));
  }
  return lines;
}

std::vector<size_t> widths_of(const std::vector<Line>& header, const std::vector<Line>& body) {
  std::vector<size_t> widths;
  for (const auto* lines : {&header, &body}) {
    for (const Line& line : *lines) {
      widths.resize(std::max(widths.size(), line.size()));
      for (size_t j = 0; j < line.size(); ++j) widths[j] = std::max(widths[j], width_of(line[j]));
    }
  }
  return widths;
}

size_t total(const std::vector<size_t>& widths) {
  return std::accumulate(widths.begin(), widths.end(), 2 * (widths.size() - 1));
}

std::string text_of(const PaperLayout& layout, const LayoutVersion& version, bool all) {
  const std::vector<LayoutRow> rows = shown_rows(version, all);
  const std::vector<Line> header = header_lines(layout);
  std::vector<Line> body = body_lines(rows, true);
  if (total(widths_of(header, body)) > terminal_columns) body = body_lines(rows, false);
  const std::vector<size_t> widths = widths_of(header, body);
  const char* gap = total(widths) > terminal_columns ? " " : "  ";
  const std::string rule(std::min(total(widths), terminal_columns), '-');
  std::string text;
  const auto add = [&](const Line& line) {
    if (line.empty()) return void(text += rule + "\n");
    std::string shown;
    for (size_t j = 0; j < line.size(); ++j) {
      const Align align = j < n_labels(layout) ? Align::left : Align::right;
      shown += (j > 0 ? gap : "") + padded(line[j], widths[j], align);
    }
    text += shown.substr(0, shown.find_last_not_of(' ') + 1) + "\n";
  };
  for (const Line& line : header) add(line);
  text += rule + "\n";
  for (const Line& line : body) add(line);
  for (const std::string& note : all ? layout.notes_of(version) : version.notes)
    text += wrapped(note, terminal_columns, "  ") + "\n";
  return text;
}

std::string heading(const PaperLayout& layout) {
  return fmt::format("Table {}: {}", layout.number, layout.title);
}

std::string emphasised(const std::string& text, bool best, const char* begin, const char* end) {
  return best && !text.empty() ? begin + text + end : text;
}

// ---- LaTeX

/// latex_escaped() with the signs of the verdicts, which need the package amssymb.
std::string latex_text(const std::string& text) {
  static constexpr LatexSign signs[] = {
      {"\u2713", "$\\checkmark$"}, {"\u2717", "$\\times$"}, {"\u2260", "$\\neq$"}};
  return latex_escaped(text, signs);
}

std::string latex_header(const PaperLayout& layout) {
  std::string text;
  for (const auto& groups : layout.header) {
    if (!text.empty()) text += "\\midrule\n";
    std::string line;
    for (const HeaderGroup& group : groups) {
      if (&group != &groups.front()) line += " & ";
      line += group.span > 1
                  ? fmt::format("\\multicolumn{{{}}}{{c}}{{{}}}", group.span, latex_text(group.text))
                  : latex_text(group.text);
    }
    text += line + " \\\\\n";
  }
  return text;
}

/// Number of printed lines of rows[i] and the rows after it with the same first label.
size_t lines_of_label(const std::vector<LayoutRow>& rows, size_t i) {
  size_t n = 0;
  for (size_t k = i; k < rows.size() && rows[k].labels.front() == rows[i].labels.front(); ++k)
    n += std::ranges::any_of(rows[k].cells,
                             [&](const LayoutCell& c) { return !cell_published(rows[k], c).empty(); })
             ? 2
             : 1;
  return n;
}

std::string latex_rows(const std::vector<LayoutRow>& rows) {
  std::string text;
  for (size_t i = 0; i < rows.size(); ++i) {
    const LayoutRow& row = rows[i];
    if (i > 0 && row.is_added && !rows[i - 1].is_added) text += "\\midrule\n";
    const Line labels = labels_of(row, i > 0 ? &rows[i - 1] : nullptr);
    std::string ours, published;
    bool two = false;
    for (const LayoutCell& cell : row.cells) {
      const std::string value = latex_text(cell_measured(row, cell));
      const std::string below = latex_text(cell_published(row, cell));
      ours += " & " + emphasised(value, is_best(cell), "\\textbf{", "}");
      published += " & " + emphasised(emphasised(below, is_best_published(cell), "\\textbf{", "}"), true,
                                      "{\\tiny\\color{gray}", "}");
      two |= !below.empty();
    }
    std::string line, second;
    for (size_t k = 0; k < labels.size(); ++k) {
      const size_t span = k + 1 < labels.size() ? lines_of_label(rows, i) : two ? 2 : 1;
      line += k > 0 ? " & " : "";
      second += k > 0 ? " & " : "";
      if (labels[k].empty()) continue;
      line += span > 1 ? fmt::format("\\multirow{{{}}}{{*}}{{{}}}", span, latex_text(labels[k]))
                       : latex_text(labels[k]);
    }
    text += line + ours + " \\\\\n";
    if (two) text += second + published + " \\\\\n";
  }
  return text;
}

// ---- CSV and JSON

/// One number with its position in the table.
struct FlatValue {
  const LayoutVersion* version;
  const LayoutRow* row;
  std::string column;
  const LayoutValue* value;
};

const Fields<FlatValue>& value_fields() {
  using V = FlatValue;
  const auto text = [](std::string LayoutValue::*member) {
    return [member](const V& v) { return (v.value->*member).empty() ? Cell() : Cell(v.value->*member); };
  };
  static const Fields<V> fields = [&] {
    Fields<V> f = {{Column::text("published"), [](const V& v) { return v.value->published; }}};
    Fields<Measured> m = {{Column::text("measured"), &Measured::value}};
    m.add_range({Column::text("low"), Column::text("high")}, &Measured::interval);
    m.add_range({Column::text("run_low"), Column::text("run_high")}, &Measured::one_run);
    m.add({{Column::text("pairs"), &Measured::n_pairs}, {Column::text("seeds"), &Measured::n_seeds}});
    f.add(m, [](const V& v) { return v.value->measured; });
    f.add({{Column::text("verdict"), text(&LayoutValue::verdict)},
           {Column::text("reason"), text(&LayoutValue::reason)},
           {Column::text("rate"), [](const V& v) { return v.value->rate; }},
           {Column::text("published_rate"), [](const V& v) { return v.value->published_rate; }},
           {Column::text("rate_of"), text(&LayoutValue::rate_of)},
           {Column::text("factor"), [](const V& v) { return v.value->factor; }},
           {Column::text("estimator"), text(&LayoutValue::estimator)},
           {Column::text("data"), text(&LayoutValue::data)},
           {Column::text("records"), text(&LayoutValue::records)}});
    return f;
  }();
  return fields;
}

Json json_of(const FlatValue& value) {
  return rows_to_json(table_of("", "", value_fields(), std::vector{value})).front();
}

Json json_of(const PaperLayout& layout, const LayoutVersion& version) {
  Json rows = Json::object();
  for (const LayoutRow& row : version.rows) {
    for (size_t j = 0; j < row.cells.size(); ++j) {
      const LayoutCell& cell = row.cells[j];
      if (cell.empty()) continue;
      Json& place = rows[row.name][layout.columns[j]];
      if (cell.size() == 1) place = json_of({&version, &row, layout.columns[j], &cell.front()});
      for (const LayoutValue& value : cell)
        if (cell.size() > 1) place[value.name] = json_of({&version, &row, layout.columns[j], &value});
    }
  }
  return {{"procedure", version.procedure},
          {"data", version.data},
          {"rows", rows},
          {"notes", layout.notes_of(version)}};
}

}  // namespace

std::string text_legend() {
  return "In () or beneath: the paper. \u2713 within, \u2717 outside single runs; \u2260 not comparable; ? "
         "open; \u2013 missing\n";
}

std::string to_text(const PaperLayout& layout, bool all) {
  std::string text;
  for (const LayoutVersion& version : layout.versions) {
    const bool is_first = &version == &layout.versions.front();
    const std::string begin = is_first ? heading(layout) + " " : "\n";
    text += wrapped(begin + layout.sentence(version), terminal_columns, "  ") + "\n";
    text += text_of(layout, version, all);
    if (!all) break;
  }
  return all ? text + "\n" + text_legend() : text;
}

std::string to_markdown(const PaperLayout& layout) {
  std::string text = fmt::format("### {}\n", markdown_text(heading(layout)));
  for (const LayoutVersion& version : layout.versions) {
    text += "\n" + markdown_text(layout.sentence(version) + " In parentheses: the paper.") + "\n\n";
    const std::vector<Line> header = header_lines(layout);
    const auto add = [&](const Line& line) {
      text += "|";
      for (const std::string& cell : line) text += " " + cell + " |";
      text += "\n";
    };
    const auto escaped = [](Line line) {
      for (std::string& cell : line) cell = markdown_text(cell);
      return line;
    };
    add(escaped(header.front()));
    Line marks(header.front().size(), "---:");
    std::fill_n(marks.begin(), n_labels(layout), ":---");
    add(marks);
    for (size_t i = 1; i < header.size(); ++i) add(escaped(header[i]));
    for (size_t i = 0; i < version.rows.size(); ++i) {
      const LayoutRow& row = version.rows[i];
      Line line = escaped(labels_of(row, i > 0 ? &version.rows[i - 1] : nullptr));
      for (const LayoutCell& cell : row.cells) {
        const std::string ours =
            emphasised(markdown_text(cell_measured(row, cell)), is_best(cell), "**", "**");
        const std::string published =
            emphasised(markdown_text(cell_published(row, cell)), is_best_published(cell), "**", "**");
        line.push_back(ours + (published.empty() ? "" : "<br>" + published));
      }
      add(line);
    }
    for (const std::string& note : layout.notes_of(version)) text += "\n" + markdown_text(note) + "\n";
  }
  return text;
}

std::string to_latex(const PaperLayout& layout) {
  const LayoutVersion& version = layout.versions.front();
  const size_t n = n_labels(layout);
  const size_t width = total(widths_of(header_lines(layout), body_lines(version.rows, false)));
  const char* environment = width > column_characters ? "table*" : "table";
  std::string text =
      "\\documentclass[twocolumn]{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n"
      "\\usepackage[margin=18mm]{geometry}\n\\usepackage{booktabs, multirow, amsmath, amssymb, "
      "textcomp, xcolor}\n"
      "\\begin{document}\n% ---- from here to the next line of this kind: for a paper with the packages "
      "above\n";
  text += fmt::format(
      "\\begin{{{}}}[t]\n\\centering\n\\fontsize{{7}}{{8}}\\selectfont"
      "\\setlength{{\\tabcolsep}}{{3pt}}\n\\caption{{{}}}\n\\label{{tab:sextant_{}}}\n",
      environment, latex_text(layout.title + " " + layout.sentence(version) + " In parentheses: the paper."),
      layout.name);
  text += fmt::format("\\begin{{tabular}}{{{}{}}}\n\\toprule\n{}\\midrule\n", std::string(n, 'l'),
                      std::string(layout.columns.size(), 'c'), latex_header(layout));
  text += latex_rows(version.rows) + "\\bottomrule\n\\end{tabular}\n";
  for (const std::string& note : layout.notes_of(version))
    text += fmt::format("\\par\\smallskip\\raggedright\\tiny {}\n", latex_text(note));
  return text + fmt::format("\\end{{{}}}\n% ----\n\\end{{document}}\n", environment);
}

std::string to_csv(const PaperLayout& layout) {
  std::vector<FlatValue> values;
  for (const LayoutVersion& version : layout.versions) {
    for (const LayoutRow& row : version.rows) {
      for (size_t j = 0; j < row.cells.size(); ++j)
        for (const LayoutValue& value : row.cells[j])
          values.push_back({&version, &row, layout.columns[j], &value});
    }
  }
  Fields<FlatValue> fields = {
      {Column::text("procedure"), [](const FlatValue& v) { return v.version->procedure; }},
      {Column::text("version_data"), [](const FlatValue& v) { return v.version->data; }},
      {Column::text("row"), [](const FlatValue& v) { return v.row->name; }},
      {Column::text("column"), [](const FlatValue& v) { return v.column; }},
      {Column::text("name"), [](const FlatValue& v) { return v.value->name; }}};
  fields.add(value_fields());
  return to_csv(table_of(layout.title, "", fields, values));
}

Json to_json(const PaperLayout& layout) {
  Json json = json_of(layout, layout.versions.front());
  json["table"] = layout.number;
  json["title"] = layout.title;
  json["versions"] = Json::array();
  for (size_t i = 1; i < layout.versions.size(); ++i)
    json["versions"].push_back(json_of(layout, layout.versions[i]));
  return json;
}

}  // namespace sextant

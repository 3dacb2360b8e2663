#include "sextant/eval/report/html/html.h"

#include <set>

#include "sextant/eval/report/latex.h"

namespace sextant {
namespace {

/// A float for every part that pages for people have; the caption with the first, the notes with the last.
std::string latex_of(const NamedTable& named) {
  std::vector<Table> parts = parts_of(named);
  if (parts.empty()) parts.push_back(named.table);
  std::string text;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) parts[i].caption.clear();
    if (i + 1 < parts.size()) parts[i].notes.clear();
    text += to_latex(parts[i], i == 0 ? named.name : fmt::format("{}_{}", named.name, i + 1));
  }
  return text;
}

void add_table_files(const NamedTable& named, OutputFiles& files) {
  const std::string stem = "tables/" + named.name;
  files[stem + ".md"] = to_markdown(named.table);
  files[stem + ".tex"] = latex_of(named);
  files[stem + ".csv"] = to_csv(named.table);
  files[stem + ".json"] = json_text(rows_to_json(named.table));
}

/// Names of data that differ in signs alone are the same stem: figures after the first get a number.
ReportDocument with_distinct_figures(ReportDocument document) {
  std::set<std::string> names;
  const auto rename = [&](std::vector<Figure>& figures) {
    for (Figure& figure : figures) {
      const std::string stem = figure.name;
      for (int i = 2; !names.insert(figure.name).second; ++i) figure.name = fmt::format("{}-{}", stem, i);
    }
  };
  for (VerdictLine& line : document.verdicts) rename(line.figures);
  for (ReportSection& section : document.sections) rename(section.figures);
  return document;
}

}  // namespace

std::string report_page(const ReportDocument& given, int jobs) {
  const ReportDocument document = with_distinct_figures(given);
  check_names(document);
  return to_html(document, draw_svg(figures_of(document), jobs));
}

OutputFiles report_folder(const ReportDocument& given, const ReportFolderOptions& options) {
  const ReportDocument document = with_distinct_figures(given);
  check_names(document);
  OutputFiles files;
  for (const ReportSection& section : document.sections) {
    for (const NamedTable& table : section.tables) add_table_files(table, files);
    for (const Picture& picture : section.pictures) files["pictures/" + picture.name + ".png"] = picture.png;
  }
  if (!options.draw_figures) return files;
  OutputFiles drawn = draw(figures_of(document), options.jobs, options.quiet);
  files["report.html"] = to_html(document, drawn);
  files["report.md"] = to_markdown(document);
  for (auto& [name, bytes] : drawn) files["figures/" + name] = std::move(bytes);
  return files;
}

}  // namespace sextant

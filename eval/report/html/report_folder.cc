#include "sextant/eval/report/html/report_folder.h"

#include "sextant/eval/report/html/html.h"
#include "sextant/eval/report/latex.h"

namespace sextant {
namespace {

void add_table_files(const NamedTable& named, OutputFiles& files) {
  const std::string stem = "tables/" + named.name;
  files[stem + ".md"] = to_markdown(named.table);
  files[stem + ".tex"] = to_latex(named.table, named.name);
  files[stem + ".csv"] = to_csv(named.table);
  files[stem + ".json"] = rows_to_json(named.table).dump(2) + "\n";
}

}  // namespace

OutputFiles report_folder(const ReportDocument& document, const ReportFolderOptions& options) {
  check_names(document);
  OutputFiles files;
  std::vector<Figure> figures;
  for (const ReportSection& section : document.sections) {
    for (const NamedTable& table : section.tables) add_table_files(table, files);
    for (const Picture& picture : section.pictures) files["pictures/" + picture.name + ".png"] = picture.png;
    figures.insert(figures.end(), section.figures.begin(), section.figures.end());
  }
  if (!options.draw_figures) return files;
  OutputFiles drawn = draw(figures, options.jobs);
  files["report.html"] = to_html(document, drawn);
  files["report.md"] = to_markdown(document);
  for (auto& [name, bytes] : drawn) files["figures/" + name] = std::move(bytes);
  return files;
}

}  // namespace sextant

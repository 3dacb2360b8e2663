#pragma once

// A report as data, and its writers: report.md here, report.html in html/html.h, all files of a report folder
// in html/html.h. Same document, same bytes.
//
//   DIR/report.html, report.md
//   DIR/details.html                              where sections are details; report.md has all sections
//   DIR/tables/<name>.md .tex .csv .json
//   DIR/figures/<name>.svg .pdf .png .gp .csv     drawn by gnuplot
//   DIR/pictures/<name>.png                       overlays on images
//
// Names are stems of files and anchors of the page: letters, digits, '.', '-', '_', unique in the document.

#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/explorer.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// One line of the summary.
struct VerdictLine {
  std::string subject;   ///< what was judged: a statement, a table
  std::string verdict;   ///< in words: "reproduced", "outside", "not measured here"
  std::string evidence;  ///< one line
  std::string link;      ///< "#<name>" of a section or table, a path in the report folder, or empty
  std::string group{};   ///< lines of one group stand together below this heading; empty: below the summary's
  std::vector<Figure> figures{};  ///< the answer as a picture, beside the line
  Table cases{};                  ///< what the verdict is of, folded below the line on the page
};

/// How a verdict looks. Words decide, so that a table's cell and the summary cannot differ.
enum class Tone { agrees, differs, open };
/// "reproduced", "within", "passed", "ok", "improved": agrees. "not reproduced", "outside", "failed", "regressed", "invalid":
/// differs. Any other: open.
Tone tone_of(const std::string& verdict);
/// "12 reproduced, 3 not reproduced, 1 undecided": in order of first appearance.
std::string count_words(const std::vector<std::string>& words);
std::string count_verdicts(const std::vector<VerdictLine>& verdicts);
/// One verdict of several: theirs where all agree, else "partly"; "not measured here" of none.
std::string joint_verdict(const std::vector<std::string>& verdicts);

struct NamedTable {
  std::string name;
  Table table;
  /// Keys of columns: where one of them changes, a new part begins on pages for people (split_rows). Mark
  /// them `fold`, and each part says them once. Files hold the whole.
  std::vector<std::string> split_by{};
};

/// Its parts for people; the table itself where split_by is empty.
std::vector<Table> parts_of(const NamedTable& named);
/// Calls do_part(part) for these parts in turn, without a copy of a table that is not split.
template <typename DoPart>
void for_each_part(const NamedTable& named, const DoPart& do_part) {
  if (named.split_by.empty()) return do_part(named.table);
  for (const Table& part : parts_of(named)) do_part(part);
}

/// A drawing that is not made by gnuplot.
struct Picture {
  std::string name;
  std::string caption;
  std::string alt;     ///< what is to be seen, for those who cannot
  std::string png;     ///< bytes; of pages that stand for themselves JPEG too
  std::string link{};  ///< where the picture leads
  bool small = false;  ///< stands beside others
  std::string jpeg{};  ///< bytes for the page, smaller; empty: the page has `png` too
};

/// Markup that the program has made, all text in it escaped.
struct Fragment {
  std::string html, markdown;
  std::string style, script;  ///< of the page
};

struct ReportSection {
  std::string name;
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<NamedTable> tables;
  std::vector<Figure> figures;
  std::vector<Picture> pictures;
  std::vector<std::string> commands{};  ///< for a shell, one line each; below the paragraphs
  std::vector<Explorer> explorers{};    ///< above pictures and figures; report.html alone has them
  bool in_summary = false;              ///< the page has it folded below the summary's lines already
  bool is_detail = false;               ///< stands on details.html, beside the page
};

struct ReportDocument {
  std::string title;
  std::string abstract;  ///< one paragraph
  Fragment lead{};       ///< between the abstract and the summary
  std::vector<VerdictLine> verdicts;
  std::vector<ReportSection> sections;
  std::string details_abstract{};  ///< one paragraph, of details.html
  std::vector<std::pair<std::string, std::string>> provenance;
  std::string citation;  ///< BibTeX; see citation()
};

/// BibTeX of the paper whose experiments these are, and of this program.
std::string citation();

std::string to_markdown(const ReportDocument& document);

/// Those of the summary, then those of the sections.
std::vector<Figure> figures_of(const ReportDocument& document);

/// A text as one word of a shell's command line: as it is where nothing in it means anything there, else quoted.
std::string shell_word(const std::string& text);

/// Throws InternalError where two parts have one name, or a name cannot be a file's.
void check_names(const ReportDocument& document);

}  // namespace sextant

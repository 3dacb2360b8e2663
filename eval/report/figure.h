#pragma once

// One figure: data as CSV and a gnuplot script, drawn as SVG, PDF and PNG. The script is complete: with
// <name>.csv beside it, `gnuplot <name>.gp` draws the same three files again. Same figure, same bytes (the
// PDF's date is fixed).
//
//   colours  Okabe and Ito's set, which colour-blind readers can tell apart; each line also has its own point
//   size     in cm as printed; text 8 pt, readable at one column's width (8.8 cm)

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/records/output.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct Figure {
  std::string name;     ///< stem of the files: letters, digits, '.', '-', '_'; no '.' or '-' first
  std::string caption;  ///< one paragraph, for the report
  Table data;           ///< becomes <name>.csv, texts as gp_cell()
  std::string script;   ///< gnuplot commands; `data` is the CSV's name, `column("key")` works
  double width_cm = 8.8;
  double height_cm = 6.6;
};

/// "s18/clone" -> "s18-clone": text as part of a file name.
std::string file_stem(const std::string& text);

/// "#0072B2" ...: colour of the i-th line. Repeats after 7.
std::string line_colour(size_t i);
/// Filled gnuplot point type of the i-th line, and its open twin.
int filled_point(size_t i);
int open_point(size_t i);

/// A text, whosever it is, as a gnuplot string: on one line, in single quotes, where nothing is a command;
/// its own are apostrophes (U+2019). Where it is shown `noenhanced` belongs beside it, or '_' and '{' are
/// markup.
std::string gp_text(const std::string& text);
/// The same as the label of a tic, in which gnuplot takes '%' for a format.
std::string gp_tic(const std::string& label);
/// A text as it stands in a figure's CSV, and what strcol() there is compared with: gnuplot knows no quotes
/// within quotes, so ',' is ';' and quotes are apostrophes.
std::string gp_cell(const std::string& text);

/// The box of a sample: quartiles and median, whiskers at 5 and 95 %. Columns q05, q25, median, q75, q95 of a
/// figure's data, and what draws them behind `plot`, without titles; `x` as gnuplot has it.
Fields<std::vector<double>> box_fields();
std::vector<std::string> box_plots(const std::string& x, double width, const std::string& colour);

/// <name>.csv, .gp, .svg, .pdf, .png. Throws Error with gnuplot's own words when it refuses, one that names
/// the package when it is missing, and one when a picture is not whole because the disk is full.
OutputFiles draw(const Figure& figure);
/// All of them, on up to `jobs` threads.
OutputFiles draw(const std::vector<Figure>& figures, int jobs, bool quiet = true);
/// The same without PDF and PNG, a third of the work: for pages that stand for themselves.
OutputFiles draw_svg(const std::vector<Figure>& figures, int jobs);

// ---- The only place that runs gnuplot: no shell, no settings of the user, and the same time zone and
// language everywhere, so that a script draws the same bytes on every machine.

/// Runs `script`, a file in `folder`, there. Throws Error with gnuplot's own words when it refuses, and one
/// that says what to install when there is no gnuplot. That gnuplot is content says nothing about a full
/// disk.
void run_gnuplot(const std::string& script, const std::filesystem::path& folder);

}  // namespace sextant

#pragma once

// A figure: data as CSV and a gnuplot script, drawn as SVG, PDF and PNG. The script is complete: with
// <name>.csv beside it, `gnuplot <name>.gp` draws the same three files again. The same figure gives the same
// bytes (the date in the PDF is fixed).
//
//   colours  Okabe and Ito's set, distinguishable with colour vision deficiencies; each line also has its own
//            point
//   size     in cm as printed; text 8 pt, readable at one column's width (8.8 cm)

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/records/output.h"
#include "sextant/eval/report/table.h"

namespace sextant {

struct Figure {
  std::string name;     ///< stem of the files: letters, digits, '.', '-', '_'; no '.' or '-' first
  std::string caption;  ///< one paragraph, for the report
  Table data;           ///< written as <name>.csv, with texts as gp_cell()
  std::string script;   ///< gnuplot commands; `data` is the CSV's name, `column("key")` works
  double width_cm = 8.8;
  double height_cm = 6.6;
};

/// Makes the data of a figure: columns with these keys, to which the caller adds rows.
Table figure_data(const std::vector<std::string>& keys);

/// Converts a text to a part of a file name: "s18/clone" -> "s18-clone".
std::string file_stem(const std::string& text);

/// Returns the colour of the i-th line: "#000000", "#0072B2", ...; repeats after 7.
std::string line_colour(size_t i);
/// Return gnuplot's filled point type of the i-th line, and the open type of the same shape; both repeat
/// after 5.
int filled_point(size_t i);
int open_point(size_t i);

/// Quotes an untrusted text as a gnuplot string: on one line in single quotes, where nothing is a command;
/// single quotes in it become apostrophes (U+2019). Use `noenhanced` where it is shown, otherwise '_' and '{'
/// are markup.
std::string gp_text(const std::string& text);
/// Quotes the label of a tic like gp_text(), and doubles '%', which gnuplot would interpret as a format.
std::string gp_tic(const std::string& label);
/// Returns the list of tics at 0, 1, 2, .. with these labels: "'a' 0, 'b' 1".
std::string gp_tics(const std::vector<std::string>& labels);
/// Converts a text for a figure's CSV: ',' becomes ';' and quotes become apostrophes, because gnuplot
/// supports no quotes within quotes. A script that compares with strcol() must use the converted text.
std::string gp_cell(const std::string& text);

/// Box plot of a sample: quartiles and median, whiskers at 5 and 95 %. box_fields() returns the columns q05,
/// q25, median, q75, q95. box_plots() returns the arguments of gnuplot's `plot` that draw these columns,
/// without titles, at the gnuplot expression `x`; values below `least` are drawn there, for logarithmic axes.
Fields<std::vector<double>> box_fields();
std::vector<std::string> box_plots(const std::string& x, double width, const std::string& colour,
                                   std::optional<double> least = {});
/// Returns the gnuplot expression of a column whose numbers below `least` are replaced by it.
std::string column_from(const std::string& key, std::optional<double> least);

/// Draws <name>.csv, .gp, .svg, .pdf and .png. Throws Error with gnuplot's message if it fails, an Error that
/// names the package if gnuplot is missing, and an Error if a picture is incomplete because the disk is full.
OutputFiles draw(const Figure& figure);
/// Draws all figures on up to `jobs` threads.
OutputFiles draw(const std::vector<Figure>& figures, int jobs, bool quiet = true);
/// Draws only SVG, which takes a third of the time; for self-contained pages.
OutputFiles draw_svg(const std::vector<Figure>& figures, int jobs);

}  // namespace sextant

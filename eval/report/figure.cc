#include "sextant/eval/report/figure.h"

#include <fcntl.h>
#include <gnuplot-iostream.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr const char* style = R"(set encoding utf8
set datafile separator comma
set datafile columnheaders
set datafile commentschars ""
set border 3 linecolor rgb "#404040"
set tics nomirror out scale 0.5
set grid ytics linecolor rgb "#E0E0E0" linewidth 0.5
set key top left reverse Left samplen 1.5 spacing 1.1 noenhanced
)";

/// Returns a script that draws the figure as SVG and, unless `svg_alone`, as PDF and PNG.
std::string complete_script(const Figure& figure, bool svg_alone) {
  const std::string size_cm = fmt::format("{:g}cm,{:g}cm", figure.width_cm, figure.height_cm);
  const auto pixels = [](double cm, double dpi) { return static_cast<int>(cm / 2.54 * dpi); };
  std::string script = fmt::format("# gnuplot {0}.gp draws {0}.svg, {0}.pdf and {0}.png from {0}.csv\n{1}",
                                   figure.name, style);
  script += fmt::format("data = '{}.csv'\n", figure.name);
  // A point of pngcairo's text is 96/72 pixels, so 300 dpi need a factor of 300/96 = 3.125 for texts of 7 pt.
  const std::array<std::pair<const char*, std::string>, 3> terminals = {{
      {"svg", fmt::format("svg size {},{} font \"DejaVu Sans,11\" linewidth 1.2",
                          pixels(figure.width_cm, 127), pixels(figure.height_cm, 127))},
      {"pdf", fmt::format("pdfcairo size {} font \"DejaVu Sans,7\" linewidth 1", size_cm)},
      {"png",
       fmt::format("pngcairo size {},{} font \"DejaVu Sans,7\" fontscale 3.125 linewidth 3 pointscale 3",
                   pixels(figure.width_cm, 300), pixels(figure.height_cm, 300))},
  }};
  for (const auto& [extension, terminal] : terminals) {
    if (svg_alone && std::string_view(extension) != "svg") continue;
    script += fmt::format("\nset terminal {}\nset output '{}.{}'\n{}", terminal, figure.name, extension,
                          figure.script);
    script += "unset output\n";
  }
  return script;
}

/// Replaces the date that Cairo writes into a PDF by a fixed one.
std::string without_date(std::string pdf) {
  const std::string key = "/CreationDate (D:";
  for (size_t at = pdf.find(key); at != std::string::npos; at = pdf.find(key, at + 1)) {
    constexpr std::string_view fixed = "20200101000000";
    if (at + key.size() + fixed.size() < pdf.size()) pdf.replace(at + key.size(), fixed.size(), fixed);
  }
  return pdf;
}

constexpr const char* apostrophe = "\u2019";

/// Returns the text on one line, with a blank in "]]>": gnuplot does not escape its '>' in an SVG, which
/// would be invalid XML.
std::string label_text(const std::string& text) { return replaced(one_line(text), "]]>", "]] >"); }

std::string figure_csv(Table data) {
  for (std::vector<Cell>& row : data.rows) {
    for (Cell& cell : row) {
      if (const std::string* text = cell.text()) cell = gp_cell(*text);
    }
  }
  return to_csv(data);
}

/// Endings of complete pictures; they are checked because gnuplot does not report failed writes.
constexpr std::array<std::pair<const char*, std::string_view>, 3> endings = {
    {{".svg", "</svg>"}, {".pdf", "%%EOF"}, {".png", "IEND\xae\x42\x60\x82"}}};

constexpr std::array<std::pair<const char*, double>, 5> box_quantiles = {
    {{"q05", 0.05}, {"q25", 0.25}, {"median", 0.5}, {"q75", 0.75}, {"q95", 0.95}}};

bool ends_with(std::string_view bytes, std::string_view end) {
  while (!bytes.empty() && bytes.back() == '\n') bytes.remove_suffix(1);
  return bytes.ends_with(end);
}

/// Keeps letters, digits, '.' and '_', and replaces sequences of other characters by '-'.
std::string plain_stem(const std::string& text) {
  std::string stem;
  for (const char c : text) {
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_';
    if (plain) stem.push_back(c);
    if (!plain && !stem.empty() && stem.back() != '-') stem.push_back('-');
  }
  while (!stem.empty() && stem.back() == '-') stem.pop_back();
  return stem;
}

}  // namespace

Table figure_data(const std::vector<std::string>& keys) {
  Table data{""};
  for (const std::string& key : keys) data.columns.push_back(Column::text(key));
  return data;
}

std::string file_stem(const std::string& text) {
  const std::string stem = plain_stem(text);
  if (stem.empty()) return "figure";
  constexpr size_t longest = 48, digits = 8;  // several stems form a file name, which may have 255 bytes
  if (stem.size() <= longest) return stem;
  std::string kept = stem.substr(0, longest - 1 - digits);
  while (kept.back() == '-') kept.pop_back();
  return kept + "-" + sha256(text).substr(0, digits);
}

std::string line_colour(size_t i) {
  constexpr std::array<const char*, 7> okabe_ito = {"#000000", "#0072B2", "#D55E00", "#009E73",
                                                    "#CC79A7", "#E69F00", "#56B4E9"};
  return okabe_ito[i % okabe_ito.size()];
}

int filled_point(size_t i) {
  constexpr std::array<int, 5> types = {7, 5, 9, 13, 11};
  return types[i % types.size()];
}

int open_point(size_t i) { return filled_point(i) - 1; }

// A doubled quote, which gnuplot's manual recommends, still ends the string at its beginning or beside
// another quote, so quotes become apostrophes.
std::string gp_text(const std::string& text) {
  return "'" + replaced(label_text(text), "'", apostrophe) + "'";
}

std::string gp_tic(const std::string& label) { return replaced(gp_text(label), "%", "%%"); }

std::string gp_cell(const std::string& text) {
  std::string cell =
      replaced(replaced(replaced(label_text(text), ",", ";"), "\"", apostrophe), "'", apostrophe);
  const size_t first = cell.find_first_not_of(' ');  // gnuplot skips leading blanks
  return first == std::string::npos ? "" : cell.substr(first, cell.find_last_not_of(' ') + 1 - first);
}

std::string gp_tics(const std::vector<std::string>& labels) {
  std::string tics;
  for (size_t i = 0; i < labels.size(); ++i)
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", gp_tic(labels[i]), i);
  return tics;
}

Fields<std::vector<double>> box_fields() {
  Fields<std::vector<double>> fields;
  for (const auto& [key, p] : box_quantiles)
    fields.add(Column::text(key), [p = p](const std::vector<double>& values) { return quantile(values, p); });
  return fields;
}

std::vector<std::string> box_plots(const std::string& x, double width, const std::string& colour,
                                   std::optional<double> least) {
  const auto at = [&](const char* key) { return column_from(key, least); };
  return {fmt::format("data using {}:{}:{}:{}:{}:({}) with candlesticks lc rgb \"{}\" lw 1 fs transparent "
                      "solid 0.35",
                      x, at("q25"), at("q05"), at("q95"), at("q75"), width, colour),
          fmt::format("data using {0}:{1}:{1}:{1}:{1}:({2}) with candlesticks lc rgb \"#000000\" lw 1.5", x,
                      at("median"), width)};
}

std::string column_from(const std::string& key, std::optional<double> least) {
  if (!least) return fmt::format("(column(\"{}\"))", key);
  return fmt::format("(column(\"{0}\") < {1:.6g} ? {1:.6g} : column(\"{0}\"))", key, *least);
}

namespace {

// The only place that runs gnuplot: without a shell and without the user's settings, with a fixed time zone
// and language, so that a script draws the same bytes on every machine.

constexpr const char* log_name = "gnuplot.log";

/// Returns the environment for gnuplot: that of the process, but with fixed values, or none, of the variables
/// that influence the bytes of a figure.
std::vector<std::string> environment() {
  std::vector<std::string> settings = {"TZ=UTC0", "LC_ALL=C.UTF-8", "SOURCE_DATE_EPOCH=1577836800"};
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const bool decides = text.starts_with("GNUPLOT_") || text.starts_with("GNUTERM=") ||
                         text.starts_with("LANGUAGE=") ||
                         std::ranges::any_of(settings, [&](const std::string& setting) {
                           return text.starts_with(setting.substr(0, setting.find('=') + 1));
                         });
    if (!decides) settings.emplace_back(text);
  }
  return settings;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

/// Returns the read end of a pipe that contains the command for gnuplot to load the script. The command is
/// written before gnuplot starts, so a gnuplot that ends early cannot break the pipe. gnuplot is not started
/// by gnuplot-iostream, which would use a shell.
int commands(const std::string& script) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail("cannot start gnuplot: {}", std::strerror(errno));
  gnuplotio::Gnuplot gnuplot(::fdopen(ends[1], "w"));
  gnuplot << "load '" << script << "'\n";
  return ends[0];
}

pid_t start(const std::string& script, const std::filesystem::path& folder) {
  std::vector<std::string> words = {"gnuplot", "--default-settings", "-"};
  const Descriptor input(commands(script));
  std::vector<std::string> settings = environment();
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addchdir_np(&files, folder.c_str());
  posix_spawn_file_actions_adddup2(&files, input.get(), 0);
  posix_spawn_file_actions_addopen(&files, 1, log_name, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t id = -1;
  const int error =
      posix_spawnp(&id, "gnuplot", &files, nullptr, pointers(words).data(), pointers(settings).data());
  posix_spawn_file_actions_destroy(&files);
  if (error == ENOENT)
    fail("gnuplot is not installed: figures need it (Debian package gnuplot-nox; scripts/setup installs it)");
  if (error != 0) fail("cannot start gnuplot in {}: {}", folder.string(), std::strerror(error));
  return id;
}

/// Runs the file `script` in `folder`. Throws Error with gnuplot's message if it fails, and an Error that
/// names the package if gnuplot is missing. gnuplot does not report a full disk; callers must check the
/// files.
void run_gnuplot(const std::string& script, const std::filesystem::path& folder) {
  const pid_t id = start(script, folder);
  int status = 0;
  while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  check_interrupt();  // gnuplot receives Ctrl-C as well
  if (WIFSIGNALED(status)) fail("gnuplot was ended by signal {} while it drew {}", WTERMSIG(status), script);
  std::string words = one_line(read_file(folder / log_name));
  words = words.substr(0, 400);  // gnuplot repeats long lines to mark an error in them
  words.erase(words.find_last_not_of(' ') + 1);
  fail("gnuplot refused {}: {}", script, words);
}

OutputFiles drawn(const Figure& figure, bool svg_alone) {
  // gnuplot would execute data "< cmd" and output "| cmd", so names must be plain.
  SEXTANT_CHECK(!figure.name.empty() && plain_stem(figure.name) == figure.name &&
                figure.name.front() != '.' && figure.name.front() != '-');
  const ScratchFolder scratch("sextant-figure-");
  const std::string script = figure.name + ".gp";
  OutputFiles files = {{figure.name + ".csv", figure_csv(figure.data)},
                       {script, complete_script(figure, svg_alone)}};
  for (const auto& [name, bytes] : files) write_file(scratch.path() / name, bytes);
  run_gnuplot(script, scratch.path());
  for (const auto& [extension, end] : endings) {
    if (svg_alone && std::string_view(extension) != ".svg") continue;
    const fs::path picture = scratch.path() / (figure.name + extension);
    files[figure.name + extension] = fs::exists(picture) ? read_file(picture) : "";
    if (!ends_with(files[figure.name + extension], end)) {
      fail(
          "gnuplot wrote only a part of {}{}: is the disk of {} full? Free some space, or choose another "
          "folder with TMPDIR",
          figure.name, extension, scratch.path().parent_path().string());
    }
  }
  if (!svg_alone) files[figure.name + ".pdf"] = without_date(std::move(files[figure.name + ".pdf"]));
  return files;
}

OutputFiles all_drawn(const std::vector<Figure>& figures, int jobs, bool svg_alone, bool quiet) {
  Progress progress("figures", static_cast<int>(figures.size()), quiet);
  std::vector<OutputFiles> each(figures.size());
  parallel_for(static_cast<int>(figures.size()), jobs, [&](int i) {
    each[static_cast<size_t>(i)] = drawn(figures[static_cast<size_t>(i)], svg_alone);
    progress.advance();
  });
  OutputFiles all;
  for (OutputFiles& files : each) all.merge(files);
  return all;
}

}  // namespace

OutputFiles draw(const Figure& figure) { return drawn(figure, false); }
OutputFiles draw(const std::vector<Figure>& figures, int jobs, bool quiet) {
  return all_drawn(figures, jobs, false, quiet);
}
OutputFiles draw_svg(const std::vector<Figure>& figures, int jobs) {
  return all_drawn(figures, jobs, true, true);
}

}  // namespace sextant

#include "sextant/eval/report/figure.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <regex>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/parallel_for.h"
#include "sextant/eval/report/gnuplot.h"

namespace sextant {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with this object.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (fs::temp_directory_path() / "sextant-figure-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) fail("{}: cannot create a temporary folder", pattern);
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

constexpr const char* style = R"(set encoding utf8
set datafile separator comma
set datafile columnheaders
set border 3 linecolor rgb "#404040"
set tics nomirror out scale 0.5
set grid ytics linecolor rgb "#E0E0E0" linewidth 0.5
set key top left reverse Left samplen 1.5 spacing 1.1 noenhanced
)";

/// The figure three times over: gnuplot's terminals.
std::string complete_script(const Figure& figure) {
  const std::string size_cm = fmt::format("{:g}cm,{:g}cm", figure.width_cm, figure.height_cm);
  const auto pixels = [](double cm, double dpi) { return static_cast<int>(cm / 2.54 * dpi); };
  std::string script = fmt::format("# gnuplot {0}.gp draws {0}.svg, {0}.pdf and {0}.png from {0}.csv\n{1}",
                                   figure.name, style);
  script += fmt::format("data = \"{}.csv\"\n", figure.name);
  const std::array<std::pair<const char*, std::string>, 3> terminals = {{
      {"svg", fmt::format("svg size {},{} font \"DejaVu Sans,11\" linewidth 1.2",
                          pixels(figure.width_cm, 127), pixels(figure.height_cm, 127))},
      {"pdf", fmt::format("pdfcairo size {} font \"DejaVu Sans,7\" linewidth 1", size_cm)},
      {"png",
       fmt::format("pngcairo size {},{} font \"DejaVu Sans,7\" fontscale 4.17 linewidth 3 pointscale 3",
                   pixels(figure.width_cm, 300), pixels(figure.height_cm, 300))},
  }};
  for (const auto& [extension, terminal] : terminals) {
    script += fmt::format("\nset terminal {}\nset output \"{}.{}\"\n{}", terminal, figure.name, extension,
                          figure.script);
    script += "unset output\n";
  }
  return script;
}

/// Cairo writes the time of day into a PDF.
std::string without_date(std::string pdf) {
  const std::string key = "/CreationDate (D:";
  for (size_t at = pdf.find(key); at != std::string::npos; at = pdf.find(key, at + 1)) {
    constexpr std::string_view fixed = "20200101000000";
    if (at + key.size() + fixed.size() < pdf.size()) pdf.replace(at + key.size(), fixed.size(), fixed);
  }
  return pdf;
}

}  // namespace

std::string file_stem(const std::string& text) {
  std::string stem;
  for (const char c : text) {
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_';
    if (plain) stem.push_back(c);
    if (!plain && !stem.empty() && stem.back() != '-') stem.push_back('-');
  }
  while (!stem.empty() && stem.back() == '-') stem.pop_back();
  return stem.empty() ? "figure" : stem;
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

std::string gp_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(c == '\n' ? ' ' : c);
  }
  return out + "\"";
}

OutputFiles draw(const Figure& figure) {
  SEXTANT_CHECK(file_stem(figure.name) == figure.name || figure.name.find('-') != std::string::npos);
  const ScratchFolder scratch;
  OutputFiles files = {{figure.name + ".csv", to_csv(figure.data)},
                       {figure.name + ".gp", complete_script(figure)}};
  for (const auto& [name, bytes] : files) write_file(scratch.path() / name, bytes);
  run_gnuplot(files.at(figure.name + ".gp"), scratch.path());
  for (const char* extension : {".svg", ".pdf", ".png"}) {
    files[figure.name + extension] = read_file(scratch.path() / (figure.name + extension));
  }
  files[figure.name + ".pdf"] = without_date(std::move(files[figure.name + ".pdf"]));
  return files;
}

OutputFiles draw(const std::vector<Figure>& figures, int jobs) {
  std::vector<OutputFiles> drawn(figures.size());
  parallel_for(static_cast<int>(figures.size()), jobs,
               [&](int i) { drawn[static_cast<size_t>(i)] = draw(figures[static_cast<size_t>(i)]); });
  OutputFiles all;
  for (OutputFiles& files : drawn) all.merge(files);
  return all;
}

}  // namespace sextant

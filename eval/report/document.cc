#include "sextant/eval/report/document.h"

#include <algorithm>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {
namespace {

/// Escapes a text for the alternative text of a picture, which a bracket would end.
std::string alt_text(const std::string& text) {
  std::string out;
  for (const char c : markdown_text(text))
    out += c == '[' || c == ']' ? fmt::format("\\{}", c) : std::string(1, c);
  return out;
}

std::string figure_markdown(const Figure& figure) {
  return fmt::format("![{}](figures/{}.svg)\n\n*{}*\n\n", alt_text(figure.caption), figure.name,
                     markdown_text(figure.caption));
}

std::string verdicts_markdown(const std::vector<VerdictLine>& verdicts) {
  if (verdicts.empty()) return "";
  Table table{"Summary",
              count_verdicts(verdicts) + ".",
              {Column::text("subject"), Column::text("verdict"), Column::text("evidence")}};
  for (const VerdictLine& line : verdicts) {
    const bool linked = !line.link.empty();
    table.add_row({linked ? fmt::format("[{}]({})", line.subject, line.link) : line.subject, line.verdict,
                   line.evidence});
  }
  return to_markdown(table) + "\n";
}

void append_section(const ReportSection& section, std::string& text) {
  text += fmt::format("<a id=\"{}\"></a>\n\n## {}\n\n", section.name, markdown_text(section.heading));
  for (const std::string& paragraph : section.paragraphs) text += markdown_text(paragraph) + "\n\n";
  for (const std::string& command : section.commands) text += fmt::format("    {}\n\n", one_line(command));
  for (const Picture& picture : section.pictures) {
    text += fmt::format("![{}](pictures/{}.png)\n\n*{}*\n\n", alt_text(picture.alt), picture.name,
                        markdown_text(picture.caption));
  }
  for (const Figure& figure : section.figures) text += figure_markdown(figure);
  for (const NamedTable& named : section.tables) {
    // The title of a table is one level below that of its section.
    text += fmt::format("<a id=\"{}\"></a>\n\n{}", named.name, named.table.title.empty() ? "" : "#");
    text += to_markdown(named.table);
    text += "\n";
  }
}

}  // namespace

Tone tone_of(const std::string& verdict) {
  const auto is_one_of = [&](std::initializer_list<const char*> words) {
    return std::ranges::find(words, verdict) != words.end();
  };
  if (is_one_of({"reproduced", "within", "passed", "ok", "improved"})) return Tone::agrees;
  if (is_one_of({"not reproduced", "outside", "failed", "regressed", "invalid"})) return Tone::differs;
  return Tone::open;
}

std::string count_words(const std::vector<std::string>& words) {
  std::vector<std::pair<std::string, int>> counts;
  for (const std::string& word : words) {
    auto it = std::ranges::find(counts, word, &std::pair<std::string, int>::first);
    if (it == counts.end()) it = counts.insert(counts.end(), {word, 0});
    ++it->second;
  }
  std::string text;
  for (const auto& [word, count] : counts)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, word);
  return text;
}

std::string count_verdicts(const std::vector<VerdictLine>& verdicts) {
  std::vector<std::string> words;
  for (const VerdictLine& line : verdicts) words.push_back(line.verdict);
  return count_words(words);
}

std::string joint_verdict(const std::vector<std::string>& verdicts) {
  if (verdicts.empty()) return "not measured here";
  const bool agree = std::ranges::all_of(verdicts, [&](const auto& v) { return v == verdicts.front(); });
  return agree ? verdicts.front() : "partly";
}

std::string part_anchor(const std::string& table, size_t i) { return fmt::format("{}-{}", table, i + 1); }

std::string citation() {
  return fmt::format(
      "@inproceedings{{zhang2020robust,\n"
      "  author    = {{Zhang, Jun and Henein, Mina and Mahony, Robert and Ila, Viorela}},\n"
      "  title     = {{Robust Ego and Object 6-DoF Motion Estimation and Tracking}},\n"
      "  booktitle = {{IEEE/RSJ International Conference on Intelligent Robots and Systems (IROS)}},\n"
      "  year      = {{2020}}\n"
      "}}\n"
      "@software{{sextant,\n"
      "  title   = {{Sextant: evaluation of multi-body visual odometry}},\n"
      "  version = {{{}}},\n"
      "  note    = {{commit {}}}\n"
      "}}\n",
      version(), git_commit());
}

std::string to_markdown(const ReportDocument& document) {
  std::string text =
      fmt::format("# {}\n\n{}\n\n", markdown_text(document.title), markdown_text(document.abstract));
  text += document.lead.markdown + verdicts_markdown(document.verdicts);
  for (const ReportSection& section : document.sections) append_section(section, text);
  if (!document.provenance.empty()) text += "## Provenance\n\n";
  for (const auto& [key, value] : document.provenance)
    text += fmt::format("- **{}**: {}\n", markdown_text(key), markdown_text(value));
  if (!document.citation.empty())
    text += fmt::format("\n## How to cite\n\n```bibtex\n{}```\n", document.citation);
  return text;
}

std::vector<Figure> figures_of(const ReportDocument& document) {
  std::vector<Figure> figures;
  for (const ReportSection& section : document.sections)
    figures.insert(figures.end(), section.figures.begin(), section.figures.end());
  return figures;
}

std::string shell_word(const std::string& text) {
  const std::string plain = "_-./:@#=,+%";  // '#' begins a comment only at the beginning of a word
  const bool is_plain =
      !text.empty() && text.front() != '#' && text.front() != '=' && std::ranges::all_of(text, [&](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) != 0 || plain.find(c) != std::string::npos;
      });
  if (is_plain) return text;
  std::string word = "'";
  for (const char c : text) c == '\'' ? word += "'\\''" : word += c;
  return word + "'";
}

void check_names(const ReportDocument& document) {
  std::set<std::string> names;
  const auto check = [&](const std::string& name) {
    const bool plain = !name.empty() && std::ranges::all_of(name, [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' ||
             c == '-' || c == '_';
    });
    if (!plain || !names.insert(name).second) {
      throw InternalError(fmt::format("report: '{}' cannot be a name, or is used twice", name));
    }
  };
  for (const ReportSection& section : document.sections) {
    check(section.name);
    for (const NamedTable& table : section.tables) check(table.name);
    for (const Picture& picture : section.pictures) check(picture.name);
    for (const Explorer& explorer : section.explorers) check(explorer.name);
  }
  for (const Figure& figure : figures_of(document)) check(figure.name);
}

}  // namespace sextant

#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/check/check_source.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

constexpr size_t kPageWidth = 116;

std::string outcome(const SourceCheck& c) { return std::string(to_string(c.outcome)); }

std::string present(const SourceCheck& c) {
  std::string text = c.n_present ? std::to_string(*c.n_present) : "";
  if (c.n_expected) text += fmt::format("/{}", *c.n_expected);
  return text;
}

/// Cause first: what the reader needs; then the numbers behind it.
std::string remark(const SourceCheck& c) {
  if (c.cause.empty()) return c.message;
  return c.cause + (c.message.empty() ? "" : " (" + c.message + ")");
}

/// Broken at spaces, each further line indented below the text.
std::string wrapped(const std::string& label, const std::string& text) {
  std::string out = label;
  size_t column = label.size();
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(' ', begin), text.size());
    if (column + 1 + end - begin > kPageWidth && column > label.size()) {
      out += "\n" + std::string(label.size(), ' ');
      column = label.size();
    }
    out += " " + text.substr(begin, end - begin);
    column += 1 + end - begin;
    begin = end + 1;
  }
  return out;
}

/// The channels, poses and tracks; long messages go below the table.
Table content_table(const std::string& source, const SequenceInfo& info) {
  Table table;
  table.title = fmt::format("{}: frames {}-{}, {}x{} px, {} Hz", source, info.first_frame, info.last_frame,
                            info.width, info.height, info.rate_hz);
  table.columns = {{"outcome", "", Align::left},
                   {"check", "content", Align::left},
                   {"present", "present", Align::right},
                   {"size_px", "size [px]", Align::right},
                   {"valid_percent", "valid [%]", Align::right, 1},
                   {"min", "min", Align::right, 2},
                   {"median", "median", Align::right, 2},
                   {"max", "max", Align::right, 2},
                   {"unit", "unit", Align::left}};
  return table;
}

Table convention_table() {
  Table table;
  table.columns = {{"outcome", "", Align::left},     {"check", "convention", Align::left},
                   {"value", "value", Align::right}, {"limit", "limit", Align::right},
                   {"unit", "unit", Align::left},    {"n", "n", Align::right, 0},
                   {"counted", "of", Align::left}};
  return table;
}

std::string to_page(const std::string& source, const SequenceInfo& info,
                    const std::vector<SourceCheck>& checks) {
  Table content = content_table(source, info), conventions = convention_table();
  for (const SourceCheck& c : checks) {
    Table& table = c.convention ? conventions : content;
    if (!remark(c).empty())
      table.notes.push_back(wrapped(fmt::format("{:<7} {}:", outcome(c), c.name), remark(c)));
    if (c.convention) {
      table.add_row({outcome(c), c.name, cell(c.value), cell(c.limit), c.unit,
                     c.n ? Cell(static_cast<double>(*c.n)) : Cell(), c.counted});
    } else if (c.outcome != CheckOutcome::note || c.n_present) {
      table.add_row({outcome(c), c.name, present(c), c.size_px,
                     c.valid_share ? Cell(*c.valid_share * 100) : Cell(), cell(c.min), cell(c.median),
                     cell(c.max), c.min ? c.unit : ""});
    }
  }
  return to_text(content) + "\n" + to_text(conventions);
}

Json to_json(const SourceCheck& c) {
  Json json{{"check", c.name}, {"outcome", outcome(c)}};
  const auto put = [&](const char* key, const auto& value) {
    if (value) json[key] = *value;
  };
  put("value", c.value);
  put("limit", c.limit);
  if (!c.unit.empty() && (c.value || c.min)) json["unit"] = c.unit;
  put("n", c.n);
  if (!c.counted.empty()) json["counted"] = c.counted;
  put("present", c.n_present);
  put("expected", c.n_expected);
  if (!c.size_px.empty()) json["size_px"] = c.size_px;
  if (c.valid_share) json["valid_percent"] = *c.valid_share * 100;
  put("min", c.min);
  put("median", c.median);
  put("max", c.max);
  json["cause"] = c.cause;
  json["message"] = c.message;
  return json;
}

void check(const std::string& source, const CommonFlags& flags, bool quick) {
  SourceSpec spec = find_source(source, flags.data_root);
  const Json options = options_tree(flags.options, flags.sets);
  for (const auto& item : options.items()) {
    if (item.key() != "source") fail("unknown option key '{}': known: source", item.key());
  }
  spec.add_options(options.value("source", Json::object()));
  const std::unique_ptr<Sequence> sequence = open_source(spec);
  const std::vector<SourceCheck> checks =
      check_source(*sequence, {.jobs = flags.jobs, .quiet = flags.quiet, .quick = quick});
  const auto n_with = [&](CheckOutcome outcome) {
    return std::ranges::count(checks, outcome, &SourceCheck::outcome);
  };
  const auto n_failed = n_with(CheckOutcome::fail);
  if (flags.json) {
    Json json{{"source", source}, {"failed", n_failed}, {"suspect", n_with(CheckOutcome::suspect)}};
    json["checks"] = Json::array();
    for (const SourceCheck& c : checks) json["checks"].push_back(to_json(c));
    fmt::print("{}", json_text(json));
  } else if (!flags.quiet) {
    fmt::print("{}", to_page(source, sequence->info(), checks));
  }
  if (n_failed > 0) {
    std::fflush(stdout);
    const SourceCheck& first = *std::ranges::find(checks, CheckOutcome::fail, &SourceCheck::outcome);
    fail("{}: {} of {} checks failed; the first, {}: {}", source, n_failed, checks.size(), first.name,
         remark(first));
  }
}

}  // namespace

void add_data_check_command(CLI::App& data) {
  const auto flags = std::make_shared<CommonFlags>();
  const auto source = std::make_shared<std::string>();
  const auto quick = std::make_shared<bool>(false);
  CLI::App* command =
      data.add_subcommand("check", "Decode everything a source has; check that its parts fit together");
  command->add_option("source", *source, "adapter:path[#sequence][@first-last]")
      ->required()
      ->type_name("SOURCE");
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress and no table: only the exit code and errors");
  command->add_flag("--quick", *quick, "Decode only the 24 frames that the convention checks look at");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer(
      "PASS, SUSPECT or FAIL per line with the likely cause, note for what cannot be checked; exit code 2 "
      "when\n"
      "one fails. docs/data-check.md explains every line.\n"
      "Example:\n  sextant data check vdo:kitti_03_demo@0-19");
  command->callback([flags, source, quick] { check(*source, *flags, *quick); });
}

}  // namespace sextant

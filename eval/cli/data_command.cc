#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/check_source.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

Cell cell(const std::optional<double>& value) { return value ? Cell(*value) : Cell(); }

void list_adapters(bool as_json) {
  if (as_json) {
    Json json = Json::array();
    for (const Adapter& adapter : adapters()) {
      Json options = Json::array();
      for (const OptionHelp& option : adapter.options()) {
        options.push_back({{"key", "source." + option.key},
                           {"default", option.default_value},
                           {"unit", option.unit},
                           {"meaning", option.meaning}});
      }
      json.push_back({{"name", adapter.name},
                      {"description", adapter.description},
                      {"example", adapter.example},
                      {"options", options}});
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  Table table;
  table.columns = {{"adapter", "adapter", Align::left},
                   {"description", "description", Align::left},
                   {"example", "example", Align::left}};
  for (const Adapter& adapter : adapters())
    table.add_row({adapter.name, adapter.description, adapter.example});
  fmt::print("{}", to_text(table));
}

Table check_table(const std::string& source, const SequenceInfo& info,
                  const std::vector<SourceCheck>& checks) {
  Table table;
  table.title = fmt::format("{}: frames {}-{}, {}x{} px, {} Hz", source, info.first_frame, info.last_frame,
                            info.width, info.height, info.rate_hz);
  table.columns = {{"outcome", "", Align::left},
                   {"check", "check", Align::left},
                   {"present", "present", Align::right},
                   {"size_px", "size [px]", Align::right},
                   {"valid_percent", "valid [%]", Align::right, 1},
                   {"min", "min", Align::right, 2},
                   {"median", "median", Align::right, 2},
                   {"max", "max", Align::right, 2},
                   {"unit", "unit", Align::left},
                   {"message", "message", Align::left}};
  for (const SourceCheck& c : checks) {
    std::string present = c.n_present ? std::to_string(*c.n_present) : "";
    if (c.n_expected) present += fmt::format("/{}", *c.n_expected);
    table.add_row({std::string(to_string(c.outcome)), c.name, present, c.size_px,
                   c.valid_share ? Cell(*c.valid_share * 100) : Cell(), cell(c.min), cell(c.median),
                   cell(c.max), c.min ? c.unit : "", c.message});
  }
  return table;
}

void check(const std::string& source, const CommonFlags& flags) {
  const std::unique_ptr<Sequence> sequence = open_source(find_source(source, flags.data_root));
  const std::vector<SourceCheck> checks = check_source(*sequence, flags.jobs, flags.quiet);
  const Table table = check_table(source, sequence->info(), checks);
  const auto failed = [](const SourceCheck& c) { return c.outcome == CheckOutcome::fail; };
  const auto n_failed = std::count_if(checks.begin(), checks.end(), failed);
  if (flags.json) {
    Json json;
    json["source"] = source;
    json["failed"] = n_failed;
    json["checks"] = rows_to_json(table);
    fmt::print("{}\n", json.dump(2));
  } else if (!flags.quiet) {
    fmt::print("{}", to_text(table));
  }
  if (n_failed > 0) {
    std::fflush(stdout);
    fail("{}: {} of {} checks failed; the first: {}", source, n_failed, checks.size(),
         std::find_if(checks.begin(), checks.end(), failed)->message);
  }
}

}  // namespace

void add_data_command(CLI::App& app) {
  CLI::App* data =
      app.add_subcommand("data", "Data sets: what can be read, and whether a source is complete");
  data->require_subcommand(1);
  data->footer("Example:\n  sextant data check vdo:kitti_03_demo@0-19");

  const auto flags = std::make_shared<CommonFlags>();
  CLI::App* list = data->add_subcommand("list", "List the adapters");
  list->add_flag("--json", flags->json, "Print as JSON, with each adapter's options");
  list->footer("Example:\n  sextant data list");
  list->callback([flags] { list_adapters(flags->json); });

  const auto source = std::make_shared<std::string>();
  CLI::App* check_command = data->add_subcommand("check", "Decode everything a source has and report on it");
  check_command->add_option("source", *source, "adapter:path[#sequence][@first-last]")
      ->required()
      ->type_name("SOURCE");
  add_data_flag(*check_command, *flags);
  add_jobs_flag(*check_command, *flags);
  check_command->add_flag("--quiet", flags->quiet, "No progress and no table: only the exit code and errors");
  check_command->add_flag("--json", flags->json, "Print as JSON");
  check_command->footer(
      "PASS, WARN or FAIL per line; exit code 2 when one fails.\n"
      "Example:\n  sextant data check vdo:kitti_03_demo@0-19");
  check_command->callback([flags, source] { check(*source, *flags); });

  add_data_make_command(*data);
  add_data_pack_command(*data);
  add_data_strip_command(*data);
}

}  // namespace sextant

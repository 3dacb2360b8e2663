#include <memory>

#include "sextant/base/registry.h"
#include "sextant/estimator/registry.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/report/table.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

void add_rows(const std::vector<OptionHelp>& options, Table& table) {
  for (const OptionHelp& option : options) {
    table.add_row(
        {option.key, option.default_value, option.unit.empty() ? Cell() : Cell(option.unit), option.meaning});
  }
}

Table options_table(const std::string& estimator) {
  Table table;
  table.columns = {Column::text("key"),
                   Column::text("default"),
                   Column::text("unit"),
                   Column::text("meaning")};
  add_rows(run_options(estimator), table);
  add_rows(plan_options(), table);
  table.title = "Options of a run with " + estimator;
  table.notes = {"Also 'source.*': options of the data set's adapter, see `sextant data list --json`.",
                 "'noise.*' is also what --noise and plans take as JSON: {\"depth\": {\"delta_d_px\": 0.2}}."};
  return table;
}

}  // namespace

std::vector<OptionHelp> run_options(const std::string& estimator) {
  std::vector<OptionHelp> all;
  const auto add = [&](const std::vector<OptionHelp>& options) {
    all.insert(all.end(), options.begin(), options.end());
  };
  add(describe_options(ExtractionOptions{}, "extraction"));
  add(describe_options(PipelineOptions{}, "pipeline"));
  const std::vector<EstimatorEntry> known = all_estimators();
  add(find_entry(std::span<const EstimatorEntry>(known), estimator, "estimator").options());
  add(describe_noise_options());
  return all;
}

std::vector<OptionHelp> plan_options() {
  return {{"plan.keep", std::string(to_string(Plan().keep)), "",
           "what a sweep keeps of a case, a key of its plan: records, or summary (counts, sums, histograms)"}};
}

void add_options_command(CLI::App& app) {
  struct Flags {
    std::string estimator = RunConfig{}.estimator;
    bool json = false;
  };
  const auto flags = std::make_shared<Flags>();
  CLI::App* command =
      app.add_subcommand("options", "List estimators, and every option with default, unit and meaning");
  add_value(*command, "--estimator", flags->estimator, "NAME", "Whose options")->capture_default_str();
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer("Example:\n  sextant options --estimator motion_only");
  command->callback([flags] {
    const Table table = options_table(flags->estimator);
    if (flags->json) {
      Json json;
      json["estimators"] = Json::array();
      for (const EstimatorEntry& entry : all_estimators()) {
        json["estimators"].push_back({{"name", entry.name}, {"description", entry.description}});
      }
      json["estimator"] = flags->estimator;
      json["options"] = rows_to_json(table);
      fmt::print("{}", json_text(json));
    } else {
      fmt::print("Estimators\n{}\n{}", estimator_list(), to_text(table));
    }
  });
}

}  // namespace sextant

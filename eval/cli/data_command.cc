#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

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
    fmt::print("{}", json_text(json));
    return;
  }
  Table table;
  table.columns = {Column::text("adapter"), Column::text("description"), Column::text("example")};
  for (const Adapter& adapter : adapters())
    table.add_row({adapter.name, adapter.description, adapter.example});
  fmt::print("{}", to_text(table));
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

  add_data_check_command(*data);
  add_data_make_command(*data);
  add_data_pack_command(*data);
  add_data_strip_command(*data);
}

}  // namespace sextant

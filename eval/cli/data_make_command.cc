#include <memory>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/datasets/layout.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"

namespace sextant {
namespace {

struct MakeFlags : CommonFlags {
  std::string source;
  std::string layout;
  std::string out;
  std::string sequence;
};

/// --set source.* goes to the adapter, --set layout.* to the writer.
Json group(const Json& tree, const std::string& key) {
  for (const auto& item : tree.items()) {
    if (item.key() != "source" && item.key() != "layout") {
      fail("unknown option key '{}': known: source, layout", item.key());
    }
  }
  return tree.value(key, Json::object());
}

void make(const MakeFlags& flags) {
  const Json options = options_tree(flags.options, flags.sets);
  const Layout& layout = find_layout(flags.layout);
  const bool is_scenario = flags.source.find(':') == std::string::npos;  // by its name alone
  SourceSpec source = find_source((is_scenario ? "synthetic:" : "") + flags.source, flags.data_root);
  source.add_options(group(options, "source"));
  const std::unique_ptr<Sequence> sequence = open_source(source);
  LayoutRequest request;
  request.out = flags.out;
  request.sequence = flags.sequence;
  request.options = group(options, "layout");
  request.jobs = flags.jobs;
  request.quiet = flags.quiet;
  request.between_frames = check_interrupt;
  const std::string written = layout.write(*sequence, request);
  if (flags.json) {
    fmt::print("{}", json_text(Json{{"source", written}, {"layout", layout.name}}));
  } else {
    fmt::print("Written: {}\n", written);
    if (!flags.quiet) fmt::print("Next: sextant data check {}\n", written);
  }
}

}  // namespace

void add_data_make_command(CLI::App& data) {
  const auto flags = std::make_shared<MakeFlags>();
  CLI::App* command = data.add_subcommand("make", "Write a scenario, or any source, in a data set's layout");
  add_value(*command, "source", flags->source, "SCENARIO",
            "A scenario (s18, city, ...) or adapter:path[#sequence][@first-last]")
      ->required();
  std::string names;
  std::string lines;
  for (const Layout& layout : layouts()) {
    names += (names.empty() ? "" : "|") + layout.name;
    lines += fmt::format("  {:<10} {}\n", layout.name, layout.description);
    for (const OptionHelp& option : layout.options()) {
      lines += fmt::format("    --set layout.{}={} [{}] {}\n", option.key, option.default_value, option.unit,
                           option.meaning);
    }
  }
  add_value(*command, "--layout", flags->layout, names, "Which data set's layout")->required();
  add_value(*command, "--out", flags->out, "DIR", "Root folder of the data set; made if it does not exist")
      ->required();
  add_value(*command, "--sequence", flags->sequence, "NAME", "The sequence's name there, e.g. 0018/clone");
  add_option_flags(*command, *flags);
  add_data_flag(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress; only the SOURCE that was written");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer(
      fmt::format("Layouts:\n{}Example:\n"
                  "  sextant data make s18 --layout vkitti1 --out D && sextant run vkitti1:D#0018/clone --out results",
                  lines));
  command->callback([flags] { make(*flags); });
}

}  // namespace sextant

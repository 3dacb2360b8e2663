#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/view/page.h"

namespace sextant {
namespace {

struct ViewFlags : CommonFlags {
  std::string first, second, images, out;
  CaseChoice choice;
  double level = 0;
  uint64_t seed = 0;
  PageOptions page;
};

void view(ViewFlags& flags, bool with_level, bool with_seed) {
  if (with_level) flags.choice.level = flags.level;
  if (with_seed) flags.choice.seed = flags.seed;
  flags.page.jobs = flags.jobs;
  flags.page.quiet = flags.quiet;
  const auto lock = lock_folder(flags.out.ends_with(".html") ? "" : flags.out);
  std::vector<ViewedRun> runs;
  for (const std::string& folder : {flags.first, flags.second}) {
    if (folder.empty()) continue;
    runs.push_back(flags.images.empty()
                       ? view_run(folder, flags.choice, flags.data_root, flags.jobs, flags.quiet)
                       : view_records(folder, flags.choice, find_source(flags.images, flags.data_root)));
    const ViewedRun& run = runs.back();
    for (const std::string& note : run.notes) {
      if (!flags.quiet) tell("warning", fmt::format("{}: {}", folder, note));
    }
    if (!flags.quiet && run.n_cases > 1)
      fmt::print("{}: shows {}, level {}, seed {} of {}, one of {} cases: --source, --estimator, --level, --seed choose\n",
                 folder, run.estimator, run.level, run.seed, run.source, run.n_cases);
  }
  const std::string page = write_view(flags.out, view_page(runs, flags.page));
  if (!flags.quiet) fmt::print("Open in a browser: {}\n", page);
}

}  // namespace

void add_view_command(CLI::App& app) {
  const auto flags = std::make_shared<ViewFlags>();
  CLI::App* command = app.add_subcommand("view", "Walk through one run, or two side by side, in a browser");
  add_value(*command, "RUN", flags->first, "DIR", "Folder of `sextant run`, `sweep` or `merge`")->required();
  add_value(*command, "RUN2", flags->second, "DIR", "Another one of the same source, to stand beside it");
  add_value(*command, "--out", flags->out, "DIR|FILE.html",
            "FILE.html (up to 50 MB), or a folder for index.html and, if larger, frames/")
      ->required();
  command->add_option("--source", flags->choice.source, "Which source of the folder; default: its first")->type_name("SOURCE");
  add_value(*command, "--estimator", flags->choice.estimator, "NAME",
            "Which estimator, by its label; default: the first");
  CLI::Option* level = command->add_option("--level", flags->level, "Which noise level; default: the first")->type_name("NUMBER")
                           ->check(finite_number());
  CLI::Option* seed = add_value(*command, "--seed", flags->seed, "N", "Which seed; default: the first");
  add_value(*command, "--images", flags->images, "SOURCE",
            "For folders of `evaluate objects`: the SOURCE that they are about");
  command->add_option("--quality", flags->page.jpeg_quality, "JPEG quality of the images")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  add_data_flag(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress and no output");
  command->footer(
      "Examples:\n  sextant run synthetic:city --out city && sextant view city --out city.html\n"
      "  sextant view joint_flow joint_flow_depth --out both.html      # two runs of one source\n"
      "  sextant view sweep --estimator joint_flow --level 0.2 --seed 3 --out case.html");
  command->callback([flags, level, seed] { view(*flags, level->count() > 0, seed->count() > 0); });
}

}  // namespace sextant

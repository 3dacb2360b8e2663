#include <CLI/CLI.hpp>

#include <memory>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/report/overlay.h"

namespace sextant {
namespace {

struct OverlayFlags : CommonFlags {
  std::string source;
  std::string estimator = RunConfig{}.estimator;
  std::string out;
  int frame = 0;
  int width_px = 0;
};

void draw(const OverlayFlags& flags) {
  SourceSpec spec = find_source(flags.source, flags.data_root);
  const std::unique_ptr<Sequence> sequence = open_source(spec);
  const SequenceInfo& info = sequence->info();
  if (flags.frame <= info.first_frame || flags.frame > info.last_frame) {
    fail("--frame {}: must be in {}-{}, the second to the last frame of {}", flags.frame,
         info.first_frame + 1, info.last_frame, flags.source);
  }
  if (!info.channels.rgb) fail("{}: has no colour images to draw on", flags.source);
  spec.first = info.first_frame;
  spec.last = flags.frame;

  std::optional<FrameResult> result;
  std::vector<Record> records;
  RunConfig config;
  config.sources = {spec};
  config.estimator = flags.estimator;
  config.options = options_tree(flags.options, flags.sets);
  config.jobs = flags.jobs;
  config.quiet = flags.quiet;
  config.on_pair = [&](const FrameResult& pair, const std::vector<Record>& of_pair) {
    result = pair;
    records = of_pair;
  };
  run(config);
  Channels channels;
  channels.rgb = channels.mask = true;
  write_file(flags.out,
             draw_overlay(sequence->read(result->prev, channels), *result, records, flags.width_px));
  if (!flags.quiet) fmt::print("Picture: {}\n", flags.out);
}

}  // namespace

void add_overlay_command(CLI::App& app) {
  const auto flags = std::make_shared<OverlayFlags>();
  CLI::App* command =
      app.add_subcommand("overlay", "Draw one frame pair: features, flow, moving objects and their speeds");
  command->add_option("source", flags->source, "adapter:path[#sequence][@first-last]")
      ->required()
      ->type_name("SOURCE");
  command
      ->add_option("--frame", flags->frame, "Current frame of the pair; the pipeline runs from the first one")
      ->required()
      ->type_name("K");
  command->add_option("--out", flags->out, "PNG file")->required()->type_name("FILE.png");
  command->add_option("--width", flags->width_px, "Width of the picture in px; 0 = twice the image's")
      ->check(CLI::Range(0, 20000));
  command->add_option("--estimator", flags->estimator, "Which estimator")
      ->type_name("NAME")
      ->capture_default_str();
  add_option_flags(*command, *flags);
  add_jobs_flag(*command, *flags);
  add_data_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress and no output");
  command->footer("Example:\n  sextant overlay synthetic:s18 --frame 5 --out overlay.png");
  command->callback([flags] { draw(*flags); });
}

}  // namespace sextant

#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/pictures/strip.h"

namespace sextant {
namespace {

struct StripFlags : CommonFlags {
  std::string source;
  std::string out;
  int n_frames = 3;
  int tile_px = 414;
};

void draw(const StripFlags& flags) {
  SourceSpec spec = find_source(flags.source, flags.data_root);
  const Json options = options_tree(flags.options, flags.sets);
  for (const auto& item : options.items()) {
    if (item.key() != "source") fail("unknown option key '{}': known: source", item.key());
  }
  spec.add_options(options.value("source", Json::object()));
  const std::unique_ptr<Sequence> sequence = open_source(spec);
  const SequenceInfo& info = sequence->info();
  Channels channels;
  channels.rgb = info.channels.rgb;
  channels.gray = !info.channels.rgb && info.channels.gray;
  channels.depth = info.channels.depth;
  channels.flow = info.channels.flow;
  channels.mask = info.channels.mask;
  // Evenly spread; the last frame has no flow.
  const int last = std::max(info.first_frame, info.last_frame - 1);
  const int n = std::min(flags.n_frames, last - info.first_frame + 1);
  std::vector<Frame> frames;
  for (int i = 0; i < n; ++i) {
    const int step = n > 1 ? (last - info.first_frame) * i / (n - 1) : 0;
    frames.push_back(sequence->read(info.first_frame + step, channels));
  }
  write_file(flags.out, draw_strip(frames, flags.tile_px));
  if (!flags.quiet) fmt::print("Picture: {}\n", flags.out);
}

}  // namespace

void add_data_strip_command(CLI::App& data) {
  const auto flags = std::make_shared<StripFlags>();
  CLI::App* command =
      data.add_subcommand("strip", "Draw some frames of a source: image, depth, flow and masks");
  command->add_option("source", flags->source, "adapter:path[#sequence][@first-last]")
      ->required()
      ->type_name("SOURCE");
  command->add_option("--out", flags->out, "PNG file")->required()->type_name("FILE.png");
  command->add_option("--frames", flags->n_frames, "How many frames, evenly spread")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
  command->add_option("--tile", flags->tile_px, "Width of one tile in px")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  add_option_flags(*command, *flags);
  add_data_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No output");
  command->footer("Example:\n  sextant data strip synthetic:s18 --out s18.png");
  command->callback([flags] { draw(*flags); });
}

}  // namespace sextant

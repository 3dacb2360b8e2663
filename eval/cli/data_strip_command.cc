#include <memory>

#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/pictures/pictures.h"

namespace sextant {
namespace {

struct StripFlags : CommonFlags {
  std::string source;
  std::string out;
  int n_frames = 3;
  int tile_px = 414;
};

}  // namespace

void add_data_strip_command(CLI::App& data) {
  const auto flags = std::make_shared<StripFlags>();
  CLI::App* command =
      data.add_subcommand("strip", "Draw some frames of a source: image, depth, flow and masks");
  add_source_argument(*command, flags->source);
  add_value(*command, "--out", flags->out, "FILE.png", "PNG file")->required();
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
  command->callback([flags] {
    write_file(flags->out,
               draw_strip(*open_source(source_of(flags->source, *flags)), flags->n_frames, flags->tile_px));
    if (!flags->quiet) fmt::print("Picture: {}\n", flags->out);
  });
}

}  // namespace sextant

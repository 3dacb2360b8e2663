#include <filesystem>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/pictures/pictures.h"

namespace sextant {
namespace {

constexpr const char* default_picture = "overlay.png";

struct OverlayFlags : CommonFlags {
  std::string source;
  std::string out;
  ShowcaseRequest request;
};

void draw(OverlayFlags& flags) {
  ShowcaseRequest& request = flags.request;
  request.source = find_source(flags.source, flags.data_root);
  request.options = options_tree(flags.options, flags.sets);
  request.jobs = flags.jobs;
  request.quiet = flags.quiet;
  const bool named = !flags.out.empty();
  const std::string out = named ? flags.out : default_picture;
  if (!named && std::filesystem::exists(out)) fail("{}: is there already: give --out", out);
  write_file(out, make_showcase(request).overlay_png);
  if (!flags.quiet) fmt::print("Picture: {}\n", out);
}

}  // namespace

void add_overlay_command(CLI::App& app) {
  const auto flags = std::make_shared<OverlayFlags>();
  CLI::App* command =
      app.add_subcommand("overlay", "Draw one frame pair: features, flow, moving objects and their speeds");
  add_source_argument(*command, flags->source);
  add_value(*command, "--frame", flags->request.frame, "K",
            "Current frame of the pair; the pipeline runs from the first one. Default: the second frame");
  add_value(*command, "--out", flags->out, "FILE.png",
            fmt::format("PNG file. Default: {}, which is then never overwritten", default_picture));
  command->add_option("--width", flags->request.width_px, "Width of the picture in px; 0 = twice the image's")
      ->check(CLI::Range(0, 20000));
  add_value(*command, "--estimator", flags->request.estimator, "NAME", "Which estimator")
      ->capture_default_str();
  add_option_flags(*command, *flags);
  add_jobs_flag(*command, *flags);
  add_data_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress and no output");
  command->footer("Example:\n  sextant overlay synthetic:s18 --frame 5 --out overlay.png");
  command->callback([flags] { draw(*flags); });
}

}  // namespace sextant

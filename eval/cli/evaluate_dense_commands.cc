#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/evaluation/dense_files.h"

namespace sextant {
namespace {

template <Named Format>
struct DenseFlags : CommonFlags {
  DenseFiles<Format> files;
  double bf = 0;
};

void print(const Table& table, const CommonFlags& flags) {
  if (flags.json) {
    fmt::print("{}", json_text(Json({{"schema", 1}, {"rows", rows_to_json(table)}})));
  } else if (!flags.quiet) {
    fmt::print("{}", to_text(table));
  }
}

template <Named Format>
CLI::App* add_dense_command(CLI::App& evaluate, const char* name, const char* what,
                            const std::shared_ptr<DenseFlags<Format>>& flags) {
  CLI::App* command = evaluate.add_subcommand(name, what);
  DenseFiles<Format>& o = flags->files;
  command->add_option("EST", o.estimate, "Image, or folder of images")->required();
  command->add_option("GT", o.truth, "Truth: image, or folder with the same names")->required();
  add_choice(*command, "--est-format", o.estimate_format, "Of the estimate");
  add_choice(*command, "--gt-format", o.truth_format, "Of the truth");
  command->add_option("--mask", o.mask, "Label image (PNG) or folder of them: errors per label");
  command->add_option("--noc", o.visible_truth,
                      "Truth of the pixels visible in both images: errors inside and outside");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->add_flag("--quiet", flags->quiet, "Print nothing but errors");
  return command;
}

}  // namespace

void add_evaluate_flow_command(CLI::App& evaluate) {
  const auto flags = std::make_shared<DenseFlags<FlowFormat>>();
  CLI::App* command = add_dense_command(evaluate, "flow", "Optical flow of whole images", flags);
  command->footer(
      "Example:\n  sextant evaluate flow 000002_10.flo flow_occ/000002_10.png --gt-format kitti --noc "
      "flow_noc/000002_10.png");
  command->callback([flags] { print(evaluate_flow(flags->files), *flags); });
}

void add_evaluate_depth_command(CLI::App& evaluate) {
  const auto flags = std::make_shared<DenseFlags<DepthFormat>>();
  flags->files.estimate_format = flags->files.truth_format = DepthFormat::depth256;
  CLI::App* command = add_dense_command(evaluate, "depth", "Depth of whole images", flags);
  command->add_option("--bf", flags->bf, "Focal length times baseline, px m: for disparities and D1")
      ->check(finite_number(0));
  command->footer(
      "Example:\n  sextant evaluate depth sgbm/ disp_occ_0/ --est-format disparity256 --gt-format "
      "disparity256 --bf 387.57");
  command->callback([flags] { print(evaluate_depth(flags->files, flags->bf), *flags); });
}

}  // namespace sextant

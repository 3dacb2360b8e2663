#include <memory>

#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/profile/noise_profile.h"

namespace sextant {
namespace {

struct FitFlags : CommonFlags {
  std::string source, out, noise = "none", depth = "auto", figure;
  ProfileOptions profile;
};

void fit(FitFlags& flags) {
  ProfileOptions& options = flags.profile;
  options.noise = Noise::parse(flags.noise);
  if (flags.depth != "auto") options.depth = from_name<DepthReference>(flags.depth, "depth reference");
  options.jobs = flags.jobs;
  options.data_root = flags.data_root;
  const NoiseProfile profile =
      write_noise_profile(source_of(flags.source, flags), options, flags.out, flags.figure);
  if (flags.json) {
    fmt::print("{}", json_text(profile.json()));
  } else if (!flags.quiet) {
    fmt::print("{}\nnoise: {}\n", to_text(profile_table(profile)), profile.noise().dump());
  }
}

}  // namespace

void add_noise_command(CLI::App& app) {
  CLI::App* noise =
      app.add_subcommand("noise", "Measure the errors of real flow and depth, to inject noise like them");
  noise->require_subcommand(1);
  noise->footer("Example:\n  sextant noise fit vdo:kitti_03_demo@0-19 --out pwc_net_kitti03.json");

  const auto flags = std::make_shared<FitFlags>();
  CLI::App* command = noise->add_subcommand(
      "fit",
      "Measure size, tails and spatial correlation of a source's flow and depth errors; write a profile");
  add_source_argument(*command, flags->source);
  add_data_flag(*command, *flags);
  add_option_flags(*command, *flags);
  add_jobs_flag(*command, *flags);
  add_value(*command, "--out", flags->out, "FILE.json", "The profile, NAME.json")->required();
  add_value(*command, "--name", flags->profile.name, "NAME", "Name in the profile; default: NAME of --out");
  add_value(*command, "--noise", flags->noise, "JSON",
            "Noise that is added to the source first: none or JSON")
      ->capture_default_str();
  command->add_option("--seed", flags->profile.seed, "Seed of that noise")->capture_default_str();
  command
      ->add_option(
          "--depth-reference", flags->depth,
          "Reference for the disparities: auto (the data set's truth, else the next frame), next_frame, "
          "left_right (images of both cameras)")
      ->type_name("auto|next_frame|left_right")
      ->capture_default_str();
  command
      ->add_option("--max-frames", flags->profile.max_frames,
                   "Number of frames that are measured, evenly spread")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_value(*command, "--figure", flags->figure, "DIR",
            "Folder for the figure: measured and injected correlation");
  command->add_flag("--quiet", flags->quiet, "No table");
  command->add_flag("--json", flags->json, "Print the profile");
  command->footer(
      "docs/noise.md explains the numbers. `--noise '{\"profile\": \"NAME\", \"scale\": 1}'` injects a "
      "profile.\n"
      "Example:\n  sextant noise fit vdo:kitti_03_demo@0-19 --out pwc_net_kitti03.json");
  command->callback([flags] { fit(*flags); });
}

}  // namespace sextant

#include <CLI/CLI.hpp>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/datasets/layout.h"
#include "sextant/eval/check/check_report.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/pictures/pictures.h"
#include "sextant/eval/profile/noise_profile.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

void list_adapters(const CommonFlags& flags) {
  if (flags.json) {
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
    print_json(json);
    return;
  }
  Table table;
  table.columns = {Column::text("adapter"), Column::text("description"), Column::text("example")};
  for (const Adapter& adapter : adapters())
    table.add_row({adapter.name, adapter.description, adapter.example});
  fmt::print("{}", screen_text(table));
}

struct CheckFlags : CommonFlags {
  std::string source;
  bool quick = false;
};

void check(const CheckFlags& flags) {
  const std::unique_ptr<Sequence> sequence = open_source(source_of(flags.source, flags));
  const std::vector<SourceCheck> checks =
      check_source(*sequence, {.jobs = flags.jobs, .quiet = flags.quiet, .quick = flags.quick});
  if (flags.json) {
    print_json(check_json(flags.source, checks));
  } else if (!flags.quiet) {
    fmt::print("{}", check_page(flags.source, sequence->info(), checks));
  }
  std::fflush(stdout);
  refuse_failed(flags.source, checks);
}

void add_data_check_command(CLI::App& data) {
  auto [command, flags] = add_command<CheckFlags>(
      data, "check", "Decode all data of a source and check that they are consistent with each other", check);
  add_source_argument(command, flags.source);
  add_data_flag(command, flags);
  add_option_flags(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress and no table: only the exit code and errors");
  command.add_flag("--quick", flags.quick, "Decode only the 24 frames that the convention checks look at");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer(
      "PASS, SUSPECT or FAIL per line with the likely cause, note for what cannot be checked; "
      "exit code 2 when\n"
      "one fails. docs/datasets.md explains every line.\n"
      "Example:\n  sextant data check vdo:kitti_03_demo@0-19");
}

struct MakeFlags : CommonFlags {
  std::string source;
  std::string layout;
  std::string out;
  std::string sequence;
};

/// Selects the options of one group: --set source.* goes to the adapter, --set layout.* to the writer.
Json group(const Json& tree, const std::string& key) {
  for (const auto& item : tree.items()) {
    if (item.key() != "source" && item.key() != "layout") {
      fail("unknown option key '{}': expected keys that begin with source. or layout.", item.key());
    }
  }
  return tree.value(key, Json::object());
}

void make(const MakeFlags& flags) {
  const Json options = options_tree(flags.options, flags.sets);
  const Layout& layout = find_layout(flags.layout);
  const bool is_scenario =
      flags.source.find(':') == std::string::npos;  // a scenario is given by its name alone
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
    print_json(Json{{"source", written}, {"layout", layout.name}});
  } else {
    fmt::print("Written: {}\n", written);
    if (!flags.quiet) fmt::print("Next: sextant data check {}\n", written);
  }
}

void add_data_make_command(CLI::App& data) {
  auto [command, flags] =
      add_command<MakeFlags>(data, "make", "Write a scenario, or any source, in a data set's layout", make);
  add_value(command, "source", flags.source, "SCENARIO",
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
  add_value(command, "--layout", flags.layout, names, "Layout to write")->required();
  add_value(command, "--out", flags.out, "DIR", "Root folder of the data set; made if it does not exist")
      ->required();
  add_value(command, "--sequence", flags.sequence, "NAME", "Name of the written sequence, e.g. 0018/clone");
  add_option_flags(command, flags);
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress; only the SOURCE that was written");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer(fmt::format(
      "Layouts:\n{}Example:\n"
      "  sextant data make s18 --layout vkitti1 --out D && sextant run vkitti1:D#0018/clone --out results",
      lines));
}

struct StripFlags : CommonFlags {
  std::string source;
  std::string out;
  int n_frames = 3;
  int tile_px = 414;
};

void draw_frames(const StripFlags& flags) {
  write_file(flags.out,
             draw_strip(*open_source(source_of(flags.source, flags)), flags.n_frames, flags.tile_px));
  if (!flags.quiet) fmt::print("Picture: {}\n", flags.out);
}

void add_data_strip_command(CLI::App& data) {
  auto [command, flags] = add_command<StripFlags>(
      data, "strip", "Draw some frames of a source: image, depth, flow and masks", draw_frames);
  add_source_argument(command, flags.source);
  add_value(command, "--out", flags.out, "FILE.png", "PNG file")->required();
  command.add_option("--frames", flags.n_frames, "How many frames, evenly spread")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
  command.add_option("--tile", flags.tile_px, "Width of one tile in px")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  add_option_flags(command, flags);
  add_data_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No output");
  command.footer("Example:\n  sextant data strip synthetic:s18 --out s18.png");
}

struct CacheFlags : CommonFlags {
  std::string folder;
  std::string source;
  bool all = false;
};

double megabytes(uint64_t bytes) { return static_cast<double>(bytes) / 1e6; }

void list_packs(const CacheFlags& flags) {
  const PackCache cache = pack_cache(flags.folder);
  Table table;
  table.title = fmt::format("Correspondence caches in {}", cache.folder().string());
  table.columns = {Column::text("source"), Column::count("pairs"),
                   Column::number("megabytes", "size [MB]", 2), Column::text("state"), Column::text("file")};
  for (const PackCache::Entry& entry : cache.list()) {
    table.add_row({entry.source.empty() ? Cell() : Cell(entry.source), entry.n_pairs, megabytes(entry.bytes),
                   std::string(entry.valid ? "valid" : "outdated"), entry.file.filename().string()});
  }
  if (flags.json) {
    print_json(Json{{"folder", cache.folder().string()}, {"packs", rows_to_json(table)}});
  } else {
    fmt::print("{}", screen_text(table));
  }
}

void prune_packs(const CacheFlags& flags) {
  fmt::print("{:.2f} MB freed\n", megabytes(pack_cache(flags.folder).prune(flags.all)));
}

void pack(const CacheFlags& flags) {
  const PackCache::Packed packed =
      pack_source(pack_cache(flags.folder), find_source(flags.source, flags.data_root),
                  options_tree(flags.options, flags.sets), flags.jobs, flags.quiet);
  const double size = megabytes(std::filesystem::file_size(packed.file));
  if (flags.json) {
    print_json(Json{{"file", packed.file.string()},
                    {"pairs", packed.pairs.size()},
                    {"megabytes", size},
                    {"was_there", packed.was_there}});
    return;
  }
  fmt::print("{}: {} pairs, {:.2f} MB{}\n", packed.file.string(), packed.pairs.size(), size,
             packed.was_there ? ", was there" : "");
}

void add_data_pack_command(CLI::App& data) {
  auto [command, flags] = add_command<CacheFlags>(
      data, "pack", "Decode a source into the correspondence cache that sweeps run from", pack);
  add_source_argument(command, flags.source);
  add_cache_flag(command, flags.folder);
  add_option_flags(command, flags);
  add_data_flag(command, flags);
  add_jobs_flag(command, flags);
  command.add_flag("--quiet", flags.quiet, "No progress");
  command.add_flag("--json", flags.json, "Print as JSON");
  command.footer("Example:\n  sextant data pack synthetic:s18");
}

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
  const SourceSpec source = source_of(flags.source, flags);
  const NoiseProfile profile = write_noise_profile(source, options, flags.out, flags.figure);
  if (!flags.quiet) {  // a mistake such as backward flow would be measured as noise
    for (const std::string& warning : profile.warnings()) print_message("warning", warning);
    for (const std::string& failure : failures_of(source, flags.jobs))
      print_message("warning", failure + "; the profile may describe this mistake instead of noise");
  }
  if (flags.json) {
    print_json(profile.json());
  } else if (!flags.quiet) {
    fmt::print("{}\nnoise: {}\n", screen_text(profile_table(profile)), profile.noise().dump());
  }
}

}  // namespace

void add_data_command(CLI::App& app) {
  CLI::App* data =
      app.add_subcommand("data", "Data sets: what can be read, and whether a source is complete");
  data->require_subcommand(1);
  data->footer("Example:\n  sextant data check vdo:kitti_03_demo@0-19");

  auto [list, flags] = add_command<CommonFlags>(*data, "list", "List the adapters", list_adapters);
  list.add_flag("--json", flags.json, "Print as JSON, with each adapter's options");
  list.footer("Example:\n  sextant data list");

  add_data_check_command(*data);
  add_data_make_command(*data);
  add_data_pack_command(*data);
  add_data_strip_command(*data);
}

void add_cache_command(CLI::App& app) {
  CLI::App* cache = app.add_subcommand("cache", "The correspondence caches that sweeps run from");
  cache->require_subcommand(1);
  cache->footer("Example:\n  sextant cache ls");
  auto [list, listed] = add_command<CacheFlags>(
      *cache, "ls", "List the caches, and whether their sources have changed since", list_packs);
  add_cache_flag(list, listed.folder);
  list.add_flag("--json", listed.json, "Print as JSON");
  list.footer("Example:\n  sextant cache ls");
  auto [prune, pruned] = add_command<CacheFlags>(
      *cache, "prune", "Remove caches that are outdated, damaged or incomplete", prune_packs);
  add_cache_flag(prune, pruned.folder);
  prune.add_flag("--all", pruned.all, "Remove all of them");
  prune.footer("Example:\n  sextant cache prune --all");
}

void add_noise_command(CLI::App& app) {
  CLI::App* noise =
      app.add_subcommand("noise", "Measure the errors of real flow and depth, to inject noise like them");
  noise->require_subcommand(1);
  noise->footer("Example:\n  sextant noise fit vdo:kitti_03_demo@0-19 --out pwc_net_kitti03.json");

  auto [command, flags] = add_command<FitFlags>(
      *noise, "fit",
      "Measure size, tails and spatial correlation of a source's flow and depth errors; write a profile",
      fit);
  add_source_argument(command, flags.source);
  add_data_flag(command, flags);
  add_option_flags(command, flags);
  add_jobs_flag(command, flags);
  add_value(command, "--out", flags.out, "FILE.json", "The profile, NAME.json")->required();
  add_value(command, "--name", flags.profile.name, "NAME", "Name in the profile; default: NAME of --out");
  add_value(command, "--noise", flags.noise, "JSON", "Noise that is added to the source first: none or JSON")
      ->capture_default_str();
  command.add_option("--seed", flags.profile.seed, "Seed of that noise")->capture_default_str();
  command
      .add_option(
          "--depth-reference", flags.depth,
          "Reference for the disparities: auto (the data set's truth, else the next frame), next_frame, "
          "left_right (images of both cameras)")
      ->type_name("auto|next_frame|left_right")
      ->capture_default_str();
  command
      .add_option("--max-frames", flags.profile.max_frames,
                  "Number of frames that are measured, evenly spread")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_value(command, "--figure", flags.figure, "DIR",
            "Folder for the figure: measured and injected correlation");
  command.add_flag("--quiet", flags.quiet, "No table");
  command.add_flag("--json", flags.json, "Print the profile");
  command.footer(
      "docs/noise.md explains the numbers. `--noise '{\"profile\": \"NAME\", \"scale\": 1}'` injects a "
      "profile.\n"
      "Example:\n  sextant noise fit vdo:kitti_03_demo@0-19 --out pwc_net_kitti03.json");
}

}  // namespace sextant

#include <CLI/CLI.hpp>

#include <memory>

#include "sextant/base/error.h"
#include "sextant/eval/cli/command.h"
#include "sextant/eval/cli/flags.h"
#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/report/table.h"

namespace sextant {
namespace {

struct CacheFlags : CommonFlags {
  std::string folder;
  std::string source;
  bool all = false;
};

double megabytes(uint64_t bytes) { return static_cast<double>(bytes) / 1e6; }

void list_packs(const CacheFlags& flags) {
  const PackCache cache = pack_cache(flags.folder);
  Table table;
  table.title = fmt::format("Packs in {}", cache.folder().string());
  table.columns = {Column::text("source"), Column::count("pairs"),
                   Column::number("megabytes", "size [MB]", 2), Column::text("state"), Column::text("file")};
  for (const PackCache::Entry& entry : cache.list()) {
    table.add_row({entry.source.empty() ? Cell() : Cell(entry.source), entry.n_pairs, megabytes(entry.bytes),
                   std::string(entry.valid ? "valid" : "outdated"), entry.file.filename().string()});
  }
  if (flags.json) {
    fmt::print("{}", json_text(Json{{"folder", cache.folder().string()}, {"packs", rows_to_json(table)}}));
  } else {
    fmt::print("{}", to_text(table));
  }
}

void pack(const CacheFlags& flags) {
  const PackCache::Packed packed =
      pack_source(pack_cache(flags.folder), find_source(flags.source, flags.data_root),
                  options_tree(flags.options, flags.sets), flags.jobs, flags.quiet);
  const double size = megabytes(std::filesystem::file_size(packed.file));
  if (flags.json) {
    fmt::print("{}", json_text(Json{{"file", packed.file.string()},
                                    {"pairs", packed.pairs.size()},
                                    {"megabytes", size},
                                    {"was_there", packed.was_there}}));
    return;
  }
  fmt::print("{}: {} pairs, {:.2f} MB{}\n", packed.file.string(), packed.pairs.size(), size,
             packed.was_there ? ", was there" : "");
}

}  // namespace

void add_cache_command(CLI::App& app) {
  const auto flags = std::make_shared<CacheFlags>();
  CLI::App* cache = app.add_subcommand("cache", "The decoded sources that sweeps run from");
  cache->require_subcommand(1);
  cache->footer("Example:\n  sextant cache ls");
  CLI::App* list = cache->add_subcommand("ls", "List them, and whether their sources are as they were");
  add_cache_flag(*list, flags->folder);
  list->add_flag("--json", flags->json, "Print as JSON");
  list->footer("Example:\n  sextant cache ls");
  list->callback([flags] { list_packs(*flags); });
  CLI::App* prune = cache->add_subcommand("prune", "Remove those that are outdated, damaged or half made");
  add_cache_flag(*prune, flags->folder);
  prune->add_flag("--all", flags->all, "Remove all of them");
  prune->footer("Example:\n  sextant cache prune --all");
  prune->callback([flags] {
    fmt::print("{:.2f} MB set free\n", megabytes(pack_cache(flags->folder).prune(flags->all)));
  });
}

void add_data_pack_command(CLI::App& data) {
  const auto flags = std::make_shared<CacheFlags>();
  CLI::App* command = data.add_subcommand("pack", "Decode a source once, for sweeps");
  add_source_argument(*command, flags->source);
  add_cache_flag(*command, flags->folder);
  add_option_flags(*command, *flags);
  add_data_flag(*command, *flags);
  add_jobs_flag(*command, *flags);
  command->add_flag("--quiet", flags->quiet, "No progress");
  command->add_flag("--json", flags->json, "Print as JSON");
  command->footer("Example:\n  sextant data pack synthetic:s18");
  command->callback([flags] { pack(*flags); });
}

}  // namespace sextant

#pragma once

// A folder of packs. A source is decoded once; afterwards its pairs come from the pack as long as neither its
// files nor the options that made it have changed.
//
//   <content>.pack   content = SHA-256 of the inputs' SHA-256s, the source's and extraction's options and the
//                    version: equal data have equal packs, wherever they lie
//   <request>.json   request = SHA-256 of the source (as an absolute path) and options -> content and the
//                    inputs (path, size, time of change, SHA-256). An input whose size and time are as before
//                    is taken to be the same; one whose time alone differs is hashed again
//
// Damaged, foreign or outdated files are made anew. Files are written whole or not at all, so several
// processes may share the folder. It belongs to one user: one of another user, or in which others may write,
// is refused (base/safe_paths.h), because results follow from what lies there. CACHEDIR.TAG marks it; only
// what has the names above is ever removed, and only where the mark is.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/experiment/pair_reader.h"

namespace sextant {

/// cache_root()/packs; a folder of the user in the system's temporary folder where there is no root.
std::filesystem::path default_cache_folder();

class PackCache {
 public:
  explicit PackCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Packed {
    std::vector<ExtractedPair> pairs;
    std::map<std::string, InputLog::Entry> inputs;  ///< every file that made them
    std::filesystem::path file;
    bool was_there = false;  ///< read from the pack, not decoded now
  };

  /// The pairs of a source, from its pack or by decoding (which writes the pack). Of `noise`, the mask models
  /// count: they decide which points there are, so each has packs of its own. Throws Error on bad inputs and
  /// when the folder cannot be written, Interrupted on Ctrl-C.
  Packed load(const SourceSpec& source, const Sequence& sequence, const ExtractionOptions& options,
              const Noise& noise, int jobs, bool quiet) const;

  struct Entry {
    std::string source;  ///< as given when it was made
    std::filesystem::path file;
    uint64_t bytes = 0;
    int n_pairs = 0;
    bool valid = false;  ///< readable, of this version, and its inputs are as they were
  };
  /// All packs, in order of source; those that no request leads to come last, without a source.
  std::vector<Entry> list() const;
  /// Removes packs that are no longer valid, or all of them, and what was left by processes that were killed
  /// while they made one. Returns the bytes set free. Throws Error when the folder is not marked as a cache.
  uint64_t prune(bool all) const;

  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// The packs in `folder`, or in default_cache_folder() where it is empty.
PackCache pack_cache(const std::string& folder);

/// The pack of `source` with the "source" and "extraction" of `options`, a tree as run_options.h has it.
PackCache::Packed pack_source(const PackCache& cache, SourceSpec source, const Json& options, int jobs,
                              bool quiet);

// ---- A pack holds the extracted pairs of one source: what sweeps run from instead of decoding images again.
//
//   "SEXTPACK" | u32 version | u64 size of the manifest | manifest (JSON) | u64 size of the pairs | pairs |
//   SHA-256 of all before, 64 hexadecimal digits
//
// Little-endian. Points are stored in single precision, which loses nothing: pixels are integers, depth and
// flow come from single-precision images; what does not fit is an internal error. A pack that was damaged
// fails its SHA-256.

/// Raised whenever extraction or this format changes: older packs are then made anew.
inline constexpr int pack_version = 1;

struct Pack {
  Json manifest;
  std::vector<ExtractedPair> pairs;
};

std::string encode_pack(const Pack& pack);
/// Throws Error that begins with `name` when the bytes are not a pack of this version, or damaged.
Pack decode_pack(std::string_view bytes, const std::string& name);

}  // namespace sextant

#pragma once

// Correspondence cache: a folder of files with the extracted pairs of sources. A source is decoded once;
// afterwards its pairs are read from the cache as long as neither its files nor its options have changed.
//
//   <content>.pack   content = SHA-256 of the inputs' SHA-256s, the options of source and extraction and the
//                    version: equal data share a file, wherever they are stored
//   <request>.json   request = SHA-256 of the source (as an absolute path) and options -> content and the
//                    inputs (path, size, modification time, SHA-256). An input with the same size and time is
//                    taken to be unchanged; one with another time is hashed again
//
// Damaged, foreign or outdated files are computed again. Files are written completely or not at all, so
// several processes may share the folder. The folder belongs to one user: a folder of another user, or in
// which others may write, is rejected (base/new_file.h), because results depend on its content. CACHEDIR.TAG
// marks it; only files with the names above are ever removed, and only if the mark exists.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/experiment/case_runner.h"

namespace sextant {

/// Returns cache_root()/packs; if there is no root, a folder of the user in the system's temporary folder.
std::filesystem::path default_cache_folder();

class PackCache {
 public:
  explicit PackCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Packed {
    std::vector<ExtractedPair> pairs;
    std::map<std::string, InputLog::Entry> inputs;  ///< every file from which they were made
    std::filesystem::path file;
    bool was_there = false;  ///< read from the cache, not decoded now
  };

  /// Returns the pairs of a source, from the cache or by decoding (which fills the cache). Of `noise`, only
  /// the mask models matter: they determine which points exist, so each has its own cache files. Throws Error
  /// on bad inputs and if the folder cannot be written, Interrupted on Ctrl-C.
  Packed load(const SourceSpec& source, const Sequence& sequence, const ExtractionOptions& options,
              const Noise& noise, int jobs, bool quiet) const;

  struct Entry {
    std::string source;  ///< as given when the file was made
    std::filesystem::path file;
    uint64_t bytes = 0;
    int n_pairs = 0;
    bool valid = false;  ///< readable, of this version, and with unchanged inputs
  };
  /// Returns all cache files in order of source; files to which no valid <request>.json refers come last,
  /// without a source.
  std::vector<Entry> list() const;
  /// Removes the files that are no longer valid or, with `all`, all files of the cache, and those left by
  /// processes that were killed. Returns the number of bytes freed. Throws Error if the folder is not marked
  /// as a cache, or belongs to another user.
  uint64_t prune(bool all) const;

  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// Returns the cache in `folder`, or in default_cache_folder() if `folder` is empty.
PackCache pack_cache(const std::string& folder);

/// Returns the pairs of `source`, from the cache or by decoding, with the groups "source" and "extraction" of
/// the option tree `options` (run.h).
PackCache::Packed pack_source(const PackCache& cache, SourceSpec source, const Json& options, int jobs,
                              bool quiet);

// ---- A cache file contains the extracted pairs of one source, from which sweeps run instead of
// decoding images again.
//
//   "SEXTPACK" | u32 version | u64 size of the manifest | manifest (JSON) | u64 size of the pairs | pairs |
//   SHA-256 of all preceding bytes, 64 hexadecimal digits
//
// Little-endian. Points are stored in single precision without loss: pixels are integers, and depth and flow
// come from single-precision images; a value that does not fit is an internal error. Damage is detected by
// the SHA-256.

/// Incremented whenever extraction or this format changes; older files are then computed again.
inline constexpr int pack_version = 1;

struct Pack {
  Json manifest;
  std::vector<ExtractedPair> pairs;
};

std::string encode_pack(const Pack& pack);
/// Decodes a cache file. Throws Error that begins with `name` if the bytes are not of this version, or
/// damaged.
Pack decode_pack(std::string_view bytes, const std::string& name);

}  // namespace sextant

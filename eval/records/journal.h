#pragma once

// Append-only journal of a sweep; see sweep.h. A case is recorded completely or not at all, and the checksum
// of its block includes sweep and case: a block of another sweep, or under another number, is invalid. Every
// block is synced before the next one begins: a power cut loses at most the last one.
//
// A block has an owner: the sweep, together with the version of the estimator that computed the case. A case
// has one possible owner for each known version of its estimator, the present version first; blocks of the
// other owners are stale (Block::version > 0).

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sextant/base/file_lock.h"
#include "sextant/base/json.h"
#include "sextant/base/new_file.h"

namespace sextant {

/// Returns {"case","records"} and, unless it is null, "noise": a line of cases.jsonl and of the header of a
/// block.
Json case_json(uint64_t number, uint64_t n_records, const Json& noise);

/// Returns true if a sweep has written all its results into `folder`, which happens before the journal is
/// removed.
bool is_finished_sweep(const std::filesystem::path& folder);

class Journal {
 public:
  struct Block {
    uint64_t n_records = 0;
    Json noise;         ///< noise added in the case, NoiseVerification::sums(); null without noise
    size_t offset = 0;  ///< offset of the content in the file: the records' lines, or a summary's bytes
    size_t bytes = 0;
    size_t version = 0;  ///< index of its owner among those of the case; 0: not stale
  };

  /// Returns true if `content` can be the content of the case.
  using Fits = std::function<bool(uint64_t number, std::string_view content)>;

  /// Returns the owners of a case, at least one; new blocks belong to the first.
  using Owners = std::function<std::vector<std::string>(uint64_t number)>;

  /// Opens or creates the journal. Finds the blocks up to the first one that is incomplete, damaged or of an
  /// unknown owner, and truncates the file there; blocks that do not fit are skipped. Throws Error if another
  /// process has the journal open, or if it cannot be written.
  Journal(std::filesystem::path path, Owners owners, const Fits& fits);
  /// Overload for a single owner of all cases.
  Journal(std::filesystem::path path, const std::string& owner, const Fits& fits)
      : Journal(
            std::move(path), [owner](uint64_t) { return std::vector{owner}; }, fits) {}
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Appends the records of one case. Safe to call from several threads. Throws Error if the block cannot be
  /// written, for example because the disk is full; the journal is then unchanged.
  void append(uint64_t number, uint64_t n_records, std::string_view lines, const Json& noise = {});
  /// Appends a case whose content does not consist of lines.
  void append_bytes(uint64_t number, std::string_view bytes);

  const std::map<uint64_t, Block>& blocks() const { return blocks_; }
  uint64_t bytes() const { return end_; }
  /// Removes all cases. Must not run concurrently with append().
  void clear();
  std::string content(const Block& block) const;

 private:
  void find_blocks(const Fits& fits);
  void append_block(uint64_t number, Json header, const Block& block, std::string_view content);
  static std::string sum(const std::string& owner, uint64_t number, const Json& noise,
                         std::string_view content);

  std::filesystem::path path_;
  Owners owners_;
  std::optional<FileLock> lock_;
  Descriptor file_;
  std::mutex mutex_;
  size_t end_ = 0;
  std::map<uint64_t, Block> blocks_;
};

}  // namespace sextant

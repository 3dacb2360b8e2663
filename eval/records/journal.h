#pragma once

// The append-only file of a sweep; see sweep.h. A case is in it as a whole or not at all, and the sum of its
// block is that of this sweep's case alone: a block of another sweep, or under another number, is none. Every
// block is durable before the next begins: a power cut costs the last one.
//
// A block stands under the name of its owner: the sweep, and with it the version of the estimator that made
// the case. The owners of a case are all that are known, its present one first; blocks of the others are
// stale and are found as such.

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

namespace sextant {

/// {"case","records"} and, unless it is null, "noise": a line of cases.jsonl, and of what precedes a block.
Json case_json(uint64_t number, uint64_t n_records, const Json& noise);

/// Whether a sweep has put all its results into `folder`: they are written before the journal is removed.
bool is_finished_sweep(const std::filesystem::path& folder);

class Journal {
 public:
  struct Block {
    uint64_t n_records = 0;
    Json noise;         ///< what was added in the case, NoiseVerification::sums(); null without noise
    size_t offset = 0;  ///< of the content in the file: the records' lines, or a summary's bytes
    size_t bytes = 0;
    size_t version = 0;  ///< place of its owner among those of the case; 0: not stale
  };

  /// Whether this can be the content of the case.
  using Fits = std::function<bool(uint64_t number, std::string_view content)>;

  /// The owners of a case, of which the first is that of blocks to come; at least one.
  using Owners = std::function<std::vector<std::string>(uint64_t number)>;

  /// Opens or creates; finds the whole blocks of known owners and cuts off what follows the last of
  /// them. Blocks that do not fit are passed over. Throws Error when another process has it open, or it
  /// cannot be written.
  Journal(std::filesystem::path path, Owners owners, const Fits& fits);
  /// All cases have one owner.
  Journal(std::filesystem::path path, const std::string& owner, const Fits& fits)
      : Journal(
            std::move(path), [owner](uint64_t) { return std::vector{owner}; }, fits) {}
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Appends the records of one case. Safe to call from several threads. Throws Error when the disk is full;
  /// the journal then is as before.
  void append(uint64_t number, uint64_t n_records, std::string_view lines, const Json& noise = {});
  /// The same of a case whose content is not lines.
  void append_bytes(uint64_t number, std::string_view bytes);

  const std::map<uint64_t, Block>& blocks() const { return blocks_; }
  uint64_t bytes() const { return end_; }
  /// Forgets all cases. Not beside an append() of another thread.
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
  int file_ = -1;
  std::mutex mutex_;
  size_t end_ = 0;
  std::map<uint64_t, Block> blocks_;
};

}  // namespace sextant

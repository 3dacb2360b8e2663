#pragma once

// Test helpers: a fixture for files in a data set's folder, and a sequence in memory.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sextant/base/testing.h"
#include "sextant/base/text.h"
#include "sextant/datasets/dataset.h"

namespace sextant {

inline std::unique_ptr<Sequence> open_with(const std::string& source, const Json& options = Json::object()) {
  SourceSpec spec = SourceSpec::parse(source);
  spec.options = options;
  return open_source(spec);
}

/// Opens a source without a cache, so that frames are rendered.
inline std::unique_ptr<Sequence> open_uncached(const std::string& source) {
  return open_with(source, {{"cache", ""}});
}

/// Returns "vdo tiny@0-4, 320x96 px, 10 Hz".
inline std::string text_of(const SequenceInfo& info) {
  return fmt::format("{} {}@{}-{}, {}x{} px, {} Hz", info.dataset, info.sequence, info.first_frame,
                     info.last_frame, info.width, info.height, info.rate_hz);
}

/// A sequence in memory whose members a test can change.
class MemorySequence : public Sequence {
 public:
  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  void check_files() const override {}

  SequenceInfo info_;    // NOLINT(misc-non-private-member-variables-in-classes)
  SequenceTruth truth_;  // NOLINT(misc-non-private-member-variables-in-classes)
};

class FolderTest : public testing::Test {
 protected:
  explicit FolderTest(const std::string& name = "D") : root_(temp_.path() / name) {}

  std::string file(const std::string& name) const { return (root_ / name).string(); }
  std::string text(const std::string& name) const { return read_file(root_ / name); }
  void put(const std::string& name, std::string_view bytes) {
    std::filesystem::create_directories((root_ / name).parent_path());
    write_file(root_ / name, bytes);
  }
  void remove(const std::string& name) { std::filesystem::remove_all(root_ / name); }
  /// Replaces the first occurrence of `from` in a file.
  void change(const std::string& name, const std::string& from, const std::string& to) {
    std::string bytes = text(name);
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << name << " lacks " << from;
    put(name, bytes.replace(at, from.size(), to));
  }
  /// Returns the lines of a file, including the header.
  std::vector<std::string> lines(const std::string& name) const {
    std::vector<std::string> all = split(text(name), '\n');
    all.pop_back();
    return all;
  }
  void put_lines(const std::string& name, const std::vector<std::string>& all) {
    std::string bytes;
    for (const std::string& line : all) bytes += line + "\n";
    put(name, bytes);
  }

  TempFolder temp_;
  std::filesystem::path root_;
};

}  // namespace sextant

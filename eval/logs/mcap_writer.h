#pragma once

// Writes an MCAP recording (version 0, https://mcap.dev/spec) of JSON messages.
//
// Messages are collected in uncompressed chunks of about 1 MB. Each chunk is followed by an index of its
// messages, so that viewers can seek without reading the whole file. The summary section at the end repeats
// schemas and channels, and contains the chunk indexes and the statistics. All sizes and times are
// little-endian; times are nanoseconds.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/base/new_file.h"

namespace sextant {

inline constexpr std::string_view mcap_magic = "\x89MCAP0\r\n";

/// The kind of a record, its first byte.
enum class McapOp : uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0b,
  data_end = 0x0f
};

class McapWriter {
 public:
  /// Creates a temporary file in the folder of `path`; finish() renames it to `path`. `library` is the name
  /// of the writing program in the header. Throws Error that names the file and the system's reason if the
  /// file cannot be created.
  McapWriter(const std::filesystem::path& path, std::string_view library);

  /// Adds a topic of JSON messages and returns its channel number. `schema` is the JSON schema of the type
  /// `schema_name`. Channels with the same type share the schema.
  uint16_t add_channel(const std::string& topic, const std::string& schema_name, const std::string& schema);

  /// Appends one message with its time (ns). Messages may be in any order of time.
  void add(uint16_t channel, uint64_t time_ns, std::string_view json);

  /// Writes the last chunk and the summary, and renames the file to its final name; an existing file of that
  /// name is replaced.
  void finish();

 private:
  struct Chunk {
    uint64_t first_ns = 0, last_ns = 0;
    uint64_t offset = 0, length = 0, size = 0;
    std::map<uint16_t, uint64_t> indexes;  ///< offset of the message index of each channel
    uint64_t indexes_length = 0;
  };
  struct Entry {
    uint64_t time_ns, offset;
  };

  void write(std::string_view bytes);
  void finish_chunk();

  NewFile file_;
  uint64_t position_ = 0;
  std::map<std::string, uint16_t> schema_ids_;
  std::vector<std::string> schemas_, channels_;  ///< records as written
  size_t n_written_schemas_ = 0, n_written_channels_ = 0;
  std::string records_;  ///< records of the open chunk
  std::map<uint16_t, std::vector<Entry>> entries_;
  uint64_t first_ns_ = 0, last_ns_ = 0;  ///< time range of the open chunk
  std::vector<Chunk> chunks_;
  std::map<uint16_t, uint64_t> counts_;  ///< messages of each channel
};

}  // namespace sextant

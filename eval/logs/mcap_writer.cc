#include "sextant/eval/logs/mcap_writer.h"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <concepts>

#include "sextant/base/error.h"

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t chunk_bytes = 1 << 20;

void put(std::string& out, std::integral auto value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_text(std::string& out, std::string_view text) {
  put(out, static_cast<uint32_t>(text.size()));
  out += text;
}

/// A map of channel numbers to 64-bit values, with the length in bytes before it.
void put_map(std::string& out, const std::map<uint16_t, uint64_t>& map) {
  put(out, static_cast<uint32_t>(map.size() * (2 + 8)));
  for (const auto& [key, value] : map) {
    put(out, key);
    put(out, value);
  }
}

std::string record(McapOp op, std::string_view content) {
  std::string out;
  put(out, static_cast<uint8_t>(op));
  put(out, static_cast<uint64_t>(content.size()));
  return out.append(content);
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path, std::string_view library) : file_(path) {
  write(mcap_magic);
  std::string header;
  put_text(header, "");  // no profile
  put_text(header, library);
  write(record(McapOp::header, header));
}

void McapWriter::write(std::string_view bytes) {
  file_.append(bytes);
  position_ += bytes.size();
}

uint16_t McapWriter::add_channel(const std::string& topic, const std::string& schema_name,
                                 const std::string& schema) {
  const auto [known, is_new] =
      schema_ids_.try_emplace(schema_name, static_cast<uint16_t>(schema_ids_.size() + 1));
  if (is_new) {
    std::string content;
    put(content, known->second);
    put_text(content, schema_name);
    put_text(content, "jsonschema");
    put_text(content, schema);
    schemas_.push_back(record(McapOp::schema, content));
  }
  const auto id = static_cast<uint16_t>(channels_.size());
  std::string content;
  put(content, id);
  put(content, known->second);
  put_text(content, topic);
  put_text(content, "json");
  put(content, uint32_t{0});  // no metadata
  channels_.push_back(record(McapOp::channel, content));
  return id;
}

void McapWriter::add(uint16_t channel, uint64_t time_ns, std::string_view json) {
  SEXTANT_CHECK(channel < channels_.size());
  for (; n_written_schemas_ < schemas_.size(); ++n_written_schemas_) records_ += schemas_[n_written_schemas_];
  for (; n_written_channels_ < channels_.size(); ++n_written_channels_)
    records_ += channels_[n_written_channels_];
  if (entries_.empty()) first_ns_ = last_ns_ = time_ns;
  first_ns_ = std::min(first_ns_, time_ns);
  last_ns_ = std::max(last_ns_, time_ns);
  entries_[channel].push_back({time_ns, records_.size()});
  std::string content;
  put(content, channel);
  put(content, static_cast<uint32_t>(counts_[channel]++));
  put(content, time_ns);  // of recording
  put(content, time_ns);  // of publication
  content += json;
  records_ += record(McapOp::message, content);
  if (records_.size() >= chunk_bytes) finish_chunk();
}

void McapWriter::finish_chunk() {
  if (entries_.empty()) return;
  Chunk chunk{.first_ns = first_ns_, .last_ns = last_ns_, .offset = position_, .size = records_.size()};
  std::string content;
  put(content, first_ns_);
  put(content, last_ns_);
  put(content, chunk.size);
  put(content, libdeflate_crc32(0, records_.data(), records_.size()));
  put_text(content, "");  // not compressed
  put(content, chunk.size);
  content += records_;
  write(record(McapOp::chunk, content));
  chunk.length = position_ - chunk.offset;
  for (auto& [channel, entries] : entries_) {
    std::ranges::stable_sort(entries, {}, &Entry::time_ns);
    std::string index;
    put(index, channel);
    put(index, static_cast<uint32_t>(entries.size() * (8 + 8)));
    for (const Entry& entry : entries) {
      put(index, entry.time_ns);
      put(index, entry.offset);
    }
    chunk.indexes[channel] = position_;
    write(record(McapOp::message_index, index));
  }
  chunk.indexes_length = position_ - chunk.offset - chunk.length;
  chunks_.push_back(std::move(chunk));
  records_.clear();
  entries_.clear();
}

void McapWriter::finish() {
  finish_chunk();
  write(record(McapOp::data_end, std::string(4, '\0')));  // no checksum of the data section
  const uint64_t summary_start = position_;
  for (const std::string& schema : schemas_) write(schema);
  for (const std::string& channel : channels_) write(channel);
  uint64_t n_messages = 0, first_ns = 0, last_ns = 0;
  for (const auto& [channel, n] : counts_) n_messages += n;
  for (size_t i = 0; i < chunks_.size(); ++i) {
    const Chunk& chunk = chunks_[i];
    first_ns = i == 0 ? chunk.first_ns : std::min(first_ns, chunk.first_ns);
    last_ns = std::max(last_ns, chunk.last_ns);
    std::string index;
    put(index, chunk.first_ns);
    put(index, chunk.last_ns);
    put(index, chunk.offset);
    put(index, chunk.length);
    put_map(index, chunk.indexes);
    put(index, chunk.indexes_length);
    put_text(index, "");  // not compressed
    put(index, chunk.size);
    put(index, chunk.size);
    write(record(McapOp::chunk_index, index));
  }
  std::string statistics;
  put(statistics, n_messages);
  put(statistics, static_cast<uint16_t>(schemas_.size()));
  put(statistics, static_cast<uint32_t>(channels_.size()));
  put(statistics, uint32_t{0});  // attachments
  put(statistics, uint32_t{0});  // metadata
  put(statistics, static_cast<uint32_t>(chunks_.size()));
  put(statistics, first_ns);
  put(statistics, last_ns);
  put_map(statistics, counts_);
  write(record(McapOp::statistics, statistics));
  std::string footer;
  put(footer, summary_start);
  put(footer, uint64_t{0});  // no summary offsets
  put(footer, uint32_t{0});  // no checksum of the summary
  write(record(McapOp::footer, footer));
  write(mcap_magic);
  file_.commit();
}

}  // namespace sextant

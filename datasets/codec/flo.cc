#include "sextant/datasets/codec/flo.h"

#include <bit>
#include <cstring>

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little, ".flo files are copied to memory as they are");
static_assert(sizeof(Flow) == 8);

constexpr std::string_view magic = "PIEH";
constexpr size_t header = 12;
constexpr float unknown_limit = 1e9f;
constexpr float unknown_value = 1e10f;

// NaN and infinity are above the limit too, seen as integers. Written so that it vectorises: files without
// an unknown pixel, the rule for networks, cost one pass at memory speed.
bool has_unknown(const Flow* row, size_t n) {
  const uint32_t limit = std::bit_cast<uint32_t>(unknown_limit);
  uint32_t above = 0;
  for (size_t i = 0; i < n; ++i) {
    const uint32_t u = std::bit_cast<uint32_t>(row[i].u) & 0x7fffffffu;
    const uint32_t v = std::bit_cast<uint32_t>(row[i].v) & 0x7fffffffu;
    above |= (limit - u) | (limit - v);
  }
  return (above >> 31) != 0;
}

}  // namespace

Image<Flow> decode_flo(std::string_view bytes, const std::string& name) {
  if (bytes.size() < header) {
    fail("{}: expected a Middlebury .flo file, but it has only {} bytes", name, bytes.size());
  }
  if (bytes.substr(0, 4) != magic) {
    fail("{}: not a Middlebury .flo file: it does not start with the magic number 202021.25 (\"PIEH\")",
         name);
  }
  int32_t size[2];
  std::memcpy(size, bytes.data() + 4, sizeof size);
  const auto [width, height] = size;
  if (width <= 0 || height <= 0 || width > 1'000'000 || height > 1'000'000) {
    fail("{}: .flo header names {}x{} pixels", name, width, height);
  }
  const size_t expected = header + sizeof(Flow) * static_cast<size_t>(width) * static_cast<size_t>(height);
  if (bytes.size() != expected) {
    fail("{}: .flo file is {}: {} bytes instead of {} for its {}x{} pixels; make or copy it again", name,
         bytes.size() < expected ? "truncated" : "too long", bytes.size(), expected, width, height);
  }
  Image<Flow> flow(width, height);
  std::memcpy(flow.data(), bytes.data() + header, expected - header);
  const size_t n = static_cast<size_t>(width);
  for (int y = 0; y < height; ++y) {
    Flow* row = flow.row(y);
    if (!has_unknown(row, n)) continue;
    for (size_t x = 0; x < n; ++x) {
      if (!(std::abs(row[x].u) <= unknown_limit && std::abs(row[x].v) <= unknown_limit)) row[x] = Flow{};
    }
  }
  return flow;
}

std::string encode_flo(const Image<Flow>& flow) {
  std::string out(magic);
  const int32_t size[2] = {flow.width(), flow.height()};
  out.append(reinterpret_cast<const char*>(size), sizeof size);
  out.append(reinterpret_cast<const char*>(flow.data()), sizeof(Flow) * flow.size());
  for (size_t i = 0; i < flow.size(); ++i) {
    if (flow.data()[i].valid()) continue;
    const Flow unknown{unknown_value, unknown_value};
    std::memcpy(out.data() + header + sizeof(Flow) * i, &unknown, sizeof unknown);
  }
  return out;
}

}  // namespace sextant

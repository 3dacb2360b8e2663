#pragma once

// A pack holds the extracted pairs of one source: what sweeps run from instead of decoding images again.
//
//   "SEXTPACK" | u32 version | u64 size of the manifest | manifest (JSON) | u64 size of the pairs | pairs |
//   SHA-256 of all before, 64 hexadecimal digits
//
// Little-endian. Points are stored in single precision, which loses nothing: pixels are integers, depth and
// flow come from single-precision images; what does not fit is an internal error. A pack that was damaged
// fails its SHA-256.

#include <string>
#include <string_view>
#include <vector>

#include "sextant/eval/experiment/pair_reader.h"

namespace sextant {

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

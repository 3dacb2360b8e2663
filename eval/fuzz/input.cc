#include "sextant/eval/fuzz/input.h"

#include <libdeflate.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "sextant/base/error.h"
#include "sextant/base/files.h"

namespace sextant {
namespace {

constexpr std::string_view file_mark = "@@ ";
constexpr size_t most_files = 64;

bool is_name(std::string_view name) {
  const auto is_good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("._-/").find(c) != std::string_view::npos;
  };
  return !name.empty() && name.size() < 200 && name.front() != '/' && name.back() != '/' &&
         name.find("..") == std::string_view::npos && std::ranges::all_of(name, is_good);
}

void append32(std::string& out, uint32_t x) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(x >> shift));
}

void append_chunk(std::string& out, std::string_view type, std::string_view body) {
  append32(out, static_cast<uint32_t>(body.size()));
  const std::string summed = std::string(type) + std::string(body);
  out += summed;
  append32(out, libdeflate_crc32(0, summed.data(), summed.size()));
}

}  // namespace

FuzzFolder::FuzzFolder(std::string_view text) {
  for (size_t n = 0; !text.empty(); ++n) {
    const size_t line_end = text.find('\n');
    if (!text.starts_with(file_mark) || line_end == std::string_view::npos) fail("expected '@@ NAME'");
    const std::string_view name = text.substr(file_mark.size(), line_end - file_mark.size());
    if (!is_name(name) || n == most_files)
      fail("expected at most 64 files with names of letters, digits and ._-/");
    text.remove_prefix(line_end + 1);
    const size_t end = std::min(text.find("\n@@ "), text.size());
    std::error_code error;
    fs::create_directories((path() / name).parent_path(), error);
    std::ofstream(path() / name, std::ios::binary) << text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::string png_of_pixels(std::string_view bytes) {
  if (bytes.size() < 5) fail("too short");
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(bytes[i]); };
  std::string header;
  append32(header, byte(0));
  append32(header, byte(1));
  header += {bytes[2], bytes[3], '\0', '\0', '\0'};
  const std::string_view palette = bytes.substr(5, byte(4));
  const std::string_view pixels = bytes.substr(std::min(bytes.size(), size_t{5} + byte(4)));
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
      libdeflate_alloc_compressor(1), libdeflate_free_compressor);
  std::string data(libdeflate_zlib_compress_bound(compressor.get(), pixels.size()), '\0');
  data.resize(
      libdeflate_zlib_compress(compressor.get(), pixels.data(), pixels.size(), data.data(), data.size()));
  std::string png("\x89PNG\r\n\x1a\n", 8);
  append_chunk(png, "IHDR", header);
  if (!palette.empty()) append_chunk(png, "PLTE", palette);
  append_chunk(png, "IDAT", data.substr(0, data.size() / 2));
  append_chunk(png, "IDAT", data.substr(data.size() / 2));
  append_chunk(png, "IEND", "");
  return png;
}

}  // namespace sextant

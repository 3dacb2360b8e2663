#include "sextant/eval/fuzz/folder.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

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

}  // namespace sextant

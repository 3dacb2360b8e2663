#include "sextant/eval/external/external_case.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/safe_paths.h"

namespace sextant {

CaseFolder::CaseFolder(const fs::path& folder, Keep keep)
    : keep_(folder.empty() ? std::nullopt : std::optional(keep)) {
  if (folder.empty()) {
    std::string name = (fs::temp_directory_path() / "sextant_case_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) fail("{}: cannot make this folder", name);
    path_ = name;
  } else {
    path_ = fs::absolute(folder).lexically_normal();
    fs::remove_all(path_);  // left by an interrupted run
    // OUT/external/CASE
    const fs::path cases = path_.parent_path();
    fs::create_directories(cases.parent_path());
    make_folder_below(cases.parent_path(), cases.filename() / path_.filename());
  }
  fs::create_directory(output());
}

CaseFolder::~CaseFolder() {
  std::error_code ignored;
  if (keep_ != Keep::all) fs::remove_all(input(), ignored);
  if (keep_ != Keep::all && keep_ != Keep::output) fs::remove_all(output(), ignored);
  if (!keep_) fs::remove_all(path_, ignored);
}

void write_case(const ProcessOutcome& outcome, const fs::path& folder) {
  write_file(folder / "case.json", json_line(write_options(outcome)) + "\n");
}

ProcessOutcome read_case(const fs::path& folder) {
  const fs::path path = folder / "case.json";
  if (!fs::exists(path)) fail("{}: does not exist: expected the folder of a finished case", path.string());
  if (!fs::is_directory(folder / "output"))
    fail("{}: does not exist: outputs are kept with \"keep\" output or all", (folder / "output").string());
  return options_from<ProcessOutcome>(path);
}

std::string last_line(const fs::path& path) {
  constexpr std::streamoff most = 4096;
  constexpr size_t shown = 200;
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = in.tellg();
  in.seekg(std::max<std::streamoff>(0, size - most));
  std::string line, last;
  while (std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  while (!last.empty() && (last.back() == '\r' || last.back() == ' ')) last.pop_back();
  std::ranges::replace_if(
      last, [](char c) { return c < ' ' || c > '~'; }, '?');
  return last.size() <= shown ? last : "..." + last.substr(last.size() - shown);
}

}  // namespace sextant

#include "sextant/eval/records/output.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <regex>
#include <system_error>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/new_file.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/provenance.h"

namespace sextant {

std::optional<FolderLock> lock_folder(const std::string& folder) {
  return folder.empty() ? std::nullopt : std::optional(FolderLock(folder));
}

void check_output_folder(const fs::path& folder, const Json& configuration, bool force) {
  std::error_code ignored;
  if (folder.empty()) fail("--out: expected a folder, got ''");
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored)) {
    fail("{}: is a file, expected a folder for the results", folder.string());
  }
  if (force || !has_results(folder)) return;
  const Json recorded = fs::exists(folder / "run.json", ignored) ? read_run_json(folder) : Json::object();
  if (recorded.value("configuration", Json()) != configuration) {
    fail(
        "{}: holds the records of a run with other sources or options; choose another folder, or pass "
        "--force to replace them",
        folder.string());
  }
}

OutputFolder::OutputFolder(fs::path folder)
    : folder_(std::move(folder)), lock_(folder_), staging_(folder_ / ".incomplete") {
  std::error_code error;
  fs::remove_all(staging_, error);  // left by a killed run
  // Only this user may enter it, whoever may write into the folder.
  if (error || ::mkdir(staging_.c_str(), 0700) != 0) {
    fail("{}: cannot create: {}", staging_.string(), error ? error.message() : std::strerror(errno));
  }
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  fs::remove_all(staging_, ignored);
}

void OutputFolder::commit(const std::vector<std::string>& names) {
  // Before anything is moved, so that a link in the way leaves earlier results unchanged.
  for (const std::string& name : names) {
    if (const fs::path below = fs::path(name).parent_path(); !below.empty())
      make_folder_below(folder_, below);
  }
  for (const std::string& name : names) move_below(staging_ / name, folder_, name);
  sync_folder(folder_);
}

void write_output_folder(const fs::path& folder, const OutputFiles& files) {
  write_output_folder(folder, [&](const FileWriter& write) {
    for (const auto& [name, bytes] : files) write(name, bytes);
  });
}

void write_output_folder(const fs::path& folder, const std::function<void(const FileWriter& write)>& make) {
  OutputFolder output(folder);
  std::vector<std::string> names;
  make([&](const std::string& name, const std::string& bytes) {
    check_interrupt();
    std::error_code error;
    fs::create_directories(output.path(name).parent_path(), error);
    write_file(output.path(name), bytes);
    names.push_back(name);
  });
  std::ranges::sort(names);
  output.commit(names);
}

void remove_stale_files(const fs::path& folder, const std::string& pattern,
                        const std::set<std::string>& written) {
  std::error_code ignored;
  if (!fs::is_directory(fs::symlink_status(folder, ignored))) return;
  const fs::path list = folder / ".sextant_outputs";
  std::set<std::string> listed = written;
  if (fs::is_regular_file(fs::symlink_status(list, ignored))) {
    constexpr size_t longest_name = 255;  // of a file; std::regex recurses with the length of a text
    const std::regex stale(pattern);
    for (const std::string& name : split(read_file(list), '\n')) {
      if (name.empty() || name.size() > longest_name) continue;
      const bool is_stale = std::regex_match(name, stale) && !written.contains(name);
      if (is_stale && name.find('/') == std::string::npos) fs::remove(folder / name, ignored);
      if (!is_stale) listed.insert(name);
    }
  }
  write_file(list, fmt::format("{}\n", fmt::join(listed, "\n")));
}

void replace_report(const fs::path& folder, const OutputFiles& files) {
  write_output_folder(folder, files);
  for (const char* part : {"curves", "figures", "tables", "tracks"}) {
    std::set<std::string> written;
    for (const auto& [name, bytes] : files)
      if (fs::path(name).parent_path() == part) written.insert(fs::path(name).filename().string());
    remove_stale_files(folder / part, R"(.*\.(csv|gp|json|md|pdf|png|svg|tex))", written);
  }
}

}  // namespace sextant

#include "sextant/eval/records/output.h"

#include <system_error>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/eval/records/run_json.h"
#include "sextant/eval/records/summary_file.h"

namespace sextant {
namespace {

}  // namespace

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
    : folder_(std::move(folder)), staging_(folder_ / ".incomplete") {
  try {
    // The first folder on the way that does not exist; empty when all do.
    for (fs::path p = fs::absolute(folder_).lexically_normal(); !fs::exists(p); p = p.parent_path())
      created_ = p;
    fs::remove_all(staging_);  // of a run that was killed
    fs::create_directories(staging_);
  } catch (const fs::filesystem_error& error) {
    fail("{}: cannot create: {}", error.path1().string(), error.code().message());
  }
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  fs::remove_all(staging_, ignored);
  if (!created_.empty()) fs::remove_all(created_, ignored);
}

void OutputFolder::commit(const std::vector<std::string>& names) {
  try {
    for (const std::string& name : names) {
      fs::create_directories((folder_ / name).parent_path());
      fs::rename(staging_ / name, folder_ / name);
    }
    sync_folder(folder_);
  } catch (const fs::filesystem_error& error) {
    fail("{}: cannot create: {}", error.path1().string(), error.code().message());
  }
  created_.clear();
}

void write_output_folder(const fs::path& folder, const OutputFiles& files) {
  OutputFolder output(folder);
  std::vector<std::string> names;
  for (const auto& [name, bytes] : files) {
    check_interrupt();
    std::error_code error;
    fs::create_directories(output.path(name).parent_path(), error);
    write_file(output.path(name), bytes);
    names.push_back(name);
  }
  output.commit(names);
}

}  // namespace sextant

#include "sextant/eval/gate/baseline.h"

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/gate/side.h"

namespace sextant {

OutputFiles baseline_files(const std::filesystem::path& run) {
  const Side side = read_side(run);
  if (side.runs.size() != 1) {
    fail("{}: holds {} runs: expected one folder of `sextant run` or `sextant sweep`", side.path,
         side.runs.size());
  }
  const std::filesystem::path folder = side.runs.front().path;
  // In the order of the file, which is the order of the cases of the run.
  std::vector<Record> records = read_records(folder / "records.jsonl");
  for (Record& record : records) record = strip_times(std::move(record));
  OutputFiles files = {{"records.jsonl", write_records(records)}};
  if (std::filesystem::exists(folder / "run.json")) files["run.json"] = read_file(folder / "run.json");
  return files;
}

}  // namespace sextant

#include "sextant/eval/evaluation/evo_result.h"

#include <minizip/zip.h>
#include <unistd.h>

#include <cstring>

#include "sextant/base/options.h"
#include "sextant/eval/evaluation/ego_json.h"

namespace sextant {
namespace {

/// A zip file under construction; what is not finished is removed.
class ZipFile {
 public:
  explicit ZipFile(const std::filesystem::path& path)
      : path_(path), temporary_(path.string() + fmt::format(".{}.tmp", ::getpid())) {
    zip_ = zipOpen64(temporary_.c_str(), APPEND_STATUS_CREATE);
    if (zip_ == nullptr) fail("{}: cannot write", path.string());
  }
  ~ZipFile() {
    if (zip_ != nullptr) zipClose(zip_, nullptr);
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  void add(const std::string& name, std::string_view bytes) {
    zip_fileinfo info{};
    info.tmz_date = {0, 0, 0, 1, 0, 1980};  // the same bytes every time
    const bool good =
        zipOpenNewFileInZip(zip_, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, 0, 0) == ZIP_OK &&
        zipWriteInFileInZip(zip_, bytes.data(), static_cast<unsigned>(bytes.size())) == ZIP_OK &&
        zipCloseFileInZip(zip_) == ZIP_OK;
    if (!good) fail("{}: cannot write {}", path_.string(), name);
  }
  void finish() {
    const bool good = zipClose(zip_, nullptr) == ZIP_OK;
    zip_ = nullptr;
    if (!good) fail("{}: cannot write", path_.string());
    std::filesystem::rename(temporary_, path_);
  }

 private:
  std::filesystem::path path_;
  std::string temporary_;
  zipFile zip_ = nullptr;
};

std::vector<double> distances_of(const PoseSeries& poses, const std::vector<int>& rows) {
  std::vector<double> path(poses.size(), 0.0), out;
  for (size_t i = 1; i < poses.size(); ++i)
    path[i] = path[i - 1] + (poses.positions_m[i] - poses.positions_m[i - 1]).norm();
  for (const int row : rows) out.push_back(path[static_cast<size_t>(row)]);
  return out;
}

std::string title_of(const EgoResult& result, const EgoOptions& options) {
  std::string title = fmt::format("{} w.r.t. {} ({})", options.rpe ? "RPE" : "APE",
                                  to_string(options.relation), unit_of(options.relation));
  if (options.rpe) {
    title += fmt::format("\nfor delta = {} using {} pairs", options.rpe->text(),
                         options.rpe->all_pairs ? "all" : "consecutive");
  }
  return title +
         fmt::format("\n(alignment: {}, {} poses)", to_string(options.alignment), result.estimate.size());
}

/// Matched rows that errors belong to: a relative error to its second pose.
std::vector<int> rows_of_errors(const EgoResult& result) {
  std::vector<int> rows;
  for (size_t i = 0; i < result.errors.size(); ++i)
    rows.push_back(result.pairs.empty() ? static_cast<int>(i) : result.pairs[i].second);
  return rows;
}

}  // namespace

std::string encode_npy(std::span<const double> values, size_t columns) {
  const std::string shape = columns == 0 ? fmt::format("({},)", values.size())
                                         : fmt::format("({}, {})", values.size() / columns, columns);
  std::string header = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': {}, }}", shape);
  constexpr size_t preamble = 10, block = 64;
  header.append(block - (preamble + header.size() + 1) % block, ' ').push_back('\n');
  std::string out("\x93NUMPY\x01\x00", 8);
  out.push_back(static_cast<char>(header.size() & 0xff));
  out.push_back(static_cast<char>(header.size() >> 8));
  out += header;
  const size_t at = out.size();
  out.resize(at + values.size_bytes());
  std::memcpy(out.data() + at, values.data(), values.size_bytes());
  return out;
}

void write_evo_result(const std::filesystem::path& path, const EgoResult& result, const EgoOptions& options,
                      const std::string& reference_name) {
  ZipFile zip(path);
  const Json info = {
      {"title", title_of(result, options)},
      {"ref_name", reference_name},
      {"est_name", result.name},
      {"label", fmt::format("{} ({})", options.rpe ? "RPE" : "APE", unit_of(options.relation))}};
  zip.add("info.json", json_line(info));
  zip.add("stats.json", json_line(to_json(result.statistics)));
  zip.add("error_array.npy", encode_npy(result.errors));
  const std::vector<int> rows = rows_of_errors(result);
  if (!result.estimate.stamps_s.empty()) {
    std::vector<double> stamps, seconds;
    for (const int row : rows) {
      stamps.push_back(result.estimate.stamps_s[static_cast<size_t>(row)]);
      seconds.push_back(stamps.back() - result.estimate.stamps_s[0]);
    }
    zip.add("timestamps.npy", encode_npy(stamps));
    zip.add("seconds_from_start.npy", encode_npy(seconds));
    zip.add("distances_from_start.npy", encode_npy(distances_of(result.reference, rows)));
    zip.add("distances.npy", encode_npy(distances_of(result.estimate, rows)));
  }
  if (options.alignment != Alignment::none) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = result.alignment.ref_from_est.matrix();
    zip.add("alignment_transformation_sim3.npy", encode_npy({m.data(), 16}, 4));
  }
  zip.finish();
}

}  // namespace sextant

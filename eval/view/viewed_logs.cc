// Results of `sextant evaluate objects --out`, arranged for a view as a run is (viewed_run.h).

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/view/viewed_run.h"

namespace sextant {

bool is_of_logs(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "records.jsonl", ignored) && !fs::exists(folder / "run.json", ignored);
}

namespace {

/// The frames of logs whose source is not known: no channel, no truth.
class SequenceOfLogs : public Sequence {
 public:
  explicit SequenceOfLogs(SequenceInfo info) : info_(std::move(info)) {}
  const SequenceInfo& info() const override { return info_; }
  const SequenceTruth& truth() const override { return truth_; }
  Frame read(int /*frame*/, Channels /*channels*/) const override { return {}; }
  void check_files() const override {}

 private:
  SequenceInfo info_;
  SequenceTruth truth_;
};

std::shared_ptr<const Sequence> sequence_of_logs(const std::vector<Record>& records,
                                                 const std::vector<BodyTrack>& tracks) {
  SequenceInfo info;
  info.dataset = records.front().dataset;
  info.sequence = records.front().sequence;
  info.rate_hz = 10;  // for the playback only: logs without a source do not state a rate
  info.first_frame = records.front().frame - 1;
  info.last_frame = records.front().frame;
  const auto include = [&](int first, int last) {
    info.first_frame = std::min(info.first_frame, first);
    info.last_frame = std::max(info.last_frame, last);
  };
  for (const Record& record : records) include(record.frame - 1, record.frame);
  for (const BodyTrack& track : tracks) {
    for (const TrackPoint& point : track.points) include(point.frame, point.frame);
  }
  return std::make_shared<SequenceOfLogs>(std::move(info));
}

/// Returns how much the distances that the logged camera moves over five frames differ from those of
/// `camera`, as a share of them; nullopt if the camera hardly moves or the logs do not contain it. With
/// `of_truth` the camera is the true one of the logs.
std::optional<double> difference_of_camera(const std::vector<BodyTrack>& tracks, bool of_truth,
                                           const Trajectory& camera) {
  constexpr int apart = 5;
  const auto logged = of_truth ? &TrackPoint::truth_m : &TrackPoint::estimate_m;
  const auto ego = std::ranges::find(tracks, "ego", &BodyTrack::body);
  if (ego == tracks.end()) return std::nullopt;
  double difference_m = 0, length_m = 0;
  for (const TrackPoint& point : ego->points) {
    const TrackPoint* const later = ego->find(point.frame + apart);
    const auto a = camera.pose(point.frame), b = camera.pose(point.frame + apart);
    if (later == nullptr || !(point.*logged) || !(later->*logged) || !a || !b) continue;
    const double of_logs_m = (*(later->*logged) - *(point.*logged)).norm();
    const double of_source_m = (b->translation() - a->translation()).norm();
    difference_m += std::abs(of_logs_m - of_source_m);
    length_m += std::max(of_logs_m, of_source_m);
  }
  constexpr double least_m = 1;
  return length_m > least_m ? std::optional(difference_m / length_m) : std::nullopt;
}

/// Throws Error if the true camera of the logs moves otherwise than that of the source, and notes it if their
/// estimated camera does.
void check_camera(const std::string& folder, ViewedRun& run, const std::string& source,
                  const Trajectory& camera) {
  constexpr double most_of_truth = 0.1, most_of_estimate = 0.2;
  const auto of_truth = difference_of_camera(run.tracks, true, camera);
  if (of_truth && *of_truth > most_of_truth)
    fail(
        "{}: the true camera of these logs moves otherwise than that of {} (by {:.0f} %): are they of "
        "another sequence? Give theirs by --images",
        folder, source, 100 * *of_truth);
  const auto of_estimate = difference_of_camera(run.tracks, false, camera);
  if (!of_truth && of_estimate && *of_estimate > most_of_estimate)
    run.notes.push_back(fmt::format(
        "the estimated camera moves otherwise than the true one of {} (by {:.0f} %): the logs are "
        "of another sequence, or their scale is not metric",
        source, 100 * *of_estimate));
}

}  // namespace

ViewedRun view_records(const fs::path& folder, const CaseChoice& choice, const std::string& source,
                       std::shared_ptr<const Sequence> sequence) {
  ViewedRun run;
  run.folder = folder.string();
  std::vector<Record> all = read_records(folder / "records.jsonl");
  if (all.empty())
    fail("{}: has no records: expected the results of `sextant evaluate objects --out`",
         (folder / "records.jsonl").string());
  std::vector<std::string> estimators, seeds;
  std::set<std::pair<std::string, uint64_t>> cases;
  for (const Record& record : all) {
    add_distinct(record.estimator.str(), estimators);
    cases.emplace(record.estimator, record.seed);
  }
  run.estimator = estimators[place_of(choice.estimator, estimators, "estimator", folder)];
  for (const auto& [estimator, seed] : cases)
    if (estimator == run.estimator) seeds.push_back(std::to_string(seed));
  run.seed =
      std::stoull(seeds[place_of(choice.seed ? std::to_string(*choice.seed) : "", seeds, "seed", folder)]);
  run.n_cases = cases.size();
  const std::string tracks = (folder / tracks_file(run.estimator, run.seed)).string();
  if (fs::exists(tracks)) run.tracks = parse_tracks(read_file(tracks), tracks);
  std::erase_if(all, [&](const Record& r) { return r.estimator != run.estimator || r.seed != run.seed; });
  if (sequence) check_camera(folder.string(), run, source, sequence->truth().camera);
  run.source =
      sequence ? source : fmt::format("{} {}", all.front().dataset.str(), all.front().sequence.str());
  run.sequence = sequence ? std::move(sequence) : sequence_of_logs(all, run.tracks);
  const SequenceInfo& info = run.sequence->info();
  for (Record& record : all) {
    if (record.frame >= info.first_frame && record.frame <= info.last_frame)
      run.records.push_back(std::move(record));
  }
  if (run.records.empty())
    fail("{}: no record of {} is of a frame of {} ({}-{})", folder.string(), run.estimator, run.source,
         info.first_frame, info.last_frame);
  run.notes.emplace_back(run.tracks.empty()
                             ? "Made from records alone: there are no points, covariances or paths."
                             : "Made from logs: there are no points and covariances.");
  return run;
}

}  // namespace sextant

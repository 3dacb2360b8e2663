// score_trajectory ESTIMATE REFERENCE
//
// The absolute error of a path (ATE) after alignment, pose by pose: `sextant evaluate ego REFERENCE ESTIMATE
// --align se3` in a program of one's own. Both files are of any format that sextant reads, with equally many
// poses.

#include <cstdio>

#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/metrics/trajectory_alignment.h"
#include "sextant/metrics/trajectory_errors.h"

namespace {

void score(const char* estimate_file, const char* reference_file) {
  sextant::PoseSeries estimate = sextant::read_trajectory(estimate_file).poses;
  const sextant::PoseSeries reference = sextant::read_trajectory(reference_file).poses;
  if (estimate.size() != reference.size())
    sextant::fail("{} has {} poses, {} has {}: expected equally many poses", estimate_file, estimate.size(),
                  reference_file, reference.size());
  sextant::align(estimate, reference, sextant::Alignment::se3);
  const sextant::ErrorStatistics e = sextant::error_statistics(
      sextant::absolute_errors(estimate, reference, sextant::PoseRelation::trans_part));
  std::printf("%zu poses, ATE rmse %.4f m, mean %.4f m, max %.4f m\n", estimate.size(), e.rmse, e.mean,
              e.max);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: score_trajectory ESTIMATE REFERENCE\n");
    return 2;
  }
  try {
    score(argv[1], argv[2]);
    return 0;
  } catch (const sextant::Error& error) {  // bad input; its text says what was found and what to do
    std::fprintf(stderr, "score_trajectory: %s\n", error.what());
    return 2;
  }
}

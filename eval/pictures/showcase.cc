#include "sextant/eval/pictures/pictures.h"

#include <memory>
#include <optional>

#include "sextant/base/error.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {

Showcase make_showcase(const ShowcaseRequest& request) {
  const std::unique_ptr<Sequence> sequence = open_source(request.source);
  const SequenceInfo& info = sequence->info();
  const int frame = request.frame.value_or(info.first_frame + 1);
  if (frame <= info.first_frame || frame > info.last_frame) {
    fail("frame {}: must be in {}-{}, the second to the last frame of {}", frame,
         info.first_frame + 1, info.last_frame, request.source.text);
  }
  if (!info.channels.rgb) fail("{}: has no colour images to draw on", request.source.text);

  std::optional<FrameResult> result;
  std::vector<Record> records;
  RunConfig config;
  config.sources = {request.source};
  config.sources.front().first = info.first_frame;
  config.sources.front().last = frame;
  config.estimator = request.estimator;
  config.options = request.options;
  config.jobs = request.jobs;
  config.quiet = request.quiet;
  config.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
    result = pair;
    records.assign(of_pair.begin(), of_pair.end());
  };
  Showcase showcase;
  showcase.run = run(config);
  Channels channels;
  channels.rgb = channels.mask = true;
  showcase.overlay_png =
      draw_overlay(sequence->read(result->prev, channels), *result, records, request.width_px);
  return showcase;
}

OutputFiles showcase_files(const ShowcaseRequest& request) {
  Showcase showcase = make_showcase(request);
  OutputFiles files = run_files(showcase.run);
  files["overlay.png"] = std::move(showcase.overlay_png);
  return files;
}

}  // namespace sextant

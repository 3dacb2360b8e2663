#include "sextant/datasets/synthetic_scenes.h"

#include "sextant/datasets/dataset.h"

namespace sextant {

std::unique_ptr<Sequence> open_synthetic(const SourceSpec& source) {
  SyntheticOptions options;
  read_options(source.options, options, "synthetic");
  if (!source.sequence.empty()) {
    fail("source '{}': a synthetic source has no '#': expected synthetic:scenario[@first-last]", source.text);
  }
  return open_rendered(
      [&](InputLog&) {
        RenderedSource rendered;
        rendered.scenario = synthetic::make_scenario(source.path);
        rendered.info.dataset = source.adapter;
        rendered.info.sequence = source.path;
        std::set<int> frames;
        for (int frame = 0; frame < rendered.scenario.n_frames(); ++frame) frames.insert(frames.end(), frame);
        choose_frames(source, frames, "synthetic:" + source.path, rendered.info);
        return rendered;
      },
      options);
}

}  // namespace sextant

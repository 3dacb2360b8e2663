// Properties of every adapter. Each adapter is tested on a miniature of its data set, which is written by the
// layout of the same name or by a line of make_miniature().

#include <algorithm>
#include <functional>
#include <ostream>
#include <set>

#include "sextant/base/testing.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/dataset.h"
#include "sextant/datasets/kitti_testing.h"
#include "sextant/datasets/tartanair_testing.h"
#include "sextant/datasets/testing.h"

namespace sextant {

/// Names the adapter in messages of failed tests.
void PrintTo(const Adapter& adapter, std::ostream* out) { *out << adapter.name; }

namespace {

struct Miniature {
  std::string source;
  std::vector<Json> options = {Json::object()};  ///< every one is tested
  bool in_files = true;                          ///< channels are read or computed from files
  std::optional<SequenceTruth> truth;            ///< ground truth contained in the folder
};

Miniature write_layout(const std::string& layout, const fs::path& folder) {
  PatternSequence pattern(4);
  if (layout == "vkitti1") {  // has one camera only
    pattern.info_.camera = {{725, 725, 620.5, 187}, 380};
    pattern.info_.width = 1242;
    pattern.info_.height = 375;
  }
  std::string source = find_layout(layout).write(pattern, {.out = folder, .quiet = true});
  return {.source = std::move(source), .truth = pattern.truth()};
}

Miniature make_miniature(const std::string& adapter, const fs::path& folder) {
  if (adapter == "sceneflow") {
    write_sceneflow_pair(folder);
    return {"sceneflow:" + folder.string() + "#000007",
            {Json::object(), {{"depth", "truth"}, {"flow", "truth"}}}};
  }
  if (adapter == "tartanair") {
    const SequenceTruth truth = write_tartanair_trajectory(folder / "Tiny/Data_easy/P000", 4);
    return {"tartanair:" + folder.string() + "#Tiny/Data_easy/P000", {Json::object()}, true, truth};
  }
  if (adapter == "synthetic") return {"synthetic:s18", {{{"cache", folder.string()}}}, false};
  if (adapter.starts_with("replay-")) {
    Miniature text = write_layout(adapter.substr(7), folder);
    return {"replay-" + text.source, {{{"render", {{"cache", folder.string()}}}}}, false, text.truth};
  }
  const auto has_layout = [&](const Layout& layout) { return layout.name == adapter; };
  if (std::ranges::any_of(layouts(), has_layout)) return write_layout(adapter, folder);
  fail(
      "no miniature of '{}': add a layout of that name, or a line to make_miniature() in "
      "datasets/adapter_test.cc",
      adapter);
}

struct ChannelName {
  const char* name;
  bool Channels::*flag;
  std::function<std::pair<int, int>(const Frame&)> size;
};

template <typename T>
ChannelName named(const char* name, bool Channels::*flag, Image<T> Frame::*image) {
  return {name, flag,
          [image](const Frame& frame) { return std::pair((frame.*image).width(), (frame.*image).height()); }};
}

const std::vector<ChannelName>& channel_names() {
  static const std::vector<ChannelName> names = {
      named("gray", &Channels::gray, &Frame::gray),
      named("rgb", &Channels::rgb, &Frame::rgb),
      named("rgb_right", &Channels::rgb_right, &Frame::rgb_right),
      named("depth", &Channels::depth, &Frame::depth_m),
      named("flow", &Channels::flow, &Frame::flow),
      named("backward_flow", &Channels::backward_flow, &Frame::backward_flow),
      named("mask", &Channels::mask, &Frame::mask)};
  return names;
}

/// Returns a file of the same kind with 20x18 pixels.
std::string of_another_size(const fs::path& path, const std::string& bytes) {
  if (path.extension() == ".flo") return encode_flo(Image<Flow>(20, 18));
  if (path.extension() == ".txt") return encode_mask_text(Image<uint16_t>(20, 18));
  if (path.extension() == ".jpg") return encode_jpeg(Image<Rgb>(20, 18));
  const PngHeader header = png_header(bytes, path.string());
  if (header.color_type == 2)
    return header.bit_depth == 16 ? encode_png(Image<Rgb16>(20, 18))
                                  : encode_png(Image<Rgb>(20, 18, {80, 80, 80}));
  if (header.color_type == 6) return encode_png(Image<Rgba>(20, 18));
  return header.bit_depth == 16 ? encode_png(Image<uint16_t>(20, 18)) : encode_png(Image<uint8_t>(20, 18));
}

class Adapters : public testing::TestWithParam<Adapter> {
 protected:
  /// Written once per adapter.
  static const Miniature& miniature() {
    static std::map<std::string, std::pair<std::unique_ptr<TempFolder>, Miniature>> made;
    auto& [folder, miniature] = made[GetParam().name];
    if (!folder) {
      auto made_in = std::make_unique<TempFolder>();
      miniature = make_miniature(GetParam().name, made_in->path() / "data");
      folder = std::move(made_in);
    }
    return miniature;
  }
  static std::unique_ptr<Sequence> open(const Json& options, const std::string& rest = "") {
    return open_with(miniature().source + rest, options);
  }

  /// Returns the files that contain one channel of a frame.
  static std::set<std::string> files_of(const Sequence& sequence, int frame, const ChannelName& channel) {
    const auto before = sequence.inputs().entries();
    Channels one;
    one.*channel.flag = true;
    sequence.read(frame, one);
    std::set<std::string> files;
    for (const auto& [path, entry] : sequence.inputs().entries()) {
      if (!before.contains(path)) files.insert(path);
    }
    return files;
  }

  /// Calls use(options, channel, frame, file) for every file of every channel, in a frame that has neighbours
  /// if the channel has any.
  template <typename Use>
  static void for_each_file(const Use& use) {
    int n_files = 0;
    for (const Json& options : miniature().options) {
      const SequenceInfo info = open(options)->info();
      for (const ChannelName& channel : channel_names()) {
        if (!(info.channels.*channel.flag)) continue;
        int frame = info.first_frame + 1;
        std::set<std::string> files = files_of(*open(options), frame, channel);
        if (files.empty()) files = files_of(*open(options), frame = info.first_frame, channel);
        if (miniature().in_files) {
          EXPECT_FALSE(files.empty()) << channel.name;
        }
        for (const std::string& file : files) {
          SCOPED_TRACE(fmt::format("{} of frame {}: {}", channel.name, frame, file));
          const std::string good = read_file(file);
          Channels one;
          one.*channel.flag = true;
          use(options, one, frame, file);
          write_file(file, good);
          ++n_files;
        }
      }
    }
    EXPECT_EQ(n_files > 0, miniature().in_files);
  }
};

TEST_P(Adapters, IsDescribed) {
  const Adapter& adapter = GetParam();
  EXPECT_FALSE(adapter.name.empty());
  EXPECT_FALSE(adapter.description.empty());
  EXPECT_EQ(adapter.description.find('\n'), std::string::npos);
  EXPECT_FALSE(adapter.example.empty());
  for (const OptionHelp& option : adapter.options()) {
    EXPECT_FALSE(option.key.empty());
    EXPECT_FALSE(option.meaning.empty()) << option.key;
  }
}

TEST_P(Adapters, ExampleParses) {
  const SourceSpec spec = SourceSpec::parse(GetParam().example);
  EXPECT_EQ(spec.adapter, GetParam().name);
  EXPECT_FALSE(spec.path.empty());
}

TEST_P(Adapters, MissingPathIsAnErrorThatNamesIt) {
  SourceSpec spec = SourceSpec::parse(GetParam().example);
  spec.path = "/no/such/folder";
  expect_error([&] { open_source(spec); }, "/no/such/folder");
}

TEST_P(Adapters, UnknownOptionIsAnError) {
  SourceSpec spec = SourceSpec::parse(GetParam().example);
  spec.options["no_such_option"] = 1;
  expect_error([&] { open_source(spec); }, "no_such_option");
}

TEST_P(Adapters, InfoSaysWhatIsThere) {
  for (const Json& options : miniature().options) {
    const auto sequence = open(options);
    const SequenceInfo& info = sequence->info();
    EXPECT_EQ(info.dataset, GetParam().name);
    EXPECT_FALSE(info.sequence.empty());
    EXPECT_GT(info.rate_hz, 0);
    EXPECT_GT(std::min(info.width, info.height), 0);
    EXPECT_GE(info.last_frame, info.first_frame + 1);
    info.camera.check();
    EXPECT_TRUE(info.channels.depth && info.channels.flow && info.channels.gray && info.channels.rgb);
    EXPECT_FALSE(info.provenance.empty());
    for (const std::string& warning : info.warnings) EXPECT_EQ(warning.find('\n'), std::string::npos);
    sequence->check_files();
  }
}

TEST_P(Adapters, ReadsOnlyRequestedChannels) {
  for (const Json& options : miniature().options) {
    const auto sequence = open(options);
    const SequenceInfo& info = sequence->info();
    for (const ChannelName& asked : channel_names()) {
      SCOPED_TRACE(asked.name);
      Channels one;
      one.*asked.flag = true;
      std::pair<int, int> largest;
      for (const int frame : {info.first_frame, info.first_frame + 1, info.last_frame}) {
        const Frame read = sequence->read(frame, one);
        EXPECT_EQ(read.index, frame);
        largest = std::max(largest, asked.size(read));
        for (const ChannelName& other : channel_names()) {
          const std::pair<int, int> size = other.size(read);
          const bool may_be_there = other.flag == asked.flag && info.channels.*asked.flag;
          EXPECT_TRUE(size == std::pair(0, 0) || (may_be_there && size == std::pair(info.width, info.height)))
              << other.name << " " << size.first << "x" << size.second;
        }
      }
      EXPECT_EQ(largest.first > 0, info.channels.*asked.flag);
    }
    const Frame both = sequence->read(info.first_frame, {.gray = true, .rgb = true});
    EXPECT_EQ(both.gray, rgb_to_gray(both.rgb));
    EXPECT_EQ(both.gray, sequence->read(info.first_frame, {.gray = true}).gray);
    for (const auto& [path, entry] : sequence->inputs().entries())
      EXPECT_EQ(entry.sha256, sha256(read_file(path)));
  }
}

TEST_P(Adapters, ReadsOnlyFramesOfTheRange) {
  const Json& options = miniature().options.front();
  const SequenceInfo all = open(options)->info();
  const auto last = open(options, fmt::format("@{}-{}", all.last_frame, all.last_frame));
  EXPECT_EQ(last->info().first_frame, all.last_frame);
  EXPECT_EQ(last->info().last_frame, all.last_frame);
  for (const int outside : {all.first_frame, all.last_frame + 1})
    expect_error([&] { last->read(outside, {.gray = true}); },
                 fmt::format("no frame {}: it has frames {}-{}", outside, all.last_frame, all.last_frame));
  expect_error([&] { open(options, fmt::format("@{}-{}", all.first_frame, all.last_frame + 9)); },
               fmt::format("frames {}-{} are requested, but it has frames {}-{}", all.first_frame,
                           all.last_frame + 9, all.first_frame, all.last_frame));
}

TEST_P(Adapters, TruthIsThatOfTheFolder) {
  const auto sequence = open(miniature().options.front());
  const SequenceInfo& info = sequence->info();
  const SequenceTruth& truth = sequence->truth();
  for (const auto& [frame, objects] : truth.objects) {
    std::set<int> ids;
    for (const ObjectTruth& object : objects) {
      EXPECT_TRUE(ids.insert(object.id).second && object.id > 0 && object.id < 65536) << object.id;
      EXPECT_TRUE(object.T_camera_object.matrix().allFinite());
    }
  }
  if (!miniature().truth) return;
  const SequenceTruth& written = *miniature().truth;
  const auto step = [](const SequenceTruth& t, int frame) {
    return t.camera.pose(frame)->inverse() * *t.camera.pose(frame + 1);
  };
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    ASSERT_TRUE(truth.camera.has(frame));
    if (frame < info.last_frame) {
      EXPECT_LT((step(truth, frame).inverse() * step(written, frame)).log().norm(), 1e-6);
    }
    for (const ObjectTruth& object : written.objects.at(frame)) {
      const ObjectTruth* found = truth.find(frame, object.id);
      ASSERT_NE(found, nullptr) << object.id;
      EXPECT_LT((found->T_camera_object.translation() - object.T_camera_object.translation()).norm(), 1e-6);
    }
  }
}

TEST_P(Adapters, AMissingFileIsNamedWithWhatToDo) {
  for_each_file([](const Json& options, Channels one, int frame, const std::string& file) {
    const auto opened = open(options);
    fs::remove(file);
    expect_error([&] { opened->read(frame, one); }, file);
    EXPECT_THAT(error_of([&] { open(options)->check_files(); }),
                AllOf(HasSubstr(fs::path(file).parent_path().string()),
                      testing::ContainsRegex("(frame [0-9]+ (needs its|is missing)|files named by frame "
                                             "number).*"
                                             "add (it|them)")));
  });
}

TEST_P(Adapters, ADamagedFileIsNamed) {
  for_each_file([](const Json& options, Channels one, int frame, const std::string& file) {
    const auto opened = open(options);
    const std::string good = read_file(file);
    for (const size_t left : {good.size() / 2, size_t{0}}) {
      write_file(file, good.substr(0, left));
      expect_error([&] { opened->read(frame, one); }, file + ":");
    }
  });
}

TEST_P(Adapters, AFileOfAnotherSizeIsNamedWithBothSizes) {
  for_each_file([](const Json& options, Channels one, int frame, const std::string& file) {
    const auto opened = open(options);
    write_file(file, of_another_size(file, read_file(file)));
    expect_error([&] { opened->read(frame, one); },
                 fmt::format("{}: 20x18 pixels, expected {}x{} as in ", file, opened->info().width,
                             opened->info().height));
  });
}

INSTANTIATE_TEST_SUITE_P(All, Adapters, testing::ValuesIn(adapters().begin(), adapters().end()),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Registry, NamesAreUnique) {
  std::set<std::string> names;
  for (const Adapter& adapter : adapters()) EXPECT_TRUE(names.insert(adapter.name).second) << adapter.name;
}

TEST(Registry, UnknownAdapterSuggestsTheNearest) {
  expect_error([] { open_source(SourceSpec::parse("vod:demo")); },
               "unknown adapter 'vod': did you mean 'vdo'");
}

}  // namespace
}  // namespace sextant

#include "sextant/eval/view/run_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "sextant/base/testing.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

RunConfig config_of(const std::string& source = "synthetic:s18") {
  RunConfig config;
  config.sources = {SourceSpec::parse(source)};
  config.estimator = "joint_flow";
  config.noise = Noise::parse(R"({"flow": {"epe_px": 0.5}, "depth": {"delta_d_px": 0.2}})");
  config.n_seeds = 2;
  config.quiet = true;
  return config;
}

struct Watched {
  RunResult result;
  WorstFrames worst{find_preset("paper")};
};

Watched watched(RunConfig config) {
  Watched out;
  config.on_pair = [&](const FrameResult& pair, std::span<const Record> of_pair) {
    out.worst.add(pair, of_pair);
  };
  out.result = run(config);
  return out;
}

std::string page_of(const RunConfig& config, Watched& run, const std::string& data_root = "") {
  return report_page(run_document({config, run.result, find_preset("paper"), data_root}, run.worst), 1);
}

size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(WorstFrames, AreThoseWithTheLargestErrorsOfTheFirstSeed) {
  const Watched run = watched(config_of());
  const SequenceInfo& info = run.result.sources.front().info;
  EXPECT_TRUE(run.worst.has_seen(info));
  size_t n_bodies = 0;
  for (const auto& [order, frames] : run.worst.of(info)) {
    std::vector<std::pair<double, int>> all;
    for (const Record& r : run.result.records) {
      if (r.seed == 0 && r.body == frames.front().record.body && r.status == Status::ok && has_truth(r))
        all.emplace_back(-r.errors.at("Et_m"), r.frame);
    }
    std::ranges::sort(all);
    ASSERT_EQ(frames.size(), std::min(all.size(), WorstFrames::n_frames));
    for (size_t i = 0; i < frames.size(); ++i) {
      EXPECT_EQ(frames[i].record.frame, all[i].second);
      EXPECT_EQ(frames[i].Et_m, -all[i].first);
      EXPECT_EQ(frames[i].result.n_points, frames[i].record.n_points);
      EXPECT_EQ(frames[i].prev, frames[i].record.frame - 1);
    }
    ++n_bodies;
  }
  EXPECT_GE(n_bodies, 2U);
}

TEST(RunReport, HasEveryPartAndAPictureOfEveryWorstFrame) {
  const RunConfig config = config_of();
  Watched run = watched(config);
  const std::string html = page_of(config, run);
  for (const char* part :
       {"<h2>Summary</h2>", "<h2>Errors over time</h2>", "<h2>From above</h2>",
        "<h2>Distribution of the errors</h2>", "<h2>Worst frames: synthetic s18</h2>", "<h2>Provenance</h2>",
        "<pre tabindex=\"0\">sextant view . --out view</pre>", "default-src 'none'"})
    EXPECT_THAT(html, HasSubstr(part));
  size_t n_frames = 0;
  for (const auto& [order, frames] : run.worst.of(run.result.sources.front().info)) {
    n_frames += frames.size();
    for (const WorstFrame& frame : frames)
      EXPECT_THAT(html, HasSubstr(fmt::format("href=\"view/index.html#frame={}&amp;body={}\"",
                                              frame.record.frame, frame.record.body.str())));
  }
  // Every row of the summary links to its records and states the largest error; every worst frame links to
  // its line.
  const WorstFrame& worst = run.worst.of(run.result.sources.front().info).at(0).front();
  const auto line = std::ranges::find_if(run.result.records, [&](const Record& r) {
    return r.is_ego() && r.seed == 0 && r.frame == worst.record.frame;
  });
  EXPECT_THAT(html, HasSubstr(fmt::format("<a href=\"records.jsonl\">{}</a>",
                                          line - run.result.records.begin() + 1)));
  EXPECT_THAT(html, HasSubstr("<a href=\"records.jsonl\">20; largest E_t: seed "));
  EXPECT_EQ(count(html, "src=\"data:image/jpeg;base64,/9j/"), n_frames);
  EXPECT_EQ(count(html, " src=\""), count(html, " src=\"data:"));
}

TEST(RunReport, IsTheSameWhenTheSourceWasDoneBefore) {
  const RunConfig config = config_of("synthetic:s18@0-4");
  Watched run = watched(config);
  Watched resumed;
  resumed.result = run.result;  // nothing was observed
  EXPECT_FALSE(resumed.worst.has_seen(run.result.sources.front().info));
  EXPECT_EQ(page_of(config, resumed), page_of(config, run));
}

TEST(RunReport, SeveralSourcesHaveALineAndAPageEach) {
  RunConfig config = config_of("synthetic:s18@0-2");
  config.sources.push_back(SourceSpec::parse("synthetic:s01-turn@0-2"));
  config.n_seeds = 1;
  Watched run = watched(config);
  const std::string html = page_of(config, run);
  EXPECT_THAT(html, HasSubstr("sextant view . --source synthetic:s18@0-2 --out view_"));
  EXPECT_THAT(html, HasSubstr("sextant view . --source synthetic:s01-turn@0-2 --out view_"));
}

TEST(RunReport, TheViewFromAboveNamesTheResultThatItShows) {
  const RunConfig config = config_of("synthetic:s18@0-2");
  Watched run = watched(config);
  EXPECT_THAT(page_of(config, run), Not(HasSubstr("the first by name")));
  std::vector<Record> others = run.result.records;
  for (Record& record : others) record.estimator = "other";
  run.result.records.insert(run.result.records.end(), others.begin(), others.end());
  EXPECT_THAT(page_of(config, run), HasSubstr("the first by name, is drawn here and written to tracks.csv"));
}

TEST(RunReport, NamesOfFoldersStayText) {
  RunConfig config = config_of("synthetic:s18@0-2");
  Watched run = watched(config);
  const std::string html = page_of(config, run, "/a<script>alert(1)</script> 'q' \"q\" |$\\input{x}\n;rm");
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(
      html,
      HasSubstr("--data &#39;/a&lt;script&gt;alert(1)&lt;/script&gt; &#39;\\&#39;&#39;q&#39;\\&#39;&#39;"));
}

TEST(RunReport, ExactDataHaveARunWithoutCurves) {
  RunConfig config = config_of("synthetic:s18@0-2");
  config.noise = Noise();
  Watched run = watched(config);
  EXPECT_THAT(page_of(config, run), HasSubstr("<h2>Summary</h2>"));
}

}  // namespace
}  // namespace sextant

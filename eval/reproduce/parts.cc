#include "sextant/eval/reproduce/parts.h"

#include <filesystem>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"

namespace sextant {

std::span<const EmbeddedFile> plan_files();

namespace {

std::string replaced(std::string text, const std::string& word, const std::string& by) {
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + by.size()))
    text.replace(at, word.size(), by);
  return text;
}

Part sweep_part(const char* name, PartRole role, const char* plan, const char* needs = "",
                const std::string& fetch = "") {
  Part part{name,
            role,
            PartKind::sweep,
            "",
            needs,
            fetch,
            std::string(find_entry(plan_files(), plan, "plan").text)};
  part.title = json_member<std::string>(parse_json(part.plan, plan), "name", plan);
  return part;
}

/// Experiment on the text files of Virtual KITTI, in whichever folder of the root they lie.
Part replay_part(const char* name, PartRole role, const char* plan, const std::string& data_root) {
  Part part = sweep_part(name, role, plan, "vkitti_1.3.1_text", paper().fetch("vkitti1_text"));
  const std::filesystem::path root(data_root);
  if (data_root.empty() || std::filesystem::is_directory(root / part.needs)) return part;
  part.plan = replaced(part.plan, part.needs, "vkitti_1.3.1");
  part.needs = "vkitti_1.3.1";
  return part;
}

Part showcase_part(const char* name, const char* needs = "", const std::string& fetch = "") {
  Part part = sweep_part(name, PartRole::showcase, name, needs, fetch);
  part.kind = PartKind::showcase;
  return part;
}

Part stored_part(const char* name, PartRole role, const char* title, const char* beside,
                 const char* needs = "", const std::string& fetch = "") {
  return {name, role, PartKind::stored, title, needs, fetch, "", beside};
}

}  // namespace

std::vector<Part> reproduction_parts(const std::string& data_root) {
  std::vector<Part> parts = {
      sweep_part("sets", PartRole::sets, "sets"),
      sweep_part("sets_release", PartRole::sets_paper, "sets_release"),
      sweep_part("sets_table", PartRole::sets_paper, "sets_table"),
      sweep_part("sets_text", PartRole::sets_paper, "sets_text"),
      sweep_part("attribution_release", PartRole::attribution, "attribution_release"),
      sweep_part("attribution_draws", PartRole::attribution, "attribution_draws"),
      sweep_part("attribution", PartRole::attribution, "attribution"),
      sweep_part("depth", PartRole::noise, "depth_s18"),
      sweep_part("flow", PartRole::noise, "flow_s18"),
      sweep_part("correlated", PartRole::noise_correlated, "correlated"),
      sweep_part("classification", PartRole::classification, "classification"),
      {"timing", PartRole::timing, PartKind::timing, "run time, scenario s18, one thread", "", "",
       std::string(find_entry(plan_files(), "timing", "plan").text)},
      showcase_part("showcase"),
      sweep_part("demo", PartRole::real, "demo", "kitti_03_demo", paper().fetch("demo")),
      showcase_part("showcase_demo", "kitti_03_demo", paper().fetch("demo")),
      {"recorded", PartRole::recorded, PartKind::recorded, "recorded trajectories on KITTI tracking",
       "kitti_tracking_peers", paper().fetch("peers"), ""},
      replay_part("sets_replay", PartRole::sets, "sets_replay", data_root),
      replay_part("sets_release_replay", PartRole::sets_paper, "sets_release_replay", data_root),
      replay_part("sets_table_replay", PartRole::sets_paper, "sets_table_replay", data_root),
      replay_part("sets_text_replay", PartRole::sets_paper, "sets_text_replay", data_root),
      replay_part("attribution_release_replay", PartRole::attribution, "attribution_release_replay",
                  data_root),
      replay_part("attribution_draws_replay", PartRole::attribution, "attribution_draws_replay", data_root),
      replay_part("attribution_replay", PartRole::attribution, "attribution_replay", data_root),
      replay_part("depth_replay", PartRole::noise, "depth_vkitti18", data_root),
      replay_part("flow_replay", PartRole::noise, "flow_vkitti18", data_root),
      replay_part("classification_replay", PartRole::classification, "classification_replay", data_root),
      sweep_part("sets_vkitti1", PartRole::sets, "sets_vkitti1", "vkitti_1.3.1", paper().fetch("vkitti1")),
      sweep_part("classification_vkitti1", PartRole::classification, "classification_vkitti1", "vkitti_1.3.1",
                 paper().fetch("vkitti1")),
      sweep_part("sets_vkitti2", PartRole::sets, "sets_vkitti2", "vkitti_2.0.3", paper().fetch("vkitti2")),
      sweep_part("classification_vkitti2", PartRole::classification, "classification_vkitti2", "vkitti_2.0.3",
                 paper().fetch("vkitti2")),
  };
  parts.push_back(stored_part("systems_sets", PartRole::sets, "published systems on the three sets", "sets"));
  parts.push_back(stored_part("systems_depth", PartRole::systems_noise,
                              "published systems under depth noise, scenario s18", "depth"));
  parts.push_back(stored_part("systems_demo", PartRole::real,
                              "published systems on the authors' sample of KITTI tracking 0003", "demo",
                              "kitti_03_demo", paper().fetch("demo")));
  parts.push_back(
      stored_part("systems_run", PartRole::systems, "published systems and ours in one run", "sets"));
  for (const std::string& sequence : recorded_sequences()) {
    Part& part = parts.emplace_back(
        sweep_part("kitti", PartRole::real, "kitti", "kitti_tracking", paper().fetch("kitti")));
    part.name += "_" + sequence;
    part.title = replaced(part.title, "SEQUENCE", sequence);
    part.plan = replaced(part.plan, "SEQUENCE", sequence);
  }
  return parts;
}

std::string what_is_missing(const Part& part, const std::string& data_root) {
  if (part.needs.empty()) return "";
  if (data_root.empty()) return "no data folder given (--data ROOT or SEXTANT_DATA)";
  if (!std::filesystem::is_directory(std::filesystem::path(data_root) / part.needs))
    return fmt::format("ROOT has no folder {}", part.needs);
  if (part.kind == PartKind::recorded || part.kind == PartKind::stored) return "";
  try {
    for (const SourceSpec& spec : parse_plan(part.plan, part.name, data_root).sources)
      check_runnable(spec, *open_source(spec));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace sextant

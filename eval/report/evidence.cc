#include "sextant/eval/report/evidence.h"

#include <array>

#include "sextant/base/error.h"

namespace sextant {

std::vector<const EvidencePart*> Evidence::with(PartRole role) const {
  std::vector<const EvidencePart*> found;
  for (const EvidencePart& part : parts) {
    if (part.role == role) found.push_back(&part);
  }
  return found;
}

std::optional<double> published_number(const Json& table, const std::string& key) {
  const auto it = table.find(key);
  if (it == table.end()) fail("published values: key '{}' is missing in {}", key, json_excerpt(table));
  if (it->is_null()) return std::nullopt;
  return json_member<double>(table, key, "published values");
}

std::string data_title(const std::string& dataset, const std::string& sequence) {
  struct Title {
    const char* dataset;
    const char* words;
  };
  constexpr std::array<Title, 7> titles = {{{"synthetic", "scenario"},
                                            {"replay-vkitti1", "replay of Virtual KITTI"},
                                            {"vkitti1", "Virtual KITTI 1.3.1"},
                                            {"vkitti2", "Virtual KITTI 2.0.3"},
                                            {"replay-kitti", "replay of KITTI tracking"},
                                            {"kitti", "KITTI tracking"},
                                            {"vdo", "folder"}}};
  if (dataset == "vdo" && sequence == "kitti_03_demo") return "authors' sample of KITTI tracking 0003";
  for (const Title& title : titles) {
    if (title.dataset == dataset) return fmt::format("{} {}", title.words, sequence);
  }
  return dataset + " " + sequence;
}

bool RecordFilter::matches(const Record& record) const {
  return record.dataset == dataset && record.sequence == sequence && record.frame >= first_frame &&
         record.frame <= last_frame;
}

}  // namespace sextant

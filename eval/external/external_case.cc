#include "sextant/eval/external/external_case.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/new_file.h"

namespace sextant {

CaseFolder::CaseFolder(const fs::path& folder, Keep keep)
    : keep_(folder.empty() ? std::nullopt : std::optional(keep)) {
  if (folder.empty()) {
    std::string name = (fs::temp_directory_path() / "sextant_case_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) fail("{}: cannot create this folder", name);
    path_ = name;
  } else {
    path_ = fs::absolute(folder).lexically_normal();
    fs::remove_all(path_);  // left by an interrupted run
    // OUT/external/CASE
    const fs::path cases = path_.parent_path();
    fs::create_directories(cases.parent_path());
    make_folder_below(cases.parent_path(), cases.filename() / path_.filename());
  }
  fs::create_directory(output());
}

CaseFolder::~CaseFolder() {
  std::error_code ignored;
  if (keep_ != Keep::all) fs::remove_all(input(), ignored);
  if (keep_ != Keep::all && keep_ != Keep::output) fs::remove_all(output(), ignored);
  if (!keep_) fs::remove_all(path_, ignored);
}

void write_case(const ProcessOutcome& outcome, const fs::path& folder) {
  write_file(folder / "case.json", json_line(write_options(outcome)) + "\n");
}

ProcessOutcome read_case(const fs::path& folder) {
  const fs::path path = folder / "case.json";
  if (!fs::exists(path)) fail("{}: does not exist: expected the folder of a finished case", path.string());
  if (!fs::is_directory(folder / "output"))
    fail("{}: does not exist: outputs are kept with \"keep\" output or all", (folder / "output").string());
  return options_from<ProcessOutcome>(path);
}

std::string last_line(const fs::path& path) {
  constexpr std::streamoff most = 4096;
  constexpr size_t shown = 200;
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = in.tellg();
  in.seekg(std::max<std::streamoff>(0, size - most));
  std::string line, last;
  while (std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  while (!last.empty() && (last.back() == '\r' || last.back() == ' ')) last.pop_back();
  std::ranges::replace_if(
      last, [](char c) { return c < ' ' || c > '~'; }, '?');
  return last.size() <= shown ? last : "..." + last.substr(last.size() - shown);
}

NoisySequence::NoisySequence(const Sequence& base, Noise noise, uint64_t seed, const ShownSequence& shown)
    : base_(base),
      noise_(std::move(noise)),
      draws_(seed, base.info().dataset, base.info().sequence),
      info_(base.info()),
      shift_(shown.from_zero ? base.info().first_frame : 0),
      zero_last_flow_(shown.zero_last_flow) {
  info_.exact = {};
  info_.times_s.clear();  // frames are at number / rate
  info_.first_frame -= shift_;
  info_.last_frame -= shift_;
  if (!shown.truth) return;
  truth_.camera_step_floor_m = base.truth().camera_step_floor_m;
  for (const auto& [frame, pose] : base.truth().camera.poses()) truth_.camera.set(frame - shift_, pose);
  for (const auto& [frame, objects] : base.truth().objects) truth_.objects[frame - shift_] = objects;
}

Frame NoisySequence::read(int frame, Channels channels) const {
  Channels needed = channels;
  // the noise depends on the body
  needed.mask = channels.mask || (!noise_.none() && (channels.flow || channels.backward_flow));
  Frame out = base_.read(frame + shift_, needed);
  if (!noise_.none()) out = noise_.apply(std::move(out), info_.camera, draws_).frame;
  if (!channels.mask) out.mask = {};
  out.index = frame;
  if (channels.flow && zero_last_flow_ && frame == info_.last_frame && out.flow.empty())
    out.flow = Image<Flow>(info_.width, info_.height, {0, 0});
  return out;
}

}  // namespace sextant

#include "sextant/eval/experiment/noise_of_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/eval/experiment/plan.h"

namespace sextant {
namespace {

constexpr const char* plan_file = "plan.json";

}  // namespace

NoiseOfCases::NoiseOfCases(Json plan) : plan_(std::move(plan)) {
  const Json estimators = json_list(plan_, "estimators", plan_file),
             levels = json_list(plan_, "noise", plan_file);
  const Json options = json_object(plan_, "options", plan_file);
  std::vector<std::string> extractions;  // options that determine the points of an estimator
  for (const Json& estimator : estimators) {
    const Json& owner = estimator.contains("extraction") ? estimator : options;
    const std::string extraction = json_line(json_object(owner, "extraction", plan_file));
    kind_.push_back(static_cast<size_t>(std::ranges::find(extractions, extraction) - extractions.begin()));
    if (kind_.back() == extractions.size()) extractions.push_back(extraction);
  }
  for (const Json& level : levels) is_noisy_.push_back(!json_object(level, "noise", plan_file).empty());
  n_estimators_ = estimators.size();
  n_levels_ = levels.size();
  n_seeds_ = planned_seeds(plan_, plan_file);
  n_kinds_ = extractions.size();
  counted_.resize(json_list(plan_, "sources", plan_file).size() * n_levels_ * n_seeds_ * n_kinds_);
}

NoiseOfCases::Place NoiseOfCases::place_of(uint64_t number) const {
  return {.source = number / n_seeds_ / n_levels_ / n_estimators_,
          .estimator = number / n_seeds_ / n_levels_ % n_estimators_,
          .level = number / n_seeds_ % n_levels_,
          .seed = number % n_seeds_};
}

bool NoiseOfCases::is_counted(uint64_t number) const {
  const Place at = place_of(number);
  const auto first = std::ranges::find(kind_, kind_[at.estimator]) - kind_.begin();
  return is_noisy_[at.level] && static_cast<size_t>(first) == at.estimator;
}

std::pair<size_t, size_t> NoiseOfCases::source_and_level(uint64_t number) const {
  const Place at = place_of(number);
  return {at.source, at.level};
}

void NoiseOfCases::add(uint64_t number, const Json& sums) {
  const Place at = place_of(number);
  if (!is_noisy_[at.level]) return;
  const std::string where = fmt::format("noise of case {}", number);
  if (sums.is_null()) fail("{}: is missing; run the sweep again in an empty folder", where);
  const size_t place =
      ((at.source * n_levels_ + at.level) * n_seeds_ + at.seed) * n_kinds_ + kind_[at.estimator];
  if (place >= counted_.size()) fail("{}: the plan has no case of this number", where);
  if (counted_[place]) return;
  counted_[place] = true;
  achieved_[{at.source, at.level}].merge(NoiseVerification::from_sums(sums, where));
}

void NoiseOfCases::set(const std::pair<size_t, size_t>& source_and_level, const NoiseVerification& noise) {
  const auto [source, level] = source_and_level;
  if (level >= n_levels_ || !is_noisy_[level] || source >= plan_["sources"].size())
    fail("noise of source {}, level {}: the plan adds no noise there", source, level);
  achieved_[source_and_level] = noise;
}

Json NoiseOfCases::json() const {
  Json entries = Json::array();
  for (const auto& [place, achieved] : achieved_) {
    const Json& level = plan_["noise"][place.second];
    entries.push_back(
        {{"source", json_member<std::string>(plan_["sources"][place.first], "source", plan_file)},
         {"level", json_member<double>(level, "level", plan_file)},
         {"noise", achieved.json(level["noise"])}});
  }
  return entries;
}

namespace {

constexpr int fraction_bits = 60;
constexpr int common = -1;
constexpr double largest_sum = 0x1p40;  // 10 million of them stay below 2^64

__extension__ using Wide = unsigned __int128;

/// Encodes signed numbers 0, -1, 1, -2, .. as 0, 1, 2, 3, ..
template <typename Int128>
void put_whole(Int128 value, ByteWriter& out) {
  Wide code = value < 0 ? ~(static_cast<Wide>(value) << 1U) : static_cast<Wide>(value) << 1U;
  for (; code >= 0x80; code >>= 7U) out.put(static_cast<uint8_t>(static_cast<uint8_t>(code) | 0x80U));
  out.put(static_cast<uint8_t>(code));
}

template <typename Int128>
Int128 get_whole(ByteReader& in) {
  Wide code = 0;
  for (unsigned shift = 0; shift < 126; shift += 7) {
    const auto byte = in.get<uint8_t>();
    code |= static_cast<Wide>(byte & 0x7FU) << shift;
    if (byte < 0x80)
      return (code & 1U) != 0 ? static_cast<Int128>(~(code >> 1U)) : static_cast<Int128>(code >> 1U);
  }
  in.damaged();
}

bool is_requested(const char* key) { return std::string_view(key).starts_with("requested"); }

/// Calls on_count, on_requested and on_sum for the numbers of sums, in order.
template <typename OnCount, typename OnRequested, typename OnSum>
struct EachNumber {
  OnCount on_count;
  OnRequested on_requested;
  OnSum on_sum;
  template <typename T>
  void operator()(const char* key, T& field, const char* /*unit*/, const char* /*meaning*/) {
    if constexpr (std::is_same_v<T, uint64_t>) {
      on_count(field);
    } else if constexpr (std::is_same_v<T, double>) {
      is_requested(key) ? on_requested(field) : on_sum(field);
    } else {
      field.visit(*this);
    }
  }
};

template <typename OnCount, typename OnRequested, typename OnSum>
EachNumber(OnCount, OnRequested, OnSum) -> EachNumber<OnCount, OnRequested, OnSum>;  // clang 14 deduces none

}  // namespace

struct ExactNoise::Common {
  DepthVerification depth;
  NeighbourSums depth_neighbours, flow_neighbours;
  template <typename V>
  void visit(V& v) {
    v("depth", depth, "", "");
    v("depth_neighbours", depth_neighbours, "", "");
    v("flow_neighbours", flow_neighbours, "", "");
  }
};

template <typename Sums>
ExactNoise::Part ExactNoise::part_of(Sums sums) {
  Part part;
  EachNumber each{[&](uint64_t n) { part.counts.push_back(n); },
                  [&](double x) { part.requested.push_back(x); },
                  [&](double x) {
                    if (!(std::abs(x) < largest_sum))
                      fail("noise of a case: a sum is {}: expected an absolute value below 2^40", x);
                    part.sums.push_back(static_cast<Int128>(std::nearbyint(std::ldexp(x, fraction_bits))));
                  }};
  sums.visit(each);
  return part;
}

template <typename Sums>
void ExactNoise::fill(const Part& part, Sums& sums) {
  auto count = part.counts.begin();
  auto requested = part.requested.begin();
  auto sum = part.sums.begin();
  EachNumber each{[&](uint64_t& n) { n = *count++; }, [&](double& x) { x = *requested++; },
                  [&](double& x) { x = std::ldexp(static_cast<double>(*sum++), -fraction_bits); }};
  sums.visit(each);
}

void ExactNoise::add(int key, const Part& part) {
  const auto [known, is_new] = parts_.emplace(key, part);
  if (is_new) return;
  Part& mine = known->second;
  for (size_t i = 0; i < mine.counts.size(); ++i) mine.counts[i] += part.counts[i];
  for (size_t i = 0; i < mine.sums.size(); ++i)  // unsigned: a forged file may contain any value
    mine.sums[i] = static_cast<Int128>(static_cast<Wide>(mine.sums[i]) + static_cast<Wide>(part.sums[i]));
}

void ExactNoise::add(const NoiseVerification& noise) {
  add(common, part_of(Common{noise.depth, noise.depth_neighbours, noise.flow_neighbours}));
  for (const auto& [body, flow] : noise.flow) add(body, part_of(flow));
}

void ExactNoise::add(const ExactNoise& other) {
  for (const auto& [key, part] : other.parts_) add(key, part);
}

NoiseVerification ExactNoise::total() const {
  NoiseVerification noise;
  for (const auto& [key, part] : parts_) {
    if (key != common) {
      fill(part, noise.flow[key]);
      continue;
    }
    Common sums;
    fill(part, sums);
    noise.depth = sums.depth;
    noise.depth_neighbours = sums.depth_neighbours;
    noise.flow_neighbours = sums.flow_neighbours;
  }
  return noise;
}

std::string ExactNoise::bytes() const {
  ByteWriter out;
  for (const auto& [key, part] : parts_) {
    out.varint(static_cast<uint64_t>(key - common));
    for (const double x : part.requested) out.put(x);
    for (const uint64_t n : part.counts) out.varint(n);
    for (const Int128 sum : part.sums) put_whole(sum, out);
  }
  return out.take();
}

ExactNoise ExactNoise::decode(std::string_view bytes, const std::string& where) {
  static const Part empty_common = part_of(Common()), empty_flow = part_of(FlowVerification());
  ExactNoise noise;
  ByteReader in(bytes, where);
  while (!in.at_end()) {
    const uint64_t key = in.varint();
    if (key > static_cast<uint64_t>(std::numeric_limits<int>::max())) in.damaged();
    Part part = key == 0 ? empty_common : empty_flow;
    for (double& x : part.requested) {
      x = in.get<double>();
      if (!std::isfinite(x)) in.damaged();
    }
    for (uint64_t& n : part.counts) n = in.varint();
    for (Int128& sum : part.sums) sum = get_whole<Int128>(in);
    if (!noise.parts_.emplace(static_cast<int>(key) + common, std::move(part)).second) in.damaged();
  }
  return noise;
}

std::string encode_exact_noises(const ExactNoises& noises) {
  ByteWriter out;
  for (const auto& [place, noise] : noises) {
    out.varint(place.first);
    out.varint(place.second);
    out.text(noise.bytes());
  }
  return out.take();
}

ExactNoises decode_exact_noises(std::string_view bytes, const std::string& where) {
  ExactNoises noises;
  ByteReader in(bytes, where);
  while (!in.at_end()) {
    const size_t source = in.varint(), level = in.varint();
    if (!noises.emplace(std::pair(source, level), ExactNoise::decode(in.text(), where)).second) in.damaged();
  }
  return noises;
}

}  // namespace sextant

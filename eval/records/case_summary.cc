#include "sextant/eval/records/case_summary.h"

#include <algorithm>
#include <cmath>

#include "sextant/base/byte_stream.h"
#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/eval/records/record.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

void add_record(const Record& record, BodySums& body) {
  ++body.statuses[{record.status, record.gate}];
  if (!has_truth(record)) return;
  if (record.status != Status::ok) {
    body.missed.push_back(record.frame);
    return;
  }
  ++body.n_estimated;
  for (const MetricDefinition* metric : metrics_for(compared)) {
    const double* error = find_in(record.errors, metric->name);
    if (error == nullptr) continue;
    body.errors[metric->name].add(*error);
    if (const double* bound = find_in(record.bound, metric->name)) {
      LimitSums& limit = body.limits[metric->name];
      ++limit.n;
      limit.bound_squares += *bound * *bound;
      limit.error_sum += *error;
      limit.error_squares += *error * *error;
    }
  }
  if (const double* nees = find_in(record.values, "nees")) body.nees.add(*nees);
  const double* epe = find_in(record.errors, "epe_initial_px");
  if (epe != nullptr && record.flow_truth == "given") body.epe_initial_px.add(*epe);
  const double* distance = find_in(record.values, "distance_gt_m");
  if (distance != nullptr && record.errors.contains("Et_m")) body.distance_gt_m.add(*distance);
}

void write_sums(const MeanSums& mean, ByteWriter& out) {
  out.varint(mean.n);
  if (mean.n > 0) out.put(mean.sum);
}

/// Encodes the bins: doubled distances between bins, from bin 0 on; odd if a bin has more than one value,
/// followed by their number.
void write_sums(const SampleSums& sums, ByteWriter& out) {
  out.varint(sums.n);
  if (sums.n == 0) return;
  out.put(sums.sum);
  out.put(sums.sum_squares);
  int before = LogHistogram::zero_bin;
  for (const LogHistogram::Bin& bin : sums.histogram.bins()) {
    const auto distance = static_cast<uint64_t>(bin.bin - before);
    before = bin.bin;
    out.varint(2 * distance + (bin.n > 1 ? 1 : 0));
    if (bin.n > 1) out.varint(bin.n);
  }
}

void write_sums(const LimitSums& limit, const SampleSums& error, ByteWriter& out) {
  out.varint(limit.n);
  if (limit.n == 0) return;
  out.put(limit.bound_squares);
  if (limit.n == error.n) return;
  out.put(limit.error_sum);
  out.put(limit.error_squares);
}

void write_sums(const BodySums& body, ByteWriter& out) {
  out.varint(static_cast<uint64_t>(body.body));
  out.varint(body.statuses.size());
  for (const auto& [status, n] : body.statuses) {
    out.varint(static_cast<uint64_t>(status.first) * names_of(Gate{}).size() +
               static_cast<uint64_t>(status.second));
    out.varint(n);
  }
  out.varint(body.n_estimated);
  out.varint(body.missed.size());
  int before = 0;
  for (const int frame : body.missed) {
    out.varint(static_cast<uint64_t>(frame - before));
    before = frame;
  }
  static const SampleSums none;
  for (const MetricDefinition* metric : metrics_for(compared)) {
    const auto error = body.errors.find(metric->name);
    const SampleSums& sums = error == body.errors.end() ? none : error->second;
    write_sums(sums, out);
    const auto limit = body.limits.find(metric->name);
    write_sums(limit == body.limits.end() ? LimitSums() : limit->second, sums, out);
  }
  for (const MeanSums* mean : {&body.nees, &body.epe_initial_px, &body.distance_gt_m}) write_sums(*mean, out);
}

/// Decoder with the checks that ByteReader does not make.
class SummaryDecoder {
 public:
  SummaryDecoder(std::string_view bytes, const std::string& where) : in_(bytes, where), where_(where) {}

  CaseSummary read() {
    CaseSummary out;
    out.dataset = in_.text();
    out.sequence = in_.text();
    out.noise = in_.text();
    out.level = finite();
    out.seed = in_.varint();
    for (size_t n = in_.count(2); n > 0; --n) {
      ResultSums& result = out.results.emplace_back();
      result.estimator = in_.text();
      for (size_t k = in_.count(5); k > 0; --k) result.bodies.push_back(body());
    }
    in_.expect_end();
    return out;
  }

 private:
  double finite() {
    const auto value = in_.get<double>();
    constexpr double smallest = 1e-210, largest = 1e210;  // sums of squares of record.h's numbers
    const double size = std::abs(value);
    if (!(size == 0 || (size >= smallest && size <= largest)))
      wrong("a number that is neither 0 nor of a size from 1e-210 to 1e210");
    return value;
  }
  int whole(uint64_t at_most) {
    const uint64_t value = in_.varint();
    if (value > at_most) wrong("a number that is too large");
    return static_cast<int>(value);
  }
  [[noreturn]] void wrong(const char* what) const { fail("{}: is damaged: contains {}", where_, what); }

  MeanSums mean() {
    MeanSums out;
    out.n = in_.varint();
    if (out.n > 0) out.sum = finite();
    return out;
  }

  SampleSums error() {
    SampleSums out;
    out.n = in_.varint();
    if (out.n == 0) return out;
    out.sum = finite();
    out.sum_squares = finite();
    int64_t bin = LogHistogram::zero_bin;
    for (uint64_t n = 0; n < out.n;) {
      const uint64_t code = in_.varint();
      const uint64_t count = code % 2 == 0 ? 1 : in_.varint();
      if (code / 2 > static_cast<uint64_t>(highest_bin - bin) || count == 0 || count > out.n - n ||
          (n > 0 && code < 2))
        wrong("a histogram that does not fit its number of values");
      bin += static_cast<int64_t>(code / 2);
      out.histogram.add({static_cast<int>(bin), count});
      n += count;
    }
    return out;
  }

  LimitSums limit(const SampleSums& error) {
    LimitSums out;
    out.n = in_.varint();
    if (out.n == 0) return out;
    if (out.n > error.n) wrong("more bounds than errors");
    out.bound_squares = finite();
    out.error_sum = out.n == error.n ? error.sum : finite();
    out.error_squares = out.n == error.n ? error.sum_squares : finite();
    return out;
  }

  BodySums body() {
    BodySums out;
    out.body = whole(std::numeric_limits<int>::max());
    constexpr size_t n_gates = names_of(Gate{}).size();
    for (size_t n = in_.count(2); n > 0; --n) {
      const auto code = static_cast<size_t>(whole(names_of(Status{}).size() * n_gates - 1));
      out.statuses[{static_cast<Status>(code / n_gates), static_cast<Gate>(code % n_gates)}] = in_.varint();
    }
    out.n_estimated = in_.varint();
    int frame = 0;
    for (size_t n = in_.count(1); n > 0; --n) {
      frame += whole(static_cast<uint64_t>(std::numeric_limits<int>::max() - frame));
      out.missed.push_back(frame);
    }
    for (const MetricDefinition* metric : metrics_for(compared)) {
      SampleSums sums = error();
      const LimitSums of_limit = limit(sums);
      if (of_limit.n > 0) out.limits[metric->name] = of_limit;
      if (sums.n > 0) out.errors[metric->name] = std::move(sums);
    }
    for (MeanSums* sums : {&out.nees, &out.epe_initial_px, &out.distance_gt_m}) *sums = mean();
    return out;
  }

  static constexpr int highest_bin = 1024 * LogHistogram::bins_per_octave;

  ByteReader in_;
  const std::string& where_;
};

}  // namespace

uint64_t BodySums::n_records() const {
  uint64_t n = 0;
  for (const auto& [status, count] : statuses) n += count;
  return n;
}

uint64_t CaseSummary::n_records() const {
  uint64_t n = 0;
  for (const ResultSums& result : results) {
    for (const BodySums& body : result.bodies) n += body.n_records();
  }
  return n;
}

CaseSummary summarize_case(const std::vector<Record>& records) {
  CaseSummary summary;
  if (records.empty()) return summary;
  const Record& first = records.front();
  summary.dataset = first.dataset.str();
  summary.sequence = first.sequence.str();
  summary.noise = first.noise.str();
  summary.level = first.level;
  summary.seed = first.seed;
  std::map<std::string, std::map<int, BodySums>> bodies;  // by estimator, which a case lists in that order
  for (const Record& record : records)
    add_record(record, bodies[record.estimator.str()][body_order(record.body)]);
  for (auto& [estimator, of_estimator] : bodies) {
    ResultSums& result = summary.results.emplace_back();
    result.estimator = estimator;
    for (auto& [body, sums] : of_estimator) {
      sums.body = body;
      std::ranges::sort(sums.missed);
      result.bodies.push_back(std::move(sums));
    }
  }
  return summary;
}

std::string encode_case_summary(const CaseSummary& summary) {
  ByteWriter out;
  for (const std::string* text : {&summary.dataset, &summary.sequence, &summary.noise}) out.text(*text);
  out.put(summary.level);
  out.varint(summary.seed);
  out.varint(summary.results.size());
  for (const ResultSums& result : summary.results) {
    out.text(result.estimator);
    out.varint(result.bodies.size());
    for (const BodySums& body : result.bodies) write_sums(body, out);
  }
  return out.take();
}

CaseSummary decode_case_summary(std::string_view bytes, const std::string& where) {
  return SummaryDecoder(bytes, where).read();
}

namespace {

constexpr int summary_schema = 1;
constexpr const char* kind = "case summaries";
constexpr size_t digest_bytes = 8;
constexpr size_t longest_header = 4096;

Json compared_errors() {
  Json names = Json::array();
  for (const MetricDefinition* metric : metrics_for(compared)) names.push_back(metric->name);
  return names;
}

}  // namespace

bool has_results(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "records.jsonl", ignored) ||
         std::filesystem::exists(folder / summary_file_name, ignored);
}

void check_keeps_records(const std::filesystem::path& records) {
  std::error_code ignored;
  if (std::filesystem::exists(records, ignored) || !has_results(records.parent_path())) return;
  fail(
      "{}: does not exist: the sweep kept summaries (\"keep\": \"summary\"), which only `sextant report` "
      "reads",
      records.string());
}

SummaryWriter::SummaryWriter(const std::filesystem::path& path, uint64_t n_cases) : file_(path) {
  file_.append(json_line({{"sextant", kind},
                          {"schema", summary_schema},
                          {"cases", n_cases},
                          {"errors", compared_errors()}}) +
               "\n");
}

void SummaryWriter::append(uint64_t number, std::string_view bytes) {
  ByteWriter block;
  block.varint(number);
  block.text(bytes);
  block.raw(sha256(bytes).substr(0, digest_bytes));
  file_.append(block.take());
}

void SummaryWriter::close(std::string_view noise) {
  ByteWriter block;
  block.text(noise);
  block.raw(sha256(noise).substr(0, digest_bytes));
  file_.append(block.take());
  file_.close();
}

SummaryReader::SummaryReader(const std::filesystem::path& path) : name_(path.string()) {
  // Reports problems with the path, and determines the size of the file.
  left_bytes_ = FileReader(path, recording_file).size();
  file_.open(path, std::ios::binary);
  std::string line;
  char byte = 0;
  while (line.size() < longest_header && file_.get(byte) && byte != '\n') line += byte;
  if (!file_ || byte != '\n' || !line.starts_with("{\"sextant\":"))
    fail("{}: not a file of case summaries", name_);
  left_bytes_ -= std::min<uint64_t>(left_bytes_, line.size() + 1);
  const Json header = parse_json(line, name_);
  if (json_member<std::string>(header, "sextant", name_) != kind)
    fail("{}: not a file of case summaries", name_);
  if (const int found = json_member<int>(header, "schema", name_); found != summary_schema)
    fail("{}: has schema {}, but this program reads schema {}", name_, found, summary_schema);
  if (const Json errors = json_list(header, "errors", name_); errors != compared_errors()) {
    fail("{}: sums up the errors {}, but this program compares {}; sweep again", name_, json_line(errors),
         json_line(compared_errors()));
  }
  n_cases_ = json_member<uint64_t>(header, "cases", name_);
}

void SummaryReader::cut_off() const {
  fail("{}: is truncated after {} of {} cases: sweep again", name_, n_read_, n_cases_);
}

std::string SummaryReader::take(uint64_t n) {
  if (n > left_bytes_) cut_off();
  std::string bytes(n, '\0');
  if (!file_.read(bytes.data(), static_cast<std::streamsize>(n))) cut_off();
  left_bytes_ -= n;
  return bytes;
}

uint64_t SummaryReader::varint() {
  std::string bytes;
  do {
    bytes += take(1);
  } while ((static_cast<unsigned char>(bytes.back()) & 0x80U) != 0 && bytes.size() < 10);
  return ByteReader(bytes, name_).varint();
}

std::string SummaryReader::checked(const std::string& what) {
  std::string bytes = take(varint());
  if (take(digest_bytes) != sha256(bytes).substr(0, digest_bytes))
    fail("{}: {} is damaged: its SHA-256 is not the stored one; sweep again", name_, what);
  return bytes;
}

std::optional<SummaryReader::Block> SummaryReader::next() {
  if (is_at_end_) return std::nullopt;
  if (n_read_ == n_cases_) {
    noise_ = checked("noise");
    is_at_end_ = true;
    if (left_bytes_ > 0)
      fail("{}: has more bytes than its {} cases: the file was changed or damaged", name_, n_cases_);
    return std::nullopt;
  }
  Block block;
  block.number = varint();
  block.bytes = checked(fmt::format("case {}", block.number));
  if (last_ && block.number <= *last_)
    fail("{}: case {} stands after case {}: expected ascending numbers", name_, block.number, *last_);
  last_ = block.number;
  ++n_read_;
  return block;
}

void for_each_summary(const std::filesystem::path& path,
                      const std::function<void(const CaseSummary&)>& visit) {
  SummaryReader reader(path);
  while (const auto block = reader.next())
    visit(decode_case_summary(block->bytes, fmt::format("{}: case {}", path.string(), block->number)));
}

}  // namespace sextant
